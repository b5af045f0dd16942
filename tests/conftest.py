"""Shared by all tests. Programs are not held against their ATmega328P, but where that is tested."""

import os

os.environ["KILOTWIN_NO_TWIN"] = "1"
