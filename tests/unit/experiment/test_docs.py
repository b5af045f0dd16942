"""docs/experiments.md tells every key, and its examples are sound."""

import re
from pathlib import Path

import pytest
from PIL import Image

from kilotwin.experiment.colours import LED_COLOURS
from kilotwin.experiment.docs import renewed, table
from kilotwin.experiment.schema.experiment import ExperimentSchema

from ..conftest import SMALL, Load

DOCUMENT = Path(__file__).parents[3] / "docs" / "experiments.md"
TEXT = DOCUMENT.read_text()


def test_the_table_is_of_this_schema() -> None:
    assert renewed(TEXT) == TEXT, "type: python -m kilotwin.experiment.docs docs/experiments.md"


def test_the_table_of_built_in_metrics_is_of_this_schema() -> None:
    text = (DOCUMENT.parent / "metrics.md").read_text()
    assert renewed(text) == text, "type: python -m kilotwin.experiment.docs docs/metrics.md"


def test_every_key_has_a_meaning() -> None:
    rows = [line.split(" | ") for line in table().splitlines()[2:]]
    assert len(rows) > 100
    assert [row[0] for row in rows if not row[-1].strip(" |")] == []
    for name in ExperimentSchema.model_fields:
        assert re.search(rf"`\[*{name}\b", table()), name


def test_the_colours_that_states_may_name_are_listed() -> None:
    (row,) = [line for line in TEXT.splitlines() if line.startswith("| `states` |")]
    for name, rgb in LED_COLOURS.items():
        assert f'`"{name}"` {list(rgb)}' in row


@pytest.mark.parametrize("example", re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL))
def test_examples_are_taken(example: str, load: Load, folder: Path) -> None:
    for name in ("main.c", "helpers.c", "seed.c"):
        (folder / name).write_text("int main(void) { return 0; }\n")
    (folder / "headers").mkdir()
    image = Image.new("RGB", (3, 1), (255, 255, 255))
    image.putpixel((0, 0), (0, 0, 0))
    image.putpixel((1, 0), (0xD6, 0x27, 0x28))
    for name in ("sites.png", "light.png"):
        image.save(folder / name)
    text = SMALL
    if "[swarm]" in example and "[arena]" in example:
        load(example)
        return
    if "[swarm]" in example:
        text = text[: text.index("[swarm]")]
    if "[arena]" in example:
        text = text[: text.index("[arena]")] + text[text.index("[swarm]") :]
        load(text + example, "swarm.profile=kilobot", "swarm.informed=0")
        return
    load(text + example)
