"""A table and its robots, real or emulated: buses, links, ports, flashing, measuring."""
