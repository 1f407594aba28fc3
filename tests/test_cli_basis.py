"""The command ``coverdrive basis``, as a user calls it."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from command import coverdrive
from coverdrive.config import Experiment
from coverdrive.prediction.cover.basis import Basis

GENERATED = "[generated]\nscenes = 2\nduration = 10.0\nvehicles = [8, 8]\n"


coverdrive_basis = partial(coverdrive, "basis")


@pytest.mark.slow
def test_generated_traffic(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(GENERATED)
    out = tmp_path / "out" / "bases"
    radii = ("--epsilon", "1", "--epsilon", "2", "--epsilon", "2.0000001")
    printed = coverdrive_basis("--config", tmp_path / "small.toml", *radii, "--seed", "3", "--out", tmp_path / "out")
    assert " 100 %" in printed
    assert Experiment.load(out / "config.toml").seed == 3
    record = json.loads((out / "bases.json").read_text())
    for each, name in zip(record["bases"], ("basis_1", "basis_2", "basis_2.0000001"), strict=True):
        basis = Basis.load(out / f"{name}.safetensors")
        table = pl.read_csv(out / f"{name}.csv")
        assert len(basis) == each["bases"] >= each["at_least_among_segments"] >= each["at_least_anywhere"] > 0
        points = table.select("lon", "lat").to_numpy().reshape(basis.points.shape)
        np.testing.assert_allclose(points, basis.points, rtol=1e-9)
        assert (out / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "size.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.slow
@pytest.mark.real_data
def test_300_recorded_tracks(us101: Path, tmp_path: Path) -> None:
    printed = coverdrive_basis(us101 / "tracks", "--stride", "0.1", "--epsilon", "2", "--out", tmp_path)
    assert "163,288 segments of 3 s" in printed and " 100 %" in printed
    (each,) = json.loads((tmp_path / "bases" / "bases.json").read_text())["bases"]
    assert each["covered"] == 1.0 and each["largest_distance"] <= 2
    assert len(Basis.load(tmp_path / "bases" / "basis_2.safetensors")) == each["bases"] <= 10


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["missing.csv"], "missing.csv"),
        (["--stride", "-1"], "prediction.segments.stride"),
        (["--epsilom", "1"], "--epsilom"),
        (["--dt", "0.2"], "--dt says how recordings are read, and there are none"),
    ],
)
def test_mistakes_are_explained(arguments: list[str], complaint: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert complaint in coverdrive_basis(*arguments, status=2)
    assert list(tmp_path.iterdir()) == []


def test_help_teaches() -> None:
    printed = coverdrive_basis("--help")
    assert "--epsilon" in printed and "--stride" in printed
