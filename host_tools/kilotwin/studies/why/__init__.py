"""Why a robot did something: the chain of changes and messages up to its first cause."""
