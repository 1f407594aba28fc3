"""The league: equal starts, what is kept, who is left out, and what the table says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from simulation_fakes import FAST, REPLAYED, FakeBasis, FakePredictor

from coverdrive.errors import DataError, SettingError
from coverdrive.league.entrants import Known
from coverdrive.league.league import drives_of, league
from coverdrive.league.others import OTHERS
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.progress import heard_by
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.studies.setup import Setup

KNOWN = Known(FakePredictor(FakeBasis.make()), "no paper", "no box", PlannerSettings())
PLANNERS = ("constant-velocity", "idm-mobil", "known-future")
TIMES = ("planning_median", "planning_p99", "planning_maximum", "planning_wall_p99")


def setup(kind: str = "drivers", **changes) -> Setup:
    return Setup(KNOWN.predictor, MpcPlanner(), kind, FAST, (3, 5), **changes)


def driven(folder: Path, setups: dict[str, Setup] | None = None, trials: int = 2, **options) -> pl.DataFrame:
    setups = setups or {"drivers": setup()}
    options = {"planners": PLANNERS, "worlds": list(setups)} | options
    return league(setups, KNOWN, folder, trials=trials, **options)


def drives(folder: Path) -> pl.DataFrame:
    return pl.read_csv(folder / "drives.csv").drop(TIMES)


def test_everybody_begins_the_same_drives_and_traffic_knows_the_default_alone() -> None:
    for kind in ("drivers", "set-sampling"):
        setups, starts = {kind: setup(kind)}, []
        for name in ("default", *PLANNERS[:2]):
            entered = drives_of(kind, name, KNOWN, setups, 0, None)
            assert isinstance(entered, Setup)
            trace = entered.drive(1)
            starts.append(trace.scene.states[0])
            assert trace.base[0, 1:].min() >= 0 if kind == "set-sampling" else True
        assert np.array_equal(starts[0], starts[1]) and np.array_equal(starts[0], starts[2])


def test_the_table_has_a_line_for_everybody(tmp_path: Path) -> None:
    table = driven(tmp_path)
    assert table["planner"].to_list() == list(PLANNERS)
    assert table["drives"].to_list() == [2, 2, 0]
    assert table["left_out"].to_list() == [None, None, "only replay tells it what will be"]
    assert table["sets"].to_list() == [None] * 3
    assert pl.read_csv(tmp_path / "league.csv").rows() == pl.read_csv(table.write_csv().encode()).rows()
    rows = drives(tmp_path)
    for name in PLANNERS[:2]:
        entered = drives_of("drivers", name, KNOWN, {"drivers": setup()}, 0, None)
        assert isinstance(entered, Setup)
        mine = rows.filter(pl.col("planner") == name)
        for trial in (0, 1):
            expected, row = measure(entered.drive(trial), 0, trial), mine.row(trial, named=True)
            assert row["mean_speed"] == expected["mean_speed"] and row["kind"] == expected["kind"]


def test_replays_have_no_intervals(tmp_path: Path) -> None:
    there = setup("replay", scenarios=REPLAYED["scenarios"])
    table = driven(tmp_path, {"drivers": setup(), "again": there}, planners=["keep-velocity"])
    assert [None in ends for ends in table.select("at_fault_low", "at_fault_high").rows()] == [False, True]
    assert "at_fault_high" in pl.read_csv(tmp_path / "league.csv").columns


def test_a_league_that_was_stopped_goes_on_and_ends_as_if_it_had_not_been(tmp_path: Path) -> None:
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    driven(whole)

    def stop_after(count: int):
        def hear(*_: object) -> None:
            if len(list(stopped.rglob("trials/*.parquet"))) >= count:
                raise KeyboardInterrupt

        return hear

    with pytest.raises(KeyboardInterrupt), heard_by(stop_after(3)):
        driven(stopped)
    kept = {file: file.stat().st_mtime_ns for file in stopped.rglob("trials/*.parquet")}
    assert len(kept) == 3
    driven(stopped)
    assert all(file.stat().st_mtime_ns == time for file, time in kept.items())
    assert drives(stopped).equals(drives(whole))
    assert drives(stopped).height == 4


def test_other_drives_are_not_mixed_with_those_of_a_folder(tmp_path: Path) -> None:
    driven(tmp_path, trials=1, planners=["idm-mobil"])
    with pytest.raises(DataError, match="holds a study of another configuration"):
        driven(tmp_path, {"drivers": replace(setup(), seed=1)}, trials=1, planners=["idm-mobil"])


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"worlds": ["moon"]}, "no world is called 'moon'; choose drivers, highway-env-1, .* or commonroad-st:PATHS"),
        ({"planners": ["best"]}, "no planner is called 'best'"),
        ({"trials": 0}, "at least one"),
    ],
)
def test_mistakes_are_explained(options: dict, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=complaint):
        driven(tmp_path, **options)
    assert not list(tmp_path.iterdir())


def test_worlds_of_others_are_driven_with_their_car_and_by_their_own_driver(tmp_path: Path) -> None:
    pytest.importorskip("highway_env", reason="needs the extra highway-env")
    world, planners = "highway-env-2", ("own", "constant-velocity", "idm-mobil")
    table = driven(tmp_path, {}, trials=1, planners=planners, worlds=[world], duration=1.5)
    own, ours, idm = table.rows(named=True)
    assert own["planning_median"] is None and own["share_unsafe"] is None and idm["share_unsafe"] is None
    assert ours["planning_median"] > 0 and ours["share_unsafe"] is not None
    rows = drives(tmp_path)
    assert rows["time"].gather([0, 2]).to_list() == pytest.approx([1.5, 1.5])
    assert rows["vehicles"].n_unique() == 1
    assert rows["mean_speed"].n_unique() == 3 and rows["mean_speed"].is_between(10, 35).all()
    entered = drives_of(world, "constant-velocity", KNOWN, {}, 0, 1.5)
    assert not isinstance(entered, str | Setup)
    there, driver = entered.participants()
    there.reset(0)
    ego = OTHERS[world].ego
    assert (there.car.length, there.car.width) == (ego["length"], ego["width"])
    assert driver.planner.settings.problem.cost.reference_speed == there.observe().road.speed_limit == 30.0


def test_sumo_has_its_car_and_its_limit() -> None:
    pytest.importorskip("libsumo", reason="needs the extra sumo", exc_type=ImportError)
    there = OTHERS["sumo-2000"]
    world = there.make()
    world.reset(1)
    assert (world.car.length, world.car.width) == (there.ego["length"], there.ego["width"])
    assert len(world.observe().others) > 10
