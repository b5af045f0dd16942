"""Metrics of an experiment: what is measured at each sample of a run."""
