"""Ways to robots as they are named on the command line."""

import pytest

from kilotwin.errors import InputError
from kilotwin.table.links import via
from kilotwin.table.links.via import Kind, Via, open_link, parse_via


class Device:
    """Stands for a link."""


@pytest.fixture(autouse=True)
def kinds(monkeypatch: pytest.MonkeyPatch) -> list[Via]:
    opened: list[Via] = []

    def open_(named: Via) -> Device:
        opened.append(named)
        return Device()

    table = {"grid": Kind("", open_), "ohc": Kind("PORT", open_)}  # type: ignore[arg-type]
    monkeypatch.setattr(via, "KINDS", table)
    return opened


def test_a_device_is_named_by_its_kind_and_port(kinds: list[Via]) -> None:
    named = parse_via("ohc:/dev/ttyUSB0")
    assert (named.kind, named.port, str(named)) == ("ohc", "/dev/ttyUSB0", "ohc:/dev/ttyUSB0")
    assert isinstance(open_link(named), Device)
    assert kinds == [named]


def test_a_grid_has_buses_and_a_size() -> None:
    named = parse_via("grid", ["socketcan:can0"], "4x4")
    assert (named.buses, named.size, str(named)) == (("socketcan:can0",), "4x4", "grid")


@pytest.mark.parametrize("text", ["", "ohc", "ohc:", "grid:", "grid:can0", "isp", "radio:x"])
def test_what_names_no_device_is_refused_with_all_forms(text: str) -> None:
    with pytest.raises(InputError, match=r"--via .*: allowed: grid, ohc:PORT"):
        parse_via(text)


@pytest.mark.parametrize("more", [(["can0"], None), ([], "4x4")])
def test_buses_are_for_a_grid(more: tuple[list[str], str | None]) -> None:
    with pytest.raises(InputError, match=r"are for --via grid"):
        parse_via("ohc:x", *more)
