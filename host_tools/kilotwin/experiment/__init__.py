"""Meaning of an experiment file: schema, checks, profiles, and the engine's input."""
