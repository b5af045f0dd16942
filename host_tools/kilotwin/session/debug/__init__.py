"""A run that is repeated, held at any instruction of a robot, and gone back in."""
