"""How buses are named on the command line, and what is said when one is not there."""

import gc
import warnings
from contextlib import closing

import pytest

from kilotwin.errors import DeviceError, InputError
from kilotwin.experiment.spec.overhead import WAKEUP
from kilotwin.session.job import Serving
from kilotwin.table.can.bridge import open_bridge
from kilotwin.table.can.buses import BusName, name_all, open_all, parse_bus
from kilotwin.table.grid.console import Console, message_for_robots

from ..conftest import GRID, Kilotwin, Load


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("socketcan:can0", BusName("socketcan", "can0")),
        ("slcan:/dev/ttyACM0", BusName("slcan", "/dev/ttyACM0")),
        ("slcan:socket://127.0.0.1:3333", BusName("slcan", "socket://127.0.0.1:3333")),
        ("socketcand:127.0.0.1", BusName("socketcand", None, "127.0.0.1", 29536)),
        ("socketcand:127.0.0.1:4000/can2", BusName("socketcand", "can2", "127.0.0.1", 4000)),
    ],
)
def test_names_are_understood(text: str, name: BusName) -> None:
    assert parse_bus(text) == name


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("can0", "not IFACE:CHANNEL; try socketcan:can0"),
        ("socketcam:can0", "there is no interface 'socketcam'; allowed: "),
        ("socketcand:127.0.0.1:many", "not socketcand:HOST"),
        ("socketcand:127.0.0.1:0", "not socketcand:HOST"),
    ],
)
def test_names_that_are_none_are_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=f"--can {text}: ") as caught:
        parse_bus(text)
    assert said in str(caught.value)


def test_one_server_has_all_buses() -> None:
    names = name_all(["socketcand:127.0.0.1:4000"], 3, (4, 4))
    assert [str(name) for name in names] == [
        f"socketcand:127.0.0.1:4000/can{bus}" for bus in range(3)
    ]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([], "on which CAN bus?"),
        (["socketcan:can0"], "one bus is named, but the grid has 2"),
        (["socketcand:127.0.0.1", "socketcan:can0"], "which bus? Name it"),
    ],
)
def test_as_many_buses_as_the_grid_has(names: list[str], said: str) -> None:
    with pytest.raises(InputError) as caught:
        name_all(names, 2, (4, 4))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("columns", "buses", "interfaces", "told"),
    [
        (4, 2, ["can0"], "one interface is named, but the grid has 2 buses"),
        (4, 1, ["can0", "can1"], "2 interfaces are named, but the grid has one bus"),
    ],
)
def test_one_bus_and_several_are_told_in_grammar(
    columns: int, buses: int, interfaces: list[str], told: str, load: Load
) -> None:
    experiment = load(GRID, f"grid.buses={buses}", f"grid.columns={columns}")
    with pytest.raises(InputError, match=told):
        Serving(interfaces=tuple(interfaces)).check(experiment)


def test_what_is_not_there_is_a_missing_device_with_what_to_type() -> None:
    with pytest.raises(DeviceError, match="serve world") as caught:
        open_all(name_all(["socketcand:127.0.0.1:1"], 1, (4, 4)))
    assert "refused" in str(caught.value)
    with pytest.raises(DeviceError, match=r"this computer has .*; name one that is there, or plug"):
        open_all(name_all(["socketcan:nothing7"], 1, (4, 4)))
    with pytest.raises(DeviceError, match=r"ip link set nothing7 up type can bitrate 250000"):
        open_all(name_all(["socketcan:nothing7"], 1, (4, 4)))
    with pytest.raises(
        DeviceError, match=r"/dev/nothing7 is not there; plug .*: this computer has"
    ):
        open_all(name_all(["slcan:/dev/nothing7"], 1, (4, 4)))


def test_a_table_with_fewer_buses_is_told_from_one_that_is_not_there() -> None:
    with closing(open_bridge(buses=2)) as bridge:
        server = f"socketcand:127.0.0.1:{bridge.port}"
        with pytest.raises(
            DeviceError, match=rf"{server}/can2: .*the table there has no can2"
        ) as no:
            Console.open([server], "4x4", None)
        remedy = str(no.value).rpartition("as in ")[2]
        # python-can leaves the socket of a bus that is refused to the garbage collector.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            del no
            gc.collect()
        names = [word for word in remedy.split() if word != "--can"]
        for bus in open_all(name_all(names, 2, (4, 4))):
            bus.bus.shutdown()


def test_more_buses_than_rows_are_refused() -> None:
    names = ["socketcan:can0", "socketcan:can1"]
    with pytest.raises(InputError, match="--size 4x1: 2 buses are named, but each has whole rows"):
        Console.open(names, "4x1", None)


def test_a_size_beside_an_experiment_of_another_size_is_refused(load: Load) -> None:
    names = ["socketcand:127.0.0.1:1"]
    with pytest.raises(InputError, match=r"--size 9x9: .*small\.toml has 4x6; leave --size out"):
        Console.open(names, "9x9", load(GRID))
    with pytest.raises(DeviceError, match="refused"):
        Console.open(names, "4x6", load(GRID))


def test_messages_for_robots() -> None:
    assert message_for_robots("pause", None, None) == WAKEUP
    assert message_for_robots("user", 5, "1,0x10") == bytes([1, 16, 0, 0, 0, 0, 0, 0, 0, 5])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("dance", None, None), "no such message; allowed: reset, sleep"),
        (("run", 5, None), "go with user only"),
        (("user", None, "1"), "of which type?"),
        (("user", 5, "1,2,256"), "not up to 9 bytes"),
        (("user", 5, "1,2,,"), "not up to 9 bytes"),
        (("user", 5, ",".join("1" * 10)), "not up to 9 bytes"),
    ],
)
def test_messages_that_are_none_are_refused(
    words: tuple[str, int | None, str | None], said: str
) -> None:
    with pytest.raises(InputError) as caught:
        message_for_robots(*words)
    assert said in str(caught.value)


def test_the_command_ends_with_3_where_nobody_serves(kilotwin: Kilotwin) -> None:
    done = kilotwin("grid", "ls", "--can", "socketcand:127.0.0.1:1", expect=3)
    assert done.stderr.startswith("kilotwin: --can socketcand:127.0.0.1:1/can0: ")
    assert done.stdout == ""


def test_record_needs_a_grid(kilotwin: Kilotwin) -> None:
    done = kilotwin("record", "small.toml", "--can", "socketcan:can0", expect=2)
    assert "no [grid]" in done.stderr
