"""The viewer's server: what a page in a browser gets of runs, finished or under way."""
