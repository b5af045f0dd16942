"""Studies: many runs, and what is made of them."""
