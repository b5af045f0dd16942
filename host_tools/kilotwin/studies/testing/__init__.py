"""Tests of robots' programs by pytest: the plugin, and assertions on samples."""
