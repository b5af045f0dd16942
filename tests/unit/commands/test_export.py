"""`kilotwin export` and `kilotwin view --export` write what was asked for."""

from pathlib import Path

import pytest

from kilotwin.commands.export import export
from kilotwin.commands.view import view
from kilotwin.errors import InputError

from ..known_run import Begin, samples


def test_each_kind_that_is_named_is_written(
    begin: Begin, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = begin()
    writer.add(samples([0, 10]))
    export(writer.folder, csv=tmp_path / "tables", mcap=tmp_path / "run.mcap")
    assert (tmp_path / "tables" / "robots.csv").exists()
    assert (tmp_path / "run.mcap").read_bytes().startswith(b"\x89MCAP")
    said = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in said] == [
        str(tmp_path / "tables"),
        str(tmp_path / "run.mcap"),
    ]


def test_without_a_kind_it_says_which_there_are(begin: Begin) -> None:
    with pytest.raises(InputError, match="name --csv FOLDER or --mcap FILE"):
        export(begin().folder)


def test_a_size_is_of_an_exported_page(begin: Begin) -> None:
    with pytest.raises(InputError, match=r"--size 5: .* add --export FILE\.html"):
        view([begin().folder], size=5.0)
