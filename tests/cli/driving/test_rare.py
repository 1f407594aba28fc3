"""``coverdrive rare`` as a user calls it."""

import json
from pathlib import Path

import pytest

from command import coverdrive
from coverdrive.dialling.rare import Rare


@pytest.mark.slow
def test_an_estimate_is_printed_and_kept(quick_fit: Path, tmp_path: Path) -> None:
    small = "--particles", "3", "--repetitions", "2", "--workers", "1", "--traffic", "drivers", "--vehicles", "2"
    called = "rare", quick_fit, *small, "--road", "paper", "--out", tmp_path / "rare"
    printed = coverdrive(*called, only="stdout")
    kept = tmp_path / "rare" / "collisions"
    assert "drives" in printed and (str(kept) in printed) == kept.exists() == ("none was found" not in printed)
    found = json.loads(coverdrive("--json", *called, only="stdout"))
    assert len(found["repetitions"]) == 2 and 0 <= found["probability"] <= 1
    assert "another configuration" in coverdrive(*called, "--seed", "9", status=2)
    assert "greater than or equal to 2" in coverdrive("rare", quick_fit, "--repetitions", "1", status=2).replace(
        ">=", "greater than or equal to"
    )


def test_nothing_is_driven_in_replays(quick_fit: Path, tmp_path: Path) -> None:
    for traffic in ("replay", "reactive-replay"):
        called = "rare", quick_fit, "--traffic", traffic, "--out", tmp_path / "rare"
        assert "depend on each other" in coverdrive(*called, status=2)
    assert not (tmp_path / "rare").exists()


@pytest.mark.parametrize(("names", "said"), [([], ": none was found"), (["a", "b"], ": 2, in")])
def test_the_folder_of_collisions_is_named_where_there_are_some(
    quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, names: list[str], said: str
) -> None:
    row = {
        "probability": 1e-7,
        "rarer": not names,
        "drives": 9.0,
        "seconds": 1.0,
        "collisions": names,
        "curve": [(2.0, 1e-7)],
    }
    found = Rare(tmp_path, [row, {**row, "collisions": []}])
    monkeypatch.setattr("coverdrive.dialling.rare.rare", lambda *_, **__: found)
    printed = coverdrive("rare", quick_fit, "--out", tmp_path, only="stdout")
    assert f"Drives with a collision{said}" in printed
    assert (str(tmp_path / "collisions") in printed) == bool(names)


def test_who_stops_it_is_told_what_is_kept(quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("coverdrive.dialling.rare.rare", stopped)
    said = coverdrive("rare", quick_fit, "--out", tmp_path, status=130)
    assert "stopped; finished repetitions are kept" in said
