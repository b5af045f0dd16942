"""A world is seen and steered from its page, which changes nothing in it and goes with it."""

import json
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable

import pytest
from websockets.sync.client import connect

from kilotwin import World
from kilotwin.runs.packing import head_of
from kilotwin.session.attached import PAGE

from ...steering import steer
from .test_world import TALKER

pytestmark = pytest.mark.skipif(not PAGE.exists(), reason="the viewer's page is not built")

Program = Callable[[str], str]


@pytest.fixture(autouse=True)
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """No browser opens."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


def test_a_world_is_seen_steered_and_otherwise_the_same(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    file = tmp_path_factory.mktemp("program") / "talker.c"
    file.write_text(TALKER)
    keys = {"program": str(file), "count": 3, "seed": 5}
    with World(**keys) as alone:  # type: ignore[arg-type]
        alone.run(20)
        wanted = alone.result_hash
        assert alone.view_address is None
        assert alone._repr_html_() is None
    with World(**keys, view=True) as world:  # type: ignore[arg-type]
        address = world.view_address
        assert address is not None
        assert f'src="{address}"' in str(world._repr_html_())
        world.run(20)
        assert world.result_hash == wanted
        with urllib.request.urlopen(f"{address}scenes", timeout=600) as answer:
            (scene,) = json.load(answer)
            assert "http://localhost:*" in answer.headers["Content-Security-Policy"]
        assert (scene["robots"], scene["moments"]) == (3, True)

        pose: list[float] = []

        def outside() -> None:
            steer(address, do="pause")
            with connect(address.replace("http", "ws") + "moments") as page:
                page.send("look")
                one = head_of(page.recv(60))  # type: ignore[arg-type]
                page.send("look")
                other = head_of(page.recv(60))  # type: ignore[arg-type]
            assert one["paused"]
            assert one["time_s"] == other["time_s"]
            steer(address, do="place", robot=1, x_m=0.31, y_m=-0.2)
            pose.append(one["time_s"])
            steer(address, do="speed", speed=10000)
            steer(address, do="resume")

        hand = threading.Thread(target=outside)
        hand.start()
        while hand.is_alive():
            world.run(0.2)
            time.sleep(0.001)
        hand.join()
        assert pose
        x, y, _ = world.poses[1]
        assert abs(x - 0.31) + abs(y + 0.2) < 0.05
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(address, timeout=5)
