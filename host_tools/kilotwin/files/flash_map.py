"""The chip's flash by address: where the boot section begins, and how content is laid."""

LOADER_BEGIN = 0x7000
"""Byte address of the boot section; what is below is the application's (hardware.md 1.11)."""

FLASH_BYTES = 0x8000

Segments = dict[int, bytes]
"""Bytes by the address of the first; those in between are erased."""
