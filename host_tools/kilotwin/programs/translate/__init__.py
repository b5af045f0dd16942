"""Machine code of the ATmega328P, translated to C that does the same."""
