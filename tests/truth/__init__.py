"""Comparisons of the emulation with chips, logs of real robots and the paper."""
