"""The command ``coverdrive paper``, as a user calls it."""

from functools import partial
from pathlib import Path

import polars as pl
import pytest

from command import coverdrive
from coverdrive.config import Experiment
from coverdrive.paper.tables import paper_settings

GENERATED = "[generated]\nscenes = 6\nduration = 12.0\nvehicles = [10, 12]\n"


coverdrive_paper = partial(coverdrive, "paper")


@pytest.mark.slow
def test_both_tables_of_generated_traffic(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(GENERATED)
    printed = coverdrive_paper("--config", tmp_path / "small.toml", "--out", tmp_path / "out")
    for text in ("Erratum", "0.1278", "Table 1 repeated on generated traffic", "Table 2 repeated", "PAC pooled"):
        assert text in printed
    folder = tmp_path / "out" / "paper"
    assert pl.read_csv(folder / "table_1_bounds.csv").height == 7
    growth = pl.read_csv(folder / "table_1_generated.csv")
    assert growth["samples"].is_sorted() and (growth["exact"] < growth["theorem"]).all()
    assert "per_base" in pl.read_csv(folder / "table_2_generated.csv")["method"].to_list()
    assert Experiment.load(folder / "config.toml").prediction == paper_settings()
    assert (folder / "tables_generated.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "tables_generated.pdf").read_bytes().startswith(b"%PDF")


def test_mistakes_are_explained(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "not a readable TOML file" in coverdrive_paper("--config", "missing.toml", status=2)
    assert "--dt says how recordings are read" in coverdrive_paper("--dt", "0.2", status=2)
    assert list(tmp_path.iterdir()) == []


def test_help_teaches() -> None:
    printed = coverdrive_paper("--help")
    assert "Table 1" in printed and "erratum" in printed and "--recording" in printed
