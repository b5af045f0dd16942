"""Virtual environments: a program that sees robots by a camera and sends them words by infrared."""
