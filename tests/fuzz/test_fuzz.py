"""No input breaks a decoder: a short share of what `make fuzz` and `make check-long` do."""

import shutil
import zipfile
from pathlib import Path

import pytest

from .native_targets import NATIVE
from .python_fuzz import FindingError, fuzz, inputs
from .python_targets import PYTHON, PythonTarget
from .run import CORPUS, NAMES
from .run import fuzz as fuzz_named

SHORT_RUNS = 20_000
SHORT_S = 2.0
LONG_RUNS = 10_000_000
# Decoders that take milliseconds an input: as many as an hour has.
SLOW_RUNS = {"experiment": 2_000_000, "run-folder": 200_000}


@pytest.mark.parametrize("name", NAMES)
def test_no_input_breaks_it_in_a_short_run(name: str, tmp_path: Path) -> None:
    if name in NATIVE and shutil.which("clang") is None:
        pytest.skip("clang is not here: make setup installs it")
    seconds = 3600 if name in NATIVE else SHORT_S
    assert fuzz_named(name, tmp_path, runs=SHORT_RUNS, seconds=seconds) > 20


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_no_input_breaks_it_in_a_long_run(name: str, tmp_path: Path) -> None:
    runs = SLOW_RUNS.get(name, LONG_RUNS)
    assert fuzz_named(name, tmp_path, runs=runs, seconds=24 * 3600) >= runs


def test_a_decoder_that_raises_is_found_and_the_input_is_kept(tmp_path: Path) -> None:
    def take(data: bytes) -> None:
        if data[:1] == b"(":
            raise IndexError("beyond")

    target = PythonTarget(take, lambda: [b"abc"], (b"(",))
    with pytest.raises(FindingError, match="IndexError: beyond"):
        fuzz(target, tmp_path / "finding", runs=100_000, seconds=60)
    assert (tmp_path / "finding").read_bytes()[:1] == b"("


def test_the_same_seed_gives_the_same_inputs() -> None:
    def first(seed: int) -> list[bytes]:
        return [data for data, _ in zip(inputs(PYTHON["kconf"], seed), range(500), strict=False)]

    assert first(1) == first(1) != first(2)


@pytest.mark.parametrize("name", NATIVE)
def test_a_corpus_is_kept_of_each_native_decoder(name: str) -> None:
    with zipfile.ZipFile(CORPUS / f"{name}.zip") as pack:
        assert pack.testzip() is None
        assert len(pack.namelist()) > 5
