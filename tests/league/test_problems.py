"""Planning problems as a world of the league: which ones, who solves them, what is kept, and what was not seen."""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from problem_fakes import between, box, goal, written
from recordings_fakes import driving, traffic
from simulation_fakes import FakeBasis, FakePredictor

from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.errors import DataError, MissingExtraError
from coverdrive.league import fiss, known, problems
from coverdrive.league.entrants import Known
from coverdrive.league.league import league
from coverdrive.league.problems import COLUMNS, problems_of
from coverdrive.planning.planner import PlannerSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.recordings.recording import Recording
from coverdrive.road import Road
from coverdrive.simulation.studies.comparison import compare
from coverdrive.simulation.studies.folder import StudyFolder

KNOWN = Known(FakePredictor(FakeBasis.make()), "no paper", "no box", PlannerSettings())
AHEAD, BESIDE = goal(box(92.0, -1.75, length=20.0)), goal(box(95.0, -5.25, length=20.0))
NAMES = "USA_Here-1_1_T-1", "USA_Here-1_2_T-1"


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drivability checker is taken to be there; where it is not, contacts and goals are looked at."""
    monkeypatch.setattr(problems, "find_spec", lambda _: True)


@pytest.fixture
def world(tmp_path: Path, judged: None) -> str:
    """One problem that whoever keeps lane and speed solves, and one in the next lane."""
    for name, wanted in zip(NAMES, (AHEAD, BESIDE), strict=True):
        written(tmp_path, wanted, name=name)
    return f"commonroad:{tmp_path}"


def solved(world: str, folder: Path, planners: list[str], trials: int = 9) -> pl.DataFrame:
    there = {world: problems_of(world)}
    return league({}, KNOWN, folder, planners=planners, worlds=[world], trials=trials, problems=there)


def test_a_world_names_scenarios_folders_and_patterns_once(tmp_path: Path, judged: None) -> None:
    first, second = (written(tmp_path, AHEAD, name=name) for name in NAMES)
    other = written(tmp_path, AHEAD, name="DEU_There-1_1_T-1")
    assert problems_of(f"commonroad:{tmp_path}").places == ((other, 7), (first, 7), (second, 7))
    found = problems_of(f"commonroad-st:{second},{tmp_path}/USA_*.xml")
    assert (found.model, found.files) == ("ST", (second, first))
    text = first.read_text()
    problem = text[text.index("<planningProblem ") : text.index("</planningProblem>") + len("</planningProblem>")]
    first.write_text(text.replace(problem, problem.replace('id="7"', 'id="9"') + problem))
    assert problems_of(f"commonroad:{first}").places == ((first, 7), (first, 9))


def test_what_is_missing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(problems, "find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"checker; install it with `pip install '\.\[commonroad\]'`"):
        problems_of(f"commonroad:{tmp_path}")
    monkeypatch.setattr(problems, "find_spec", lambda _: True)
    with pytest.raises(DataError, match="names no planning problems"):
        problems_of(f"commonroad:{tmp_path}")
    with pytest.raises(DataError, match=r"nothing\.xml cannot be read"):
        problems_of(f"commonroad:{tmp_path / 'nothing.xml'}")


def test_everybody_drives_the_same_problems_and_is_judged(world: str, tmp_path: Path) -> None:
    planners = ["constant-velocity", "keep-velocity", "known-future", "own"]
    table = solved(world, tmp_path / "league", planners)
    ours, kept, *out = table.rows(named=True)
    assert (ours["drives"], ours["solved"], kept["drives"], kept["solved"]) == (2, 2, 2, 1)
    assert kept["solved_minus"] == -0.5 and kept["solved_minus_low"] < -0.5 < kept["solved_minus_high"]
    assert ours["planning_median"] > 0 and ours["share_unsafe"] is not None and kept["share_unsafe"] is None
    assert [each["left_out"] for each in out] == [
        "only replay tells it what will be", "there everybody else is the world's own driver"
    ]  # fmt: skip
    rows = pl.read_csv(tmp_path / "league" / "drives.csv").filter(planner="keep-velocity")
    assert rows["scenario"].to_list() == list(NAMES) and rows["problem"].to_list() == [7, 7]
    assert rows["reason"].to_list() == ["", "goal missed: other lane"]
    assert rows["time"].to_list() == pytest.approx([5.0, 6.0])
    assert rows["progress"].to_list() == [1.0, 1.0]  # it passes the place in its own lane
    folder = next(each for each in (tmp_path / "league").iterdir() if each.is_dir())
    assert compare(folder / "constant-velocity", folder / "keep-velocity").trials == 2


@pytest.mark.slow
def test_a_league_on_problems_goes_on_and_counts_what_is_not_driven(world: str, tmp_path: Path) -> None:
    written(tmp_path, AHEAD, name="USA_Here-1_3_T-1", left=30.0)
    first = solved(world, tmp_path / "league", ["keep-velocity"], trials=2)
    kept = {file: file.stat().st_mtime_ns for file in (tmp_path / "league").rglob("trials/*.parquet")}
    assert len(kept) == 2
    table = solved(world, tmp_path / "league", ["keep-velocity"])
    assert all(file.stat().st_mtime_ns == time for file, time in kept.items())
    assert (first["drives"].item(), table["drives"].to_list()) == (2, [3])
    row = table.row(0, named=True)
    assert (row["solved"], row["at_fault"], row["not_at_fault"], row["off_road"]) == (1, 0, 0, 0)
    reasons = pl.read_csv(tmp_path / "league" / "drives.csv")["reason"]
    assert reasons[2].startswith("not driven: ") and "the start is on no road" in reasons[2]


def test_a_scenario_that_was_edited_is_another_one(world: str, tmp_path: Path) -> None:
    def claim() -> None:
        drives = problems_of(world).drives("keep-velocity", KNOWN, 0)
        assert not isinstance(drives, str)
        StudyFolder(tmp_path / "league").claim(drives.description())

    claim()
    claim()
    file = problems_of(world).files[1]
    file.write_text(file.read_text().replace("14.0", "15.0"))
    with pytest.raises(DataError, match=r"another configuration \(1 different: problems"):
        claim()


@pytest.mark.slow
def test_a_contact_is_counted_and_its_way_ends_there(tmp_path: Path, judged: None) -> None:
    written(tmp_path, goal(box(120.0, -1.75)), traffic=driving(100, 62.0, -1.75, 0.0, 60))
    table = solved(f"commonroad:{tmp_path}", tmp_path / "league", ["keep-velocity", "idm"])
    kept, careful = table.rows(named=True)
    assert (kept["at_fault"], kept["solved"]) == (1, 0)
    assert kept["progress"] == pytest.approx((62 - 4.6 / 2 - 4.508 / 2 - 20) / 97, abs=0.02)
    assert careful["at_fault"] == 0  # IDM stops


def test_fiss_is_left_out_where_it_is_not_installed(
    world: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fiss, "find_spec", lambda _: None)
    table = solved(world, tmp_path / "league", ["fiss-future"])
    assert table["left_out"].item() == 'it needs fiss-planner; install it with `pip install "fiss-planner[commonroad]"`'


@pytest.mark.parametrize(
    ("status", "reason"),
    [("success", ""), ("off_road", "off the road"), ("timeout", "goal missed"), ("collision", "collision")],
)
def test_what_fiss_drives_is_measured_as_ours_is(
    world: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: str, reason: str
) -> None:
    file = problems_of(world).files[0]
    (problem,) = read_problems(file)
    assert isinstance(problem, PlanningProblem)
    places = problem.road.to_map(20.0 + 1.4 * np.arange(11), np.full(11, 9.25))
    heading = np.full(11, float(problem.problem.initial_state.orientation))
    steps = [{"ego": (0.0, 0.0, 0.0, 14.0), "plan_ms": 2.0}] * 10
    driven = {"ego": np.stack(places, -1), "yaw": heading, "steps": steps, "vehicle": (4.5, 1.7)}
    asked = []

    def run_scenario(path: str, options: SimpleNamespace, record: bool) -> tuple[dict, dict | None]:
        asked.append((path, options.prediction))
        return {"status": status}, driven if record else None

    module = SimpleNamespace(run_scenario=run_scenario, Options=SimpleNamespace)
    monkeypatch.setattr(fiss, "import_module", lambda _: module)
    monkeypatch.setattr(fiss, "find_spec", lambda _: True)
    table = solved(world, tmp_path / "league", ["fiss-constant-velocity"], trials=1)
    assert asked == [(str(file), "constant_velocity")]
    row = pl.read_csv(tmp_path / "league" / "drives.csv", schema_overrides=COLUMNS).row(0, named=True)
    assert (row["reason"] or "", row["solved"], row["off_road"]) == (reason, not reason, status == "off_road")
    assert row["mean_speed"] == pytest.approx(14.0, abs=0.2) and row["planning_median"] == pytest.approx(2e-3)
    assert row["progress"] == pytest.approx(14.0 / (82.0 - 20.0), abs=0.01)
    assert table["not_at_fault"].item() == (status == "collision")


def test_fiss_that_fails_does_not_stop_the_league(world: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise KeyError("traffic light")

    module = SimpleNamespace(run_scenario=fails, Options=SimpleNamespace)
    monkeypatch.setattr(fiss, "import_module", lambda _: module)
    monkeypatch.setattr(fiss, "find_spec", lambda _: True)
    assert solved(world, tmp_path / "league", ["fiss-future"])["solved"].item() == 0
    reason = pl.read_csv(tmp_path / "league" / "drives.csv")["reason"][0]
    assert reason == "not driven: KeyError: 'traffic light'"


@pytest.mark.slow
@pytest.mark.skipif(not find_spec("fiss_planner"), reason="needs fiss-planner[commonroad]")
def test_fiss_itself_solves_a_drawn_problem(world: str, tmp_path: Path) -> None:
    wide = goal(box(95.0, -1.75, length=30.0, width=3.0), between("velocity", 10.0, 16.0))
    written(tmp_path, wide, name=NAMES[0])
    table = solved(world, tmp_path / "league", ["fiss-future", "fiss-constant-velocity"], trials=1)
    assert table["drives"].to_list() == [1, 1]
    assert table["solved"].to_list() == [1, 1]


@pytest.mark.slow
def test_worlds_of_long_names_have_folders_of_their_own(world: str, tmp_path: Path) -> None:
    first, second = (
        f"{world}," + ",".join(f"{tmp_path}/{name}.xml" for name in 20 * names) for names in (NAMES, NAMES[:1])
    )
    for each in (first, second):
        table = solved(each, tmp_path / "league", ["keep-velocity"], trials=1)
    assert table["world"].to_list() == [second]
    folders = [path.name for path in (tmp_path / "league").iterdir() if path.is_dir()]
    assert len(folders) == 2 and max(map(len, folders)) < 128


@dataclass(frozen=True, eq=False)
class Fitted(FakePredictor):
    """Knows what it was not fitted on."""

    certificate: frozenset[str] = frozenset()


def test_nothing_of_a_scene_was_seen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    sizes = {"a": 5, "b": 4, "c": 3, "d": 2, "e": 1}
    recordings = [Recording(name, traffic(vehicles=size), 0.1, Road.straight(), {}) for name, size in sizes.items()]
    scenes = {name: Path(f"{name}.xml") for name in (*sizes, "elsewhere")}
    shows = {**{name: frozenset(name) for name in sizes}, "elsewhere": frozenset()}
    fitted: dict[frozenset[str], Fitted] = {}

    def fit_without(names: frozenset[str], *_: object) -> Fitted:
        return fitted.setdefault(names, Fitted(FakeBasis.make(), certificate=names))

    boxed: list[set[str]] = []

    def box_of(kept, settings, certificate, seed):
        boxed.append({each.name for each in kept})
        assert boxed[-1] == set(sizes) - certificate
        return f"box {len(boxed)}", None

    monkeypatch.setattr(known, "left_out", lambda paths, files: [shows[file.stem] for file in files])
    monkeypatch.setattr(known, "fit_without", fit_without)
    monkeypatch.setattr(known, "box_of", box_of)
    files = [scenes[name] for name in (*sizes, "elsewhere", "a")]
    found = known.unseen_of(KNOWN, files, [], recordings, PredictionSettings(), 0, tmp_path, boxed=True)
    assert set(fitted) == {frozenset("a"), frozenset("b"), frozenset("c"), frozenset("de")}
    by_name = dict(zip(sizes, found, strict=False))
    assert all(name in by_name[name].predictor.certificate for name in sizes)
    assert by_name["d"] is by_name["e"] and found[-1] is found[0] and found[5] is KNOWN
    assert len({each.box for each in by_name.values()}) == len(boxed) == 4
