"""The pool that runs trials for all studies: in one way, wherever they run."""
