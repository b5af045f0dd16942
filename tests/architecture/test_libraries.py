"""A run loads no library that a plain install leaves out, nor one that few runs need."""

import subprocess
import sys

from kilotwin.files.extras import EXTRAS

# Libraries of bars on a terminal, compilers, grids, pictures and clouds, and ours of few tables.
OF_FEW_RUNS = {
    *("PIL", "cantools", "concurrent.futures", "numpy.ma", "rich"),
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
