"""`make release`: what `make wheel` made, with notes and checksums, in build/release.

Refuses a tree with changes that are not committed, a version that the CHANGELOG does not have or
that has been tagged, and the placeholder of the repository's address.
"""

import hashlib
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WHEEL, RELEASE = ROOT / "build/wheel", ROOT / "build/release"


def main() -> None:
    """With --check it only says whether a release could be made."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    version, address = project["version"], project["urls"]["Repository"]
    notes = notes_of((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), version)
    if notes is None:
        sys.exit(f"make release: CHANGELOG.md has no section [{version}]; write it")
    if "//example.org/" in address:
        sys.exit(
            f"make release: {address} in pyproject.toml (project.urls) is a placeholder; put the "
            "repository's address there and into CITATION.cff"
        )
    if changed := git("status", "--porcelain"):
        sys.exit(f"make release: commit these first, or put them away:\n{changed}")
    if git("tag", "--list", f"v{version}"):
        sys.exit(f"make release: v{version} is a tag already; give pyproject.toml a new version")
    if "--check" in sys.argv:
        return
    shutil.rmtree(RELEASE, ignore_errors=True)
    RELEASE.mkdir(parents=True)
    files = sorted([*WHEEL.glob("*.tar.gz"), *WHEEL.glob("*.whl")])
    sums = ""
    for file in files:
        shutil.copy2(file, RELEASE)
        sums += f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n"
    (RELEASE / "SHA256SUMS").write_text(sums, encoding="utf-8")
    (RELEASE / "NOTES").write_text(notes, encoding="utf-8")
    print(f"{RELEASE.relative_to(ROOT)}: {', '.join(file.name for file in files)}")
    print(f"to do: git tag v{version} && git push --tags, and upload them with NOTES")


def notes_of(changelog: str, version: str) -> str | None:
    """The section of that version, without its heading; None: there is none."""
    found = re.search(
        rf"^## \[{re.escape(version)}\][^\n]*\n(.*?)(?=^## \[|\Z)",
        changelog,
        re.MULTILINE | re.DOTALL,
    )
    return found[1].strip() + "\n" if found else None


def git(*arguments: str) -> str:
    """The output of git."""
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


if __name__ == "__main__":
    main()
