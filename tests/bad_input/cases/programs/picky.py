class Picky:
    def __init__(self, arena: object, settings: object) -> None:
        pass

    def step(self, seen: object, send: object) -> None:
        pass
