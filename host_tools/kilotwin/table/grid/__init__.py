"""A Kilogrid, real or emulated: how its modules are set up and driven, what they report."""
