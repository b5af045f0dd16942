"""Which processor runs programs whose cpu is left out, and what is said where it is no robot's."""

from pathlib import Path

import pytest

from kilotwin.experiment.experiment import Experiment

PROGRAM = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
EXPERIMENT = """\
seed = 1
duration_s = 1
[arena]
shape = "circle"
diameter_m = 2
[swarm]
profile = "{profile}"
{keys}
[[robots]]
program = "my.c"
count = 2
"""


def loaded(
    folder: Path, *, profile: str = "kilobot", keys: str = "", text: str = PROGRAM
) -> Experiment:
    (folder / "my.c").write_text(text)
    file = folder / "my.toml"
    file.write_text(EXPERIMENT.format(profile=profile, keys=keys))
    return Experiment.load(file)


def test_kilobots_run_translated_and_the_run_folder_says_so(tmp_path: Path) -> None:
    experiment = loaded(tmp_path)
    assert experiment.groups[0].tier == "translated"
    assert experiment.resolved()["robots"][0]["cpu"] == "translated"
    assert "cpu" not in experiment.resolved()["swarm"]
    assert list(experiment.notes()) == []


def test_foot_bots_run_natively_without_a_word(tmp_path: Path) -> None:
    experiment = loaded(tmp_path, profile="foot-bot")
    assert experiment.groups[0].tier == "native"
    assert "cpu" not in experiment.resolved()["robots"][0]
    assert list(experiment.notes()) == []


@pytest.mark.parametrize(("cpu", "translated"), [("native", False), ("translated", True)])
def test_a_processor_that_is_asked_for_is_what_runs(
    cpu: str, *, translated: bool, tmp_path: Path
) -> None:
    experiment = loaded(tmp_path, keys=f'cpu = "{cpu}"')
    assert (experiment.groups[0].tier == "translated") == translated
    assert experiment.resolved()["robots"][0]["cpu"] == cpu
    assert list(experiment.notes()) == []


def test_the_resolved_experiment_is_the_same_experiment(tmp_path: Path) -> None:
    experiment = loaded(tmp_path)
    (tmp_path / "resolved.toml").write_text(experiment.to_toml())
    assert Experiment.load(tmp_path / "resolved.toml").identity() == experiment.identity()


def test_without_avr_gcc_kilobots_run_natively_and_a_line_says_what_to_type(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    experiment = loaded(tmp_path)
    assert experiment.groups[0].tier == "native"
    assert experiment.resolved()["robots"][0]["cpu"] == "native"
    [note] = experiment.notes()
    assert note.endswith("avr-gcc is not here; type: apt-get install gcc-avr avr-libc binutils-avr")


def test_a_program_without_kilo_start_runs_natively_and_a_line_says_why(tmp_path: Path) -> None:
    text = "#include <kilolib.h>\nint main(void) { kilo_init(); for (;;) delay(1); }\n"
    experiment = loaded(tmp_path, text=text)
    assert experiment.groups[0].tier == "native"
    [note] = experiment.notes()
    assert "my.c runs natively (docs/limits.md): it has no kilo_start()" in note


def test_kilo_start_may_be_in_a_header_beside_it(tmp_path: Path) -> None:
    (tmp_path / "start.h").write_text("#define START kilo_start(setup, loop)\n")
    text = '#include "start.h"\n' + PROGRAM.replace("kilo_start(setup, loop)", "START")
    assert loaded(tmp_path, text=text).groups[0].tier == "translated"


def test_a_header_of_a_header_is_looked_into(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own/start.h").write_text("#define START kilo_start(setup, loop)\n")
    (tmp_path / "all.h").write_text('#include "own/start.h"\n#include "all.h"\n')
    text = '#include "all.h"\n' + PROGRAM.replace("kilo_start(setup, loop)", "START")
    assert loaded(tmp_path, text=text).groups[0].tier == "translated"


@pytest.mark.parametrize("where", ["a program beside it", "a comment of its own"])
def test_kilo_start_elsewhere_is_none_of_the_program(where: str, tmp_path: Path) -> None:
    text = "#include <kilolib.h>\nint main(void) { kilo_init(); for (;;) delay(1); }\n"
    if where == "a program beside it":
        (tmp_path / "other.c").write_text(PROGRAM)
    else:
        text += "/* was:\n   kilo_start(setup, loop); */ // kilo_start(setup, loop);\n"
    experiment = loaded(tmp_path, text=text)
    assert experiment.groups[0].tier == "native"
