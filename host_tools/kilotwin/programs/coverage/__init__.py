"""Which lines and branches of robots' programs have run, by their translated machine code."""
