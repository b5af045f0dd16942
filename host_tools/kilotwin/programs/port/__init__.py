"""Checks whether a robot program will run on the robot as it does on this computer."""
