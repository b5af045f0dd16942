"""Serial ports: the processes that have one open, and pseudo terminals that stand for one."""
