"""Tables and keys that an experiment file may have, with types, ranges and defaults."""
