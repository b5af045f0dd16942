class Picky:
    def __init__(self, arena, settings):
        pass

    def step(self, seen, send):
        pass
