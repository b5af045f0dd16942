"""Kilotwin's host tools: experiments, runs, run folders and figures behind one command."""

__version__ = "0.1.0"
