"""An experiment as engine and grid get it: numbers, messages, configurations."""
