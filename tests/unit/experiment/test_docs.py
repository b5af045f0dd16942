"""docs/experiments.md has a section for each table of a file: an example, which loads, and keys."""

import json
import re
import shutil
from pathlib import Path

import pytest
from PIL import Image

from kilotwin.experiment.colours import LED_COLOURS
from kilotwin.experiment.docs import TOP, heading, renewed, tables
from kilotwin.experiment.schema.experiment import ExperimentSchema

from ..conftest import WIRE, Load

ROOT = Path(__file__).parents[3]
DOCUMENT = ROOT / "docs" / "experiments.md"
TEXT = DOCUMENT.read_text()
SECTIONS = {heading(part): part for part in re.split(r"(?m)^(?=##+ )", TEXT)[1:]}
# Keys that an example leaves out, by the table that has it.
BEGINNING = {
    "": "duration_s = 300\n",
    "arena": "[arena]\ndiameter_m = 4.0\n",
    "swarm": '[swarm]\nprofile = "kilobot"\nprogram = "main.c"\nsize = 10\n',
}


def test_the_tables_are_of_this_schema() -> None:
    assert renewed(TEXT) == TEXT, "type: python -m kilotwin.experiment.docs docs/experiments.md"


def test_the_table_of_built_in_metrics_is_of_this_schema() -> None:
    text = (DOCUMENT.parent / "metrics.md").read_text()
    assert renewed(text) == text, "type: python -m kilotwin.experiment.docs docs/metrics.md"


def test_a_table_without_a_section_is_refused() -> None:
    without = TEXT.replace(SECTIONS["[battery]"], "")
    with pytest.raises(ValueError, match=r"no section for \[battery\]"):
        renewed(without)


def test_a_section_without_its_keys_is_refused() -> None:
    without = TEXT.replace(tables()["[battery]"], "")
    with pytest.raises(ValueError, match=r"\[battery\] has no table of keys"):
        renewed(without)


def test_every_key_has_a_meaning() -> None:
    rows = [row.split(" | ") for table in tables().values() for row in table.splitlines()[2:]]
    assert len(rows) > 200
    assert [row[0] for row in rows if not row[-1].strip(" |")] == []


def test_every_key_of_the_file_is_in_its_section_or_has_one() -> None:
    for name in ExperimentSchema.model_fields:
        titles = {f"[{name}]", f"[[{name}]]", f"[{name}.NAME]"}
        assert f"| `{name}` |" in tables()[TOP] or titles & tables().keys(), name


@pytest.mark.parametrize("title", tables())
def test_an_example_of_the_table_stands_before_its_keys(title: str) -> None:
    before = SECTIONS[title].partition("| key |")[0]
    example = "".join(re.findall(r"```toml\n(.*?)```", before, re.DOTALL))
    written = re.escape(title).replace("NAME", r"\w+")
    assert re.search(written if title != TOP else "^seed = ", example, re.MULTILINE)


def test_the_colours_that_states_may_name_are_listed() -> None:
    for name, rgb in LED_COLOURS.items():
        assert f'`"{name}"` {list(rgb)}' in tables()["[states]"]


@pytest.mark.parametrize("example", re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL))
def test_examples_are_taken(example: str, load: Load, folder: Path) -> None:
    for name in ("main.c", "helpers.c", "seed.c", "ModuleMain.c"):
        (folder / name).write_text("int main(void) { return 0; }\n")
    (folder / "headers").mkdir()
    robot = {"ID": 0, "direction": 0, "x_position": 10, "y_position": 0}
    (folder / "start_positions.json").write_text(json.dumps({"bot_positions": [robot]}))
    (folder / "tracks.csv").write_text("frame,cx,cy,theta\n0,900,500,90\n")
    (folder / "walker.wire.toml").write_text(WIRE.replace("byte = 2\n", "byte = 2\ndefault = 0\n"))
    shutil.copy(ROOT / "experiments/environment/pheromone.py", folder)
    shutil.copy(ROOT / "tests/labs/pheromone/arena.kconf", folder)
    image = Image.new("RGB", (3, 1), (255, 255, 255))
    image.putpixel((0, 0), (0, 0, 0))
    image.putpixel((1, 0), (0xD6, 0x27, 0x28))
    for name in ("sites.png", "light.png"):
        image.save(folder / name)
    load(whole(example))


def whole(example: str) -> str:
    """The example with the tables that a file needs besides."""
    has = set(re.findall(r"^\[+(\w+)", example, re.MULTILINE))
    left_out = {name: text for name, text in BEGINNING.items() if name not in has}
    if "grid" in has:
        del left_out["arena"]
    if "robots" in has:
        left_out.pop("swarm", None)
    if example.startswith(("name", "duration_s")):
        del left_out[""]
        return example + "".join(left_out.values())
    return "".join(left_out.values()) + example
