"""A run folder keeps what the run was made of, so that it can be repeated anywhere."""

from pathlib import Path

import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.parcel import parcel_of

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = """\
#include <kilolib.h>
#include "../common/colour.h"
{more}
static void setup(void) {{}}
static void loop(void) {{ set_color(COLOUR); }}
int main(void) {{ kilo_init(); kilo_start(setup, loop); return 0; }}
"""
EXPERIMENT = """
duration_s = 2
[arena]
diameter_m = 1
[swarm]
profile = "kilobot"
[[robots]]
program = "{program}"
include = ["headers"]
count = 3
[metric.number]
function = "analysis.py:number"
"""


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """A program of a folder, with headers beside it and in a folder of its own, and Python."""
    files = {
        "robots/main.c": PROGRAM.format(more="#include <sizes.h>"),
        "robots/notes.txt": "not read",
        "common/colour.h": "#define COLOUR RGB(1, 2, 3)\n",
        "headers/sizes.h": "#define SIZE 3\n",
        "headers/unused.h": "",
        "analysis.py": "import helper\ndef number(sample): return helper.number(sample)\n",
        "helper.py": "def number(sample): return float(len(sample.positions_m))\n",
        "lab.toml": EXPERIMENT.format(program="robots"),
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def load(folder: Path, **more: str) -> Experiment:
    text = (folder / "lab.toml").read_text()
    for old, new in more.items():
        text = text.replace(old, new)
    (folder / "lab.toml").write_text(text)
    return Experiment.load(folder / "lab.toml")


def test_it_has_the_files_that_are_read_as_they_lie_to_one_another(lab: Path) -> None:
    parcel = parcel_of(load(lab))
    assert sorted(parcel.files.values()) == [
        "parcel/analysis.py",
        "parcel/common/colour.h",
        "parcel/headers/sizes.h",
        "parcel/helper.py",
        "parcel/robots/main.c",
    ]


def test_the_experiment_of_the_folder_names_them_there(lab: Path, tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere" / "run"
    folder.mkdir(parents=True)
    experiment = load(lab)
    parcel = parcel_of(experiment)
    parcel.copy_to(folder)
    (folder / "experiment.toml").write_text(parcel.experiment)
    assert str(tmp_path) not in parcel.experiment
    kept = Experiment.load(folder / "experiment.toml")
    assert kept.groups[0].program.sources == (folder / "parcel/robots/main.c",)
    assert kept.groups[0].program.include_folders == (folder / "parcel/headers",)
    assert kept.functions["number"].file == folder / "parcel/analysis.py"
    assert kept.functions["number"].name == "number"
    # The parcel of a run that repeats it is the same.
    assert parcel_of(kept).files.keys() == {folder / name for name in parcel.files.values()}
    assert parcel_of(kept).experiment == parcel.experiment


def test_a_file_of_the_current_folder_does_not_take_its_place(
    lab: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, here = tmp_path / "run", tmp_path / "here"
    parcel = parcel_of(load(lab))
    for place in (folder, here):
        parcel.copy_to(place)
        (place / "experiment.toml").write_text(parcel.experiment)
    monkeypatch.chdir(here)
    kept = Experiment.load(folder / "experiment.toml")
    assert kept.groups[0].program.path == folder / "parcel/robots"


def test_programs_that_come_with_kilotwin_are_kept_too(lab: Path) -> None:
    program = "firmware/examples/random_walk_counter.c"
    parcel = parcel_of(load(lab, **{'"robots"': f'"{program}"'}))
    assert f"parcel/kilotwin/{program}" in parcel.files.values()
    assert f'program = "parcel/kilotwin/{program}"' in parcel.experiment
    assert not any("kilolib" in name for name in parcel.files.values())


def test_where_includes_are_not_plain_the_c_files_around_are_kept(lab: Path) -> None:
    more = "#define FILE <sizes.h>\n#include FILE"
    (lab / "robots/main.c").write_text(PROGRAM.format(more=more))
    names = set(parcel_of(load(lab)).files.values())
    assert {"parcel/robots/main.c", "parcel/headers/sizes.h", "parcel/headers/unused.h"} <= names
    assert "parcel/robots/notes.txt" not in names


def test_several_files_in_folders_of_their_own_are_one_program(lab: Path) -> None:
    (lab / "other").mkdir()
    (lab / "other/part.c").write_text("int part;\n")
    experiment = load(lab, **{'"robots"': '["robots/main.c", "other/part.c"]'})
    parcel = parcel_of(experiment)
    assert {"parcel/robots/main.c", "parcel/other/part.c"} <= set(parcel.files.values())
    assert '"parcel/other/part.c"' in parcel.experiment


def test_sources_may_be_left_out(lab: Path) -> None:
    experiment = load(lab, **{"[arena]": "[record]\nsources = false\n[arena]"})
    parcel = parcel_of(experiment)
    assert parcel.files == {}
    assert parcel.experiment == experiment.to_toml()


def test_headers_of_a_checkout_are_kept_however_far_above_the_program(lab: Path) -> None:
    (lab / ".git").mkdir()
    (lab / "deep/er/robots").mkdir(parents=True)
    (lab / "deep/er/robots/main.c").write_text(
        PROGRAM.format(more='#include "../../../top.h"').replace("../common", "../../../common")
    )
    (lab / "top.h").write_text("")
    files = parcel_of(load(lab, **{'"robots"': '"deep/er/robots"'})).files
    assert {"top.h", "colour.h"} <= {path.name for path in files}
