"""`python -m kilotwin` is the `kilotwin` command."""

from kilotwin.commands.cli import main

main()
