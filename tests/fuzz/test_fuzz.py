"""Input of a module and the bridge from outside, under libFuzzer with ASan and UBSan."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from kilotwin.can import transfer
from kilotwin.files.flash_image import FlashImage

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PROTOCOL = ROOT / "kilogrid_modules" / "protocol"
EMULATOR = ROOT / "emulator"
SANITIZERS = ["-g", "-O1", "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all"]
LONG_S = 240


def compile_module(target: Path) -> None:
    sources = [PROTOCOL / name for name in ("address.c", "kilogrid_can.c", "transfer.c")]
    options = ["-std=gnu99", "-fpack-struct", "-fshort-enums", "-funsigned-char", f"-I{PROTOCOL}"]
    command = ["clang", *SANITIZERS, *options, "-o", str(target)]
    subprocess.run([*command, *map(str, [HERE / "fuzz_module.c", *sources])], check=True)


def compile_socketcand(target: Path) -> None:
    sources = [HERE / "fuzz_socketcand.cpp", EMULATOR / "grid" / "socketcand.cpp"]
    command = ["clang++", *SANITIZERS, "-std=c++20", f"-I{EMULATOR}", "-o", str(target)]
    subprocess.run([*command, *map(str, sources)], check=True)


def module_seeds() -> list[bytes]:
    """Whole transfers as the host sends them, each frame after its length."""
    transfers = (
        transfer.configuration(bytes(range(48))),
        transfer.infrared(bytes(range(9)), 0x88),
        list(transfer.kilobot_program(FlashImage(bytes(range(200))))),
        list(transfer.kilobot_program(bytes(range(200)))),
        list(transfer.module_program(bytes(range(200)))),
        list(transfer.module_program(bytes(range(200)), old_loader=False)),
    )
    return [b"".join(bytes([len(f.data)]) + f.data for f in frames) for frames in transfers]


def socketcand_seeds() -> list[bytes]:
    return [b"\x05< open can0 >< rawmode >< send 7FF 3 1 AB ff >< echo >< bcmmode >"]


# How it is built, what to begin with, longest input, runs that take some seconds.
TARGETS = {
    "module": (compile_module, module_seeds, 4096, 20_000),
    "socketcand": (compile_socketcand, socketcand_seeds, 512, 20_000),
}


def fuzz(name: str, folder: Path, limit: str) -> None:
    if shutil.which("clang") is None:
        pytest.skip("clang is not here: make setup installs it")
    build, seeds, longest, _ = TARGETS[name]
    target, corpus = folder / name, folder / "corpus"
    build(target)
    corpus.mkdir()
    for number, seed in enumerate(seeds()):
        (corpus / str(number)).write_bytes(seed)
    options = [limit, f"-max_len={longest}", "-seed=1", "-print_final_stats=1"]
    command = [str(target), *options, str(corpus)]
    # Leaks are looked for by other means: that search needs a right that containers lack.
    environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-4000:]
    assert "stat::number_of_executed_units" in done.stderr


@pytest.mark.parametrize("name", TARGETS)
def test_no_input_breaks_it_in_a_short_run(name: str, tmp_path: Path) -> None:
    fuzz(name, tmp_path, f"-runs={TARGETS[name][3]}")


@pytest.mark.long
@pytest.mark.parametrize("name", TARGETS)
def test_no_input_breaks_it_in_a_long_run(name: str, tmp_path: Path) -> None:
    fuzz(name, tmp_path, f"-max_total_time={LONG_S}")
