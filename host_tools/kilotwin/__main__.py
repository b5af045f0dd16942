"""`python -m kilotwin` is the `kilotwin` command."""

from kilotwin.cli import main

main()
