"""docs/versions.md lists what stays as it is, and the code has it: a change of one shows here."""

import inspect
import re
from pathlib import Path

import pyarrow as pa

import kilotwin
from kilotwin import World, errors, testing
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.runs.columns import MODULES_SCHEMA, SENT_SCHEMA, TRACKING_SCHEMA, WORD, Records
from kilotwin.runs.folder import close_manifest
from kilotwin.session.run import new_manifest

DOCS = Path(__file__).parents[3] / "docs"
TEXT = (DOCS / "versions.md").read_text()


def test_exit_codes_are_those_that_are_listed() -> None:
    table = TEXT.partition("### Exit codes")[2].partition("###")[0]
    listed = [int(code) for code in re.findall(r"^\| (\d+) \|", table, re.MULTILINE)]
    kinds = [kind for _, kind in inspect.getmembers(errors, inspect.isclass)]
    codes = {kind.exit_code for kind in kinds if issubclass(kind, errors.KilotwinError)}
    codes |= {value for name, value in vars(errors).items() if name.startswith("EXIT_")}
    assert listed == sorted({0, *codes})


def test_tables_of_a_run_have_the_columns_that_are_listed() -> None:
    assert rows_of_tables() in TEXT, rows_of_tables()


def rows_of_tables() -> str:
    """The list of columns, as it is to stand in the document."""
    keys = ExperimentSchema.model_validate(
        {
            "name": "all columns",
            "duration_s": 1.0,
            "arena": {"shape": "circle", "diameter_m": 1.0},
            "swarm": {"profile": "kilobot", "program": "a.c", "size": 2},
            "site": [{"name": "SITE", "centre_m": [0.0, 0.0], "diameter_m": 0.1}],
            "states": {"STATE": [1, 0, 0]},
            "metric": {"METRIC": {"builtin": "spread"}},
            "record": {"also": sorted({*EXTRA_OF.values()})},
        }
    )
    records = Records.of(keys, {})
    tables = {
        "robots": records.robots_schema,
        "sites": records.sites_schema,
        "objects": records.objects_schema,
        "tracking": TRACKING_SCHEMA,
        "modules": MODULES_SCHEMA,
        "sent": SENT_SCHEMA,
    }
    rows = [
        f"| `{table}` | `{field.name}` | {'word' if field.type == WORD else field.type} | "
        f"{unit_of(field)} |"
        for table, schema in tables.items()
        for field in schema
    ]
    return "\n".join(rows)


def unit_of(field: pa.Field) -> str:
    return "the metric's" if field.name == "metric_METRIC" else field.metadata[b"unit"].decode()


def test_the_python_api_has_the_names_that_are_listed() -> None:
    fenced = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
    text = fenced.sub("", (DOCS / "python_api.md").read_text())
    members = {name for name in vars(World) if not name.startswith("_")}
    words = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]+)`", text))))
    assert members - words == set(), "docs/python_api.md does not tell of these"
    of_world = text.partition("## Stepping")[2].partition("## Batches of trials")[0]
    told = set(re.findall(r"^\| `(\w+)[`(]", of_world, re.MULTILINE))
    assert told - members == set(), "a World has lost these"
    assert set(kilotwin.__all__) == {"RGB", "Trials", "World", "__version__"}
    assert set(testing.__all__) == {"assert_share", "assert_within"}


def test_the_manifest_of_a_run_has_the_keys_that_are_listed() -> None:
    begin, end = inspect.getsource(new_manifest), inspect.getsource(close_manifest)
    listed = re.findall(r"^\| `(\w+)` \| ", TEXT.partition("### The manifest")[2], re.MULTILINE)
    written = re.findall(r'^        "(\w+)": ', begin, re.MULTILINE)
    written += re.findall(r'"(\w+)": ', end)
    assert len(written) > 5
    assert set(written) <= set(listed)
