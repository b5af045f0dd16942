"""pydantic without its plugins."""

import subprocess
import sys

import pytest

_MODEL = """
import sys
if "lean" in sys.argv:
    from kilotwin.files.lean_pydantic import leave_plugins_out
    leave_plugins_out()
from pydantic import BaseModel
class Model(BaseModel):
    x: int
print(Model(x=1).x, "importlib.metadata" in sys.modules)
"""


@pytest.mark.parametrize(
    ("words", "disabled", "looks"),
    [(["lean"], None, False), ([], None, True), (["lean"], "some-plugin", True)],
)
def test_plugins_are_looked_for_where_nothing_says_not_to(
    words: list[str], disabled: str | None, looks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PYDANTIC_DISABLE_PLUGINS", raising=False)
    if disabled is not None:
        monkeypatch.setenv("PYDANTIC_DISABLE_PLUGINS", disabled)
    command = [sys.executable, "-c", _MODEL, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"1 {looks}\n", "if it looks no more: lean_pydantic.py can go"
