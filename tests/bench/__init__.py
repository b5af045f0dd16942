"""Benchmarks that need more than Kilotwin: a browser."""
