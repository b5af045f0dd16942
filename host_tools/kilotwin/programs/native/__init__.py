"""Guests: programs compiled for this computer, with the mock Kilobot API."""
