"""A comparison with what others measured says what is wrong with what it is given."""

from pathlib import Path

import pytest
from tests.truth import against


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["paper", "programs", "a.kilodat"], "a.kilodat: only real takes logs"),
        (["real", "programs", "--where", "n=1"], "--where n=1: only sweeps have trials"),
        (["real", "programs"], "programs: not a run folder (no manifest.json); name one that "),
        (["real", "a.kilodat"], "a.kilodat: cannot be read "),
        (["real", "programs", "a.kilodat"], "1 logs do not show how real runs differ; name 3 or "),
    ],
)
def test_a_bad_comparison_is_refused(
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "programs").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["against", *words])
    try:
        code: object = against.main()
    except SystemExit as ended:
        code = ended.code
    assert code == 2
    assert said in capsys.readouterr().err
