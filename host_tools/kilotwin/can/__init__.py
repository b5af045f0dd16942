"""The Kilogrid's CAN protocol, and buses to speak it on."""
