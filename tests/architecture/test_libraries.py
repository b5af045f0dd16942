"""A run loads no library that a plain install leaves out, nor one that few runs need."""

import subprocess
import sys

from kilotwin.files.extras import EXTRAS

# Libraries of bars on a terminal, compilers, grids, pictures and clouds, and ours of few tables.
OF_FEW_RUNS = {
    *("PIL", "cantools", "concurrent.futures", "numpy.ma", "pyarrow._s3fs", "rich", "ssl"),
    *(
        "kilotwin.table.environment",
        "kilotwin.experiment.expect_names",
        "kilotwin.experiment.spec.grid_plan",
    ),
    *("kilotwin.experiment.lab_file", "kilotwin.experiment.wire_file"),
}


def loaded_by(code: str, names: set[str]) -> str:
    """Those of some modules that a program has loaded at its end, as a list."""
    code = f"import sys\n{code}\nprint(sorted(sys.modules.keys() & {sorted(names)}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_run_loads_no_library_of_an_extra() -> None:
    code = "import kilotwin.commands.run, kilotwin.session.worker"
    assert loaded_by(code, {*EXTRAS}) == "[]"


def test_a_run_loads_no_library_that_few_runs_need() -> None:
    code = "import kilotwin.commands.run, kilotwin.session.worker"
    assert loaded_by(code, OF_FEW_RUNS) == "[]"


def test_a_command_does_not_look_for_plugins_of_pydantic() -> None:
    code = "import sys; from kilotwin.commands import cli; sys.argv[1:] = ['run', '--dry-run', 'x']"
    code += "\ntry: cli.main()\nexcept SystemExit: pass"
    assert loaded_by(code, {"pydantic", "importlib.metadata"}) == "['pydantic']"


def test_tables_of_a_run_are_made_without_masked_arrays() -> None:
    """They take as long to load as a short run takes."""
    code = """
import numpy as np
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.runs.columns import Records
swarm = {"profile": "kilobot", "program": "a.c", "size": 2}
site = {"name": "den", "centre_m": [0.0, 0.0], "diameter_m": 0.1}
arena = {"shape": "circle", "diameter_m": 1.0}
keys = ExperimentSchema.model_validate(
    {"name": "n", "duration_s": 1.0, "arena": arena, "swarm": swarm, "site": [site]}
)
place = np.zeros((1, 2), np.float32)
byte = np.array([[0, 1]], np.uint8)
samples = {"tick": np.array([0]), "x_m": place, "y_m": place, "heading_rad": place}
rows = Records.of(keys, {}).robots({**samples, "led": byte, "site": byte})
assert rows.column("site").to_pylist() == [None, "den"]
"""
    # pandas, where it is, loads them: a run leaves it out.
    lean = "from kilotwin.files.lean_arrow import leave_pandas_out; leave_pandas_out()"
    assert loaded_by(lean + code, {"numpy.ma"}) == "[]"
