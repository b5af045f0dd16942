"""Assertions for tests of robots' programs (docs/testing.md); the work is in studies/testing."""

from kilotwin.studies.testing.asserts import assert_share, assert_within

__all__ = ["assert_share", "assert_within"]
