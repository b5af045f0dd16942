"""Hunts: what breaks a swarm is searched for, shrunk, and written as a scenario that fails."""
