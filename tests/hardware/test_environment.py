"""A virtual environment: an overhead controller tells single robots what is where they are."""

import json
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .conftest import ROOT, Person, Words

Told = Callable[..., Any]

LIGHTS = """
#include "ark.h"
static void on_message(message_t *message, distance_measurement_t *distance) {
    ark_word_t word;
    (void)distance;
    if (ark_find(message, &word)) set_color((uint8_t)word.value);
}
static void nothing(void) {}
int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_start(nothing, nothing);
    return 0;
}
"""
# Each robot in turn is red, while all others are blue.
CALLER = """
RED, BLUE, TURN_S = 3, 48, 5


class Caller:
    def __init__(self, arena, settings):
        self.uids = arena.uids

    def step(self, seen, send):
        called = self.uids[int(seen.time_s / TURN_S) % len(self.uids)]
        for uid in self.uids:
            send(uid, RED if uid == called else BLUE)
"""
EXPERIMENT = """
duration_s = {duration_s}

[arena]
diameter_m = 1.0

[swarm]
profile = "kilobot"
program = "lights.c"
size = {robots}

[environment]
program = "caller.py:Caller"
"""


def send_poses(address: tuple[str, int], robots: int, over: threading.Event) -> None:
    """Lines that a tracker would send of robots that no camera looks at."""
    where = {"x_m": 0, "y_m": 0, "heading_rad": 0}
    line = json.dumps({"robots": [{"uid": uid + 1, **where} for uid in range(robots)]})
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tracker:
        while not over.wait(0.1):
            tracker.sendto(line.encode(), address)


def test_41_single_robots_are_told_by_an_overhead_controller(
    told: Told, ohc: Words, robots: int, person: Person, tmp_path: Path
) -> None:
    """Words of an environment reach the robots that they are for, at the pace that we assume."""
    (tmp_path / "ark.h").write_bytes((ROOT / "experiments/environment/ark.h").read_bytes())
    (tmp_path / "lights.c").write_text(LIGHTS)
    (tmp_path / "caller.py").write_text(CALLER)
    file = tmp_path / "caller.toml"
    file.write_text(EXPERIMENT.format(robots=robots, duration_s=5 * robots))
    person(f"robots with the uids 1 to {robots} lie below the controller, awake; ready?")
    told("flash", "robots", str(tmp_path / "lights.c"), *ohc)
    person("each in turn is to become red for five seconds, while all others are blue; ready?")
    address = "127.0.0.1", 5005
    over = threading.Event()
    tracker = threading.Thread(target=send_poses, args=(address, robots, over))
    tracker.start()
    try:
        poses = ["--poses", f"udp:{address[0]}:{address[1]}"]
        done = told("record", str(file), *ohc, *poses, "--out", str(tmp_path / "run"))
    finally:
        over.set()
        tracker.join()
    assert done["environment"]["waiting"] <= robots
    person("did each robot have its turn, by its uid, and at once?")
