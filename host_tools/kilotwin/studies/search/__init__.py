"""Searches for parameters: the best ones, and those that matter, by trials of a sweep."""
