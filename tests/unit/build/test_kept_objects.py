"""Objects that many programs are linked with are compiled once, and kept."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from kilotwin.experiment.programs import Api, Program, find_program
from kilotwin.programs.cache import building
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.guest import build

pytestmark = pytest.mark.usefixtures("empty_cache")


def program(folder: Path, number: int, api: Api = "kilobot") -> Program:
    """One that is built anew for each number."""
    return find_program("blink.c", folder, (), (f"N={number}",), api)


def times(cache: Path) -> dict[Path, int]:
    """When each kept file was written."""
    return {file: file.stat().st_mtime_ns for file in cache.glob("*-objects/*")}


@pytest.mark.parametrize("build_one", [build, build_image])
def test_the_runtime_is_compiled_with_the_first_program(
    build_one: Callable[[Program], object], folder: Path, empty_cache: Path
) -> None:
    build_one(program(folder, 1))
    kept = times(empty_cache)
    assert len(kept) > 10
    build_one(program(folder, 2))
    assert times(empty_cache) == kept


def test_an_image_has_the_runtimes_objects_and_stack_usage_beside_its_own(
    folder: Path, empty_cache: Path
) -> None:
    for number in range(2):
        found = build_image(program(folder, number)).objects("kilolib")
        assert {file.name for file in times(empty_cache)} == {
            file.with_suffix(ending).name for file in found for ending in (".o", ".su")
        }


def test_a_build_leaves_no_thread(tmp_path: Path) -> None:
    before = threading.active_count()
    with building("compiling", tmp_path, print):
        assert threading.active_count() == before + 1
    assert threading.active_count() == before


def test_helpers_are_compiled_with_the_first_program_of_the_kilogrid(
    folder: Path, empty_cache: Path
) -> None:
    for number in range(2):
        build(program(folder, number, "kilogrid"))
    assert len(list(empty_cache.glob("*-objects"))) == 2


def test_builds_side_by_side_give_one_guest(folder: Path, empty_cache: Path) -> None:
    found = program(folder, 1)
    with ThreadPoolExecutor(4) as pool:
        guests = list(pool.map(build, [found] * 4))
    assert len(set(guests)) == 1
    kept = sorted(path.name for path in guests[0].file.parent.iterdir())
    assert kept == [".blink.so.sha256", "blink.so"]
    assert len(list(empty_cache.glob("*-objects"))) == 1
    # The guest, the objects, and the hash of these: no draft is left.
    assert len(list(empty_cache.iterdir())) == 3
