"""Images: programs compiled and linked for the ATmega328P."""
