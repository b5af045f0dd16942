"""Contents of files: those that come with Kilotwin, and those written whole or not at all."""
