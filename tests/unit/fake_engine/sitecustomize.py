"""On PYTHONPATH, this folder puts the fake engine into every Python process of a run."""

import importlib
import sys

sys.modules["kilotwin._emulator"] = importlib.import_module("fake_emulator")
