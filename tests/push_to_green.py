"""How long a lab waits from a push to green: the steps of the repository that `kilotwin new` makes.

`python -m tests.push_to_green` after `make wheel`: installs that wheel into an empty environment
and types the steps of the GitHub workflow, but for apt-get; first with empty caches (pip's and the
compiled programs'), then with what that left, as CI restores it. Needs PyPI. Prints a table: wall
time, and CPU time of all processes.
"""

import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

from kilotwin.files import origins, templates

ROOT = Path(__file__).resolve().parents[1]
WHEEL = ROOT / "build/wheel"
WORKFLOW = ".github/workflows/robots.yml"


def main() -> None:
    """Ends with a word if there is no wheel, or if a step is not green."""
    if not any(WHEEL.glob("*.whl")):
        sys.exit("build/wheel has no wheel; type: make wheel")
    busy, cores = os.getloadavg()[0], os.cpu_count()
    with tempfile.TemporaryDirectory(prefix="kilotwin-") as scratch:
        times = [timed(Path(scratch)) for _ in ("cold", "warm")]
    print(f"load at the begin {busy:.1f}, {cores} cores")
    print("| step | cold | warm |\n|---|---|---|")
    for step in times[0]:
        row = " | ".join("{:.0f} s ({:.0f})".format(*each[step]) for each in times)
        print(f"| {step} | {row} |")


def timed(scratch: Path) -> dict[str, tuple[float, float]]:
    """Seconds of wall and CPU time of each step, in a new environment and a new checkout."""
    home, folder = scratch / "environment", scratch / "lab"
    for old in (home, folder):
        shutil.rmtree(old, ignore_errors=True)
    templates.write("robots", folder, origins.find(str(WHEEL)))
    steps = re.findall(r"^ +- run: (.*)$", (folder / WORKFLOW).read_text(), re.MULTILINE)
    environment = {
        **os.environ,
        "PATH": f"{home / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "XDG_CACHE_HOME": str(scratch / "cache"),
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    }
    for name in ("KILOTWIN_CACHE", "KILOTWIN_NO_TWIN"):
        environment.pop(name, None)
    venv.create(home, with_pip=True)
    times = {}
    for step in steps:
        if "apt-get" in step:
            continue
        began, cpu = time.monotonic(), cpu_s()
        done = subprocess.run(
            step,
            shell=True,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            sys.exit(f"{step}\n{done.stdout}{done.stderr}")
        times[f"`{step.partition(' --')[0]}`"] = (time.monotonic() - began, cpu_s() - cpu)
    walls, cpus = zip(*times.values(), strict=True)
    return {**times, "all": (sum(walls), sum(cpus))}


def cpu_s() -> float:
    """CPU time of all processes that have been started and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
