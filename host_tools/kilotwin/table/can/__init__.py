"""The Kilogrid's CAN protocol on the host: addresses, frames, transfers."""
