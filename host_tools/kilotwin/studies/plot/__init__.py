"""Figures of run folders and of sweeps, as PNG, SVG or PDF."""
