"""Compares results with the paper's claims and with recordings of a real Kilogrid."""
