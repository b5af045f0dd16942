"""Runs for other tools: CSV tables, MCAP for Foxglove, RRD for Rerun."""
