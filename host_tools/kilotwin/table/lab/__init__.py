"""A lab's robots measured: tracks over a Kilogrid, duties that lead straight, the lab's file."""
