"""Draws docs/images/environment.png: a field of pheromone, and tracks behind a wall of light.

.venv/bin/python experiments/environment/picture.py OUT.png
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from kilotwin import RGB, World

HERE = Path(__file__).parent
BLUE = RGB(0, 0, 3)
TRAIL_S, WALL_S = 1200, 300


def draw_trail(axes):
    with World(HERE / "pheromone.toml") as world:
        world.run(TRAIL_S)
        program, poses, leds = world.environment, world.poses, world.leds
    left, bottom = program.left_m, program.bottom_m
    shown = np.log1p(program.field)
    extent = (left, -left, bottom, -bottom)
    axes.imshow(shown, origin="lower", extent=extent, cmap="Greens", interpolation="bilinear")
    for name, (x, y) in (("nest", program.nest_m), ("food", program.food_m)):
        axes.add_patch(plt.Circle((x, y), program.radius_m, fill=False, color="0.3"))
        axes.text(x, y + 1.3 * program.radius_m, name, ha="center", color="0.3")
    for (x, y, _), led in zip(poses, leds, strict=True):
        colour = "#1f5fbf" if led == BLUE else "#2ca02c"
        axes.add_patch(plt.Circle((x, y), 0.0165, color=colour))
    axes.set_title(f"a trail after {TRAIL_S:,} s: {program.trips} times food")


def draw_wall(axes):
    tracks = []
    with World(HERE / "wall.toml") as world:
        for _ in range(WALL_S):
            world.run(1)
            tracks.append(world.poses[:, :2])
        wall_m = world.environment.radius_m
    for track in np.transpose(tracks, (1, 0, 2)):
        axes.plot(*track.T, color="#2ca02c", linewidth=0.6, alpha=0.7)
        axes.add_patch(plt.Circle(track[-1], 0.0165, color="#2ca02c"))
    axes.add_patch(plt.Circle((0, 0), wall_m, fill=False, color="#d62728", linewidth=1.5))
    axes.set_title(f"a wall of light: tracks of {WALL_S} s")
    axes.set(xlim=(-0.45, 0.45), ylim=(-0.45, 0.45))


def main(file):
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
    draw_trail(left)
    draw_wall(right)
    for axes in (left, right):
        axes.set_aspect("equal")
        axes.set(xlabel="x (m)", ylabel="y (m)")
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    main(sys.argv[1])
