"""Sessions: a table, and all that takes part in a run on it."""
