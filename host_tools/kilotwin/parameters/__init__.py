"""Tables of keys with ranges, and parameters of programs as messages carry them."""
