"""Scenes stepped by the engine of this process: a digest for each scene and number of threads.

    python -m tests.same.outcome --threads 1 2 3 8 [SCENE ...]

It prints JSON: the engine's build, then by scene and number of threads 16 digits, equal where
robots, frames, prints and contacts were the same. Worlds are stepped in this process, unconfined,
so that a sanitizer's library can be loaded into it (`make tsan`).
"""

import argparse
import hashlib
import json
import math
import os
import sys
from dataclasses import dataclass

from kilotwin import World, _emulator
from kilotwin.programs.translate.translation import OPTIMISED

THREADS = (1, 2, 3, 8)
_LOOKS = 4


@dataclass(frozen=True)
class Scene:
    """An experiment, with settings, for so many simulated seconds."""

    experiment: str
    settings: tuple[str, ...]
    seconds: float


def _walk(cpu: str, medium: str, robots: int = 200, seconds: float = 30) -> Scene:
    """Walkers that hear and touch their neighbours, 200 on each m2."""
    side_m = math.sqrt(robots / 200)
    settings = (f"robots.0.cpu={cpu}", f"medium.kind={medium}", f"robots.0.count={robots}")
    table = (f"arena.width_m={side_m}", f"arena.height_m={side_m}")
    return Scene("experiments/porting/translated.toml", (*settings, *table), seconds)


SCENES = {
    "native-ideal": _walk("native", "ideal"),
    "native-kilobot": _walk("native", "kilobot"),
    "translated-ideal": _walk("translated", "ideal"),
    "translated-kilobot": _walk("translated", "kilobot"),
    # Kept by place, and brought into the cache beforehand.
    "many-ideal": _walk("native", "ideal", robots=7200, seconds=4),
    "many-kilobot": _walk("native", "kilobot", robots=7200, seconds=4),
    "floor": Scene("experiments/paper/simplified-n100.toml", (), 60),
    "walls": Scene("experiments/objects/bottleneck.toml", (), 40),
    "objects": Scene("experiments/objects/transport.toml", (), 40),
    "environment": Scene("experiments/environment/pheromone.toml", (), 40),
    "grid": Scene("experiments/kilogrid/uplink-100.toml", (), 20),
}


def digest(scene: Scene, threads: int) -> str:
    """16 hexadecimal digits of what happened in the scene."""
    settings = [*scene.settings, f"engine.threads={threads}"]
    told = hashlib.sha256()
    with World(scene.experiment, seed=3, set=settings) as world:
        for _ in range(_LOOKS):
            world.run(scene.seconds / _LOOKS)
            told.update(world.final_hash.encode())
            for array in (world.poses, world.motors, world.frames):
                told.update(array.tobytes())
        told.update(json.dumps([world.result_hash, world.stats, world.events]).encode())
    return told.hexdigest()[:16]


def main() -> None:
    """Ends with a trace where a scene cannot be run."""
    os.environ.pop("LD_PRELOAD", None)  # of this process, not of the compilers that it starts
    os.environ[OPTIMISED] = "1"
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []])
    parser.add_argument("--threads", nargs="+", type=int, default=THREADS)
    words = parser.parse_args()
    outcomes: dict[str, dict[int, str]] = {}
    for name in words.scenes or SCENES:
        outcomes[name] = {}
        for threads in words.threads:
            print(f"{name}, {threads} threads", file=sys.stderr)
            outcomes[name][threads] = digest(SCENES[name], threads)
    print(json.dumps({"build": _emulator.BUILD, "outcomes": outcomes}))


if __name__ == "__main__":
    main()
