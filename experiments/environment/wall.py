"""A wall of light: robots that leave a circle are told to turn back into it."""

import math

WALL = 1
"""The type of its words."""
SECTORS = 16


class WallOfLight:
    """Settings: `radius_m` of the wall; `again_s` until it tells a robot again."""

    def __init__(self, arena, settings):
        self.radius_m = settings.pop("radius_m")
        self.again_s = settings.pop("again_s", 3.0)
        if settings:
            raise ValueError(f"unknown settings: {', '.join(settings)}")
        if not 0 < 2 * self.radius_m < min(arena.width_m, arena.height_m):
            raise ValueError(f"radius_m is {self.radius_m}; the wall must be inside the arena")
        self.told_s = {}

    def step(self, seen, send):
        for robot in seen.robots:
            distance = math.hypot(robot.x_m, robot.y_m)
            inwards = math.atan2(-robot.y_m, -robot.x_m) - robot.heading_rad
            if distance < self.radius_m or math.cos(inwards) > 0:
                continue
            if seen.time_s - self.told_s.get(robot.uid, -math.inf) < self.again_s:
                continue
            self.told_s[robot.uid] = seen.time_s
            send(robot.uid, round(inwards / (2 * math.pi) * SECTORS) % SECTORS, WALL)
