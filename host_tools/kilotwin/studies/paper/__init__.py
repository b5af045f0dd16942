"""The paper's experiment as a user of the rest: its claims, and presets of its figures."""
