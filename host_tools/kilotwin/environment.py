"""Types that a virtual environment's program imports for its hints (docs/environment.md)."""

from kilotwin.table.environment.protocol import Arena, Environment, Seen, SeenRobot, Sender

__all__ = ["Arena", "Environment", "Seen", "SeenRobot", "Sender"]
