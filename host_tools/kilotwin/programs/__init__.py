"""Compiles programs: guests for the emulator, images for the ATmega328P."""
