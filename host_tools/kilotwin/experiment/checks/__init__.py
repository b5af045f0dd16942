"""Checks that concern several keys of an experiment."""
