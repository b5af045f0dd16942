"""Bad input ends with one line that says cause, place and remedy, with 2, and leaves nothing.

Each cases/SUBJECT/NAME.toml has what is expected of it beside it, in NAME.expected; {cases} is the
folder `cases`, where the command is run: `kilotwin run`. The .hex files of cases/hex are for
`kilotwin build --show`.
"""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from kilotwin.commands import cli

CASES = Path(__file__).parent / "cases"
GOOD = """
name = "good"
duration_s = 10

[arena]
diameter_m = {diameter_m}

[swarm]
profile = "foot-bot"
program = "{program}"
size = {size}
"""

OVER_1, STEP = "swarm/informed_share_over_1.toml", "keys/wrong_step.toml"
UNKNOWN = "keys/unknown_key.toml"

Refuse = Callable[..., str]


@pytest.fixture(autouse=True)
def clean_environment(monkeypatch: pytest.MonkeyPatch, guest_cache: Path) -> None:
    for name in [name for name in os.environ if name.startswith("KILOTWIN_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("KILOTWIN_CACHE", str(guest_cache))


@pytest.fixture
def refuse(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> Refuse:
    """`kilotwin run ...` must be refused; gives what it says. Nothing may appear anywhere.

    `command` is another one of kilotwin, `code` another exit code.
    """

    def run(*words: str, folder: Path = CASES, command: str = "run", code: int = 2) -> str:
        before = contents(folder), contents(tmp_path)
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "argv", ["kilotwin", command, *words])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        output, errors = capfd.readouterr()
        assert caught.value.code == code, errors
        assert output == ""
        assert "Traceback" not in errors
        assert "value error" not in errors.lower()  # pydantic's words
        assert (contents(folder), contents(tmp_path)) == before
        return errors

    return run


def contents(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


@pytest.mark.parametrize("case", sorted(CASES.glob("*/*.toml")), ids=lambda case: case.stem)
def test_a_bad_experiment_is_refused_in_one_line(
    case: Path, refuse: Refuse, tmp_path: Path
) -> None:
    name, out = str(case.relative_to(CASES)), str(tmp_path / "run")
    first, *others = refuse(name, "--out", out, "--quiet").splitlines()
    expected = case.with_suffix(".expected").read_text().rstrip("\n")
    assert first == "kilotwin: " + expected.replace("{cases}", str(CASES))
    # Only a compiler has more to say.
    assert bool(others) == ("does not compile" in first)


def test_every_expectation_has_its_case() -> None:
    assert [
        path.name
        for path in CASES.glob("*/*.expected")
        if not any(path.with_suffix(suffix).exists() for suffix in (".toml", ".hex"))
    ] == []


@pytest.mark.parametrize("case", sorted(CASES.glob("hex/*.hex")), ids=lambda case: case.stem)
def test_a_bad_hex_file_is_refused_in_one_line(case: Path, refuse: Refuse) -> None:
    said = refuse("--show", str(case.relative_to(CASES)), command="build")
    assert said == f"kilotwin: {case.with_suffix('.expected').read_text()}"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["programs/broken.c"], r"\S*/programs/broken.c: does not compile for the robot; mend .*"),
        (
            ["programs/nowhere.c"],
            "program 'programs/nowhere.c' is not there; name a .*",
        ),
        (
            ["programs/empty"],
            "program 'programs/empty' has no .c file in it; name .*",
        ),
        (["programs/hello.py"], "program 'programs/hello.py' is not C source; name a folder or .*"),
        (["programs/blink.c", "-D", "3"], "'3' defines no macro; write NAME, NAME=value or .*"),
        (["programs/cell.c"], r"\S*/cell.c: is a program for a Kilogrid module, .* --for module"),
        (["programs/blink.c", "--for", "module"], r"\S*/blink.c: is a program for a robot, not .*"),
    ],
)
def test_a_bad_program_becomes_no_hex_file(
    words: list[str], said: str, refuse: Refuse, tmp_path: Path
) -> None:
    output = str(tmp_path / "out.hex")
    first, *others = refuse(*words, "--hex", output, "--quiet", command="build").splitlines()
    assert re.fullmatch(f"kilotwin: {said}", first)
    # Only a compiler has more to say.
    assert bool(others) == ("does not compile" in first)


def test_a_program_beyond_the_flash_becomes_no_hex_file(refuse: Refuse, tmp_path: Path) -> None:
    words = ["programs/too_large.c", "--hex", str(tmp_path / "out.hex"), "--quiet"]
    (line,) = refuse(*words, command="build", code=1).splitlines()
    assert "bytes of flash, an image has at most 28,160 (220 pages); leave out" in line


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["hex/half_a_file.hex"], r"hex/half_a_file.hex:\d+: half a hex file, .*"),
        (["hex/wrong_checksum.hex"], r"hex/wrong_checksum.hex:\d+: wrong checksum; .*"),
        (["hex/beyond_220_pages.hex"], r"hex/beyond_220_pages.hex:\d+: .* 220 pages of 128 .*"),
        (["programs/blink.c"], r"\S*/blink.c: is a program for a robot, not for .*"),
        (["hex/nothing.hex"], r"hex/nothing.hex: no such file or directory; name a .hex file"),
        (["x.hex", "--module", "3,7"], r"--module 3: not a module; write column-row, .*: 3-7,4-7"),
        (["x.hex", "--module", "10-0"], r"--module 10-0: the grid has 10 x 20 modules; columns .*"),
        (["x.hex", "--size", "0x1"], r"--size 0x1: not COLUMNSxROWS, each 1 to 31; try 10x20"),
        (["x.hex", "-D", "N=3"], r"x.hex is built already; -I and -D are for a .c or a folder"),
    ],
)
def test_a_bad_order_to_flash_modules_reaches_no_bus(
    words: list[str], said: str, refuse: Refuse
) -> None:
    bus = ["--can", "socketcand:127.0.0.1:1"]
    first = refuse("modules", *words, *bus, "--quiet", command="flash").splitlines()[0]
    assert re.fullmatch(f"kilotwin: {said}", first)


def test_the_compilers_words_are_shown_as_they_are(refuse: Refuse) -> None:
    said = refuse("build/program_that_does_not_compile.toml")
    assert re.search(r"^\S*/programs/broken\.c:6:13: error: ", said, re.MULTILINE)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.toml"], "nowhere.toml: no such file or directory; name an experiment's"),
        (["programs"], "programs: a folder; name an experiment's TOML file"),
        (["programs/blink.c"], 'name a TOML file, with program = "blink.c" in its [[robots]]'),
        (
            [OVER_1, "--set", "swarm.informed=2"],
            "--set swarm.informed=2: ",
        ),
        (
            [OVER_1, "--set", "swarm.informed"],
            "not of the form key=value",
        ),
        (["arena/two_sites_of_one_name.toml", "--set", "site.1.nam=x"], "did you mean 'name'?"),
        (
            [STEP, "--seed", "-3", "--set", "engine.step_ticks=2"],
            "--seed -3: seed is",
        ),
    ],
)
def test_bad_words_are_named(words: list[str], said: str, refuse: Refuse) -> None:
    (line,) = refuse(*words).splitlines()
    assert line.startswith("kilotwin: ")
    assert said in line


def good(folder: Path, *, diameter_m: float = 4.0, size: int = 10) -> str:
    """The name of an experiment that could be run."""
    program = CASES / "programs" / "blink.c"
    text = GOOD.format(diameter_m=diameter_m, program=program, size=size)
    (folder / "good.toml").write_text(text)
    return "good.toml"


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ("no/out.hex", "no such file or directory; name another file"),
        ("/dev/null/out.hex", "not a directory; name another file"),
        ("good.c", "not the name of a .hex file; write good.c.hex"),
    ],
)
def test_a_hex_file_that_cannot_be_written_is_refused(
    output: str, said: str, refuse: Refuse, tmp_path: Path
) -> None:
    program = str(CASES / "programs" / "blink.c")
    words = [program, "--hex", output, "--quiet"]
    (line,) = refuse(*words, folder=tmp_path, command="build").splitlines()
    assert line == f"kilotwin: --hex {output}: {said}"


@pytest.mark.parametrize("out", ["/proc/run", "/dev/null/run", "good.toml", "good.toml/run"])
def test_a_folder_that_cannot_be_written_is_refused(
    out: str, refuse: Refuse, tmp_path: Path
) -> None:
    (line,) = refuse(good(tmp_path), "--out", out, folder=tmp_path).splitlines()
    assert line.startswith(f"kilotwin: --out {out}: ")
    assert re.search(r"; name (another|a new) folder$", line)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused(refuse: Refuse, tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o555)
    (line,) = refuse(good(tmp_path), "--out", "locked/run", folder=tmp_path).splitlines()
    assert "cannot write in" in line
    assert "permission denied" in line


def test_a_folder_in_use_is_refused(refuse: Refuse, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine.txt").write_text("mine")
    (line,) = refuse(good(tmp_path), "--out", "run", folder=tmp_path).splitlines()
    assert line == "kilotwin: --out run: the folder is not empty; name a new one"


def test_more_robots_than_the_engine_can_place_are_refused(refuse: Refuse, tmp_path: Path) -> None:
    """Few enough by area, but there is no way to put two so large ones into so small an arena."""
    file = good(tmp_path, diameter_m=0.345, size=2)
    # A busy machine may say that it compiles the program.
    *_, line = refuse(file, "--out", "run", folder=tmp_path).splitlines()
    assert line.startswith("kilotwin: good.toml:8: ")
    assert "2" in line


def test_the_installed_command_refuses_just_so(tmp_path: Path) -> None:
    """Once through a process of its own, as people call it."""
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "kilotwin",
            "run",
            UNKNOWN,
            "--out",
            tmp_path / "run",
        ],
        cwd=CASES,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == "kilotwin: " + (CASES / "keys/unknown_key.expected").read_text()
    assert done.stdout == ""
    assert not (tmp_path / "run").exists()
