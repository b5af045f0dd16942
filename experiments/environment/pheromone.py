"""A pheromone field: robots that carry food lay it below them, others are told where it is."""

import math

import numpy as np

SECTORS = 16
NOTHING, NEST, FOOD = 0, 1, 2


class Pheromone:
    """Settings: `nest_m`, `food_m` = [x, y] and their `radius_m`; `half_life_s` of what lies there;
    `lay_per_s`, 0 for a field that stays empty.
    """

    CELL_M = 0.01
    LEAST = 0.05
    """A robot smells no less than this."""

    def __init__(self, arena, settings):
        self.nest_m, self.food_m = settings.pop("nest_m"), settings.pop("food_m")
        self.radius_m = settings.pop("radius_m", 0.06)
        self.half_life_s = settings.pop("half_life_s", 120.0)
        self.lay_per_s = settings.pop("lay_per_s", 1.0)
        if settings:
            raise ValueError(f"unknown settings: {', '.join(settings)}")
        self.note = arena.note
        self.left_m, self.bottom_m = -arena.width_m / 2, -arena.height_m / 2
        self.field = np.zeros(
            (math.ceil(arena.height_m / self.CELL_M), math.ceil(arena.width_m / self.CELL_M))
        )
        self.time_s = 0.0
        self.carriers = set()
        self.trips = 0
        # Nine directions from right to left, looked at in three distances.
        self.angles = np.arange(-4, 5) * 2 * math.pi / SECTORS
        self.distances_m = np.array([0.02, 0.035, 0.05])

    def step(self, seen, send):
        passed_s, self.time_s = seen.time_s - self.time_s, seen.time_s
        self.field *= 0.5 ** (passed_s / self.half_life_s)
        for robot in seen.robots:
            here, carries = self.place_of(robot), robot.led[2] > 0
            if carries:
                row, column = self.cells(robot.x_m, robot.y_m)
                self.field[row, column] = min(
                    1, self.field[row, column] + self.lay_per_s * passed_s
                )
            self.count(robot.uid, carries, here)
            home = math.atan2(self.nest_m[1] - robot.y_m, self.nest_m[0] - robot.x_m)
            home -= robot.heading_rad
            trail = 0 if carries else self.trail_at(robot, home)
            sector = round(home / (2 * math.pi) * SECTORS) % SECTORS
            send(robot.uid, here << 8 | trail << 4 | sector)

    def place_of(self, robot):
        for place, (x, y) in ((NEST, self.nest_m), (FOOD, self.food_m)):
            if math.hypot(robot.x_m - x, robot.y_m - y) < self.radius_m:
                return place
        return NOTHING

    def count(self, uid, carries, here):
        """A trip is over when one that came with food shows that it has none."""
        if carries:
            self.carriers.add(uid)
        elif uid in self.carriers:
            self.carriers.remove(uid)
            self.trips += here == NEST
            self.note(f"robot {uid} has brought food, trip {self.trips}")

    def cells(self, x, y):
        """Row and column of places, those outside on the edge."""
        rows, columns = self.field.shape
        row = np.clip(((y - self.bottom_m) / self.CELL_M), 0, rows - 1)
        column = np.clip(((x - self.left_m) / self.CELL_M), 0, columns - 1)
        return np.asarray(row).astype(int), np.asarray(column).astype(int)

    def trail_at(self, robot, home):
        """The direction where most lies, 1 to 9, of those that lead away from the nest; 0: none."""
        angles = robot.heading_rad + self.angles[:, None]
        row, column = self.cells(
            robot.x_m + self.distances_m * np.cos(angles),
            robot.y_m + self.distances_m * np.sin(angles),
        )
        smell = self.field[row, column].sum(axis=1)
        smell[np.cos(self.angles - home) > 0.3] = 0
        best = int(smell.argmax())
        return best + 1 if smell[best] > self.LEAST else 0
