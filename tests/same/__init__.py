"""Same seed, same result: by either compiler's engine, and by any number of threads."""
