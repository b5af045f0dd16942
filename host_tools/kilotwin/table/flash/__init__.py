"""Robots flashed: images, fuses and lock bits, avrdude, and a programmer to try it on."""
