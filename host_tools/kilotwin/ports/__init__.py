"""Serial ports: who has one open, and pseudo terminals that stand for one."""
