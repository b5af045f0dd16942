"""Virtual environments: a program that sees robots by a camera and tells them by infrared.

For type hints of such a program: `from kilotwin.environment import Arena, Seen, Sender`; see
docs/environment.md.
"""

from kilotwin.environment.protocol import Arena, Environment, Seen, SeenRobot, Sender

__all__ = ["Arena", "Environment", "Seen", "SeenRobot", "Sender"]
