"""Runs experiments, emulated and recorded, and writes and reads run folders."""
