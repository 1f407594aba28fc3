"""Many scenarios: none ends the others, what is solved is kept, goes on, and runs on several processes."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from driving_fakes import PREDICTOR
from problem_fakes import TRAFFIC, between, goal, problem, written
from recordings_fakes import driving

from coverdrive.driving import batch, solved
from coverdrive.driving.batch import solve_all
from coverdrive.driving.driver import adapted
from coverdrive.driving.solved import solve
from coverdrive.driving.solving import Drive
from coverdrive.errors import DataError
from coverdrive.planning.planner import PlannerSettings
from coverdrive.settings import checked
from coverdrive.simulation.measures.trial import Row
from coverdrive.simulation.predictor import Belief

pytestmark = pytest.mark.usefixtures("unjudged")

SOON = goal(between("velocity", 0.0, 60.0), first=3, last=4)
"""reached by whoever drives on"""


def predictor_of(scenario: Path) -> Belief:
    return PREDICTOR


def three(folder: Path) -> list[Path]:
    """One that is solved, one that is none, and one that misses its goal."""
    broken = folder / "broken.xml"
    broken.write_text("<commonRoad>")
    return [
        written(folder, SOON, name="a"),
        broken,
        written(folder, goal(between("velocity", 50.0, 60.0), first=3, last=4), name="c"),
    ]


def rows_of(files: list[Path], folder: Path, **options: object) -> list[Row]:
    return [row for rows in solve_all(files, predictor_of, folder, **options) for row in rows]  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_none_ends_the_others(workers: int, tmp_path: Path) -> None:
    found = rows_of(three(tmp_path), tmp_path / "out", workers=workers)
    table = pl.read_csv(tmp_path / "out" / "solved.csv")
    assert table["scenario"].to_list() == ["a", "broken", "c"] and table["solved"].to_list() == [True, False, False]
    assert {row["scenario"]: row["reason"][:9] for row in found} == {"a": "", "broken": "not read:", "c": "goal miss"}
    solutions = table["solution"].drop_nulls().to_list()
    assert len(set(solutions)) == 2  # two files of one benchmark
    assert all((tmp_path / "out" / name).is_file() for name in solutions)


def test_goes_on_where_it_was_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files, out, driven = three(tmp_path), tmp_path / "out", list[str]()
    first = next(solve_all(files, predictor_of, out))
    assert first[0]["solved"] and (out / first[0]["solution"]).is_file()
    assert len(pl.read_csv(out / "solved.csv")) == 1

    def noted(file: Path, *rest: object) -> object:
        driven.append(file.stem)
        return solve(file, *rest)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(batch, "solve", noted)
    once = rows_of(files, out)
    assert driven == ["broken", "c"] and once[0] == first[0]
    assert rows_of(files, out) == once and driven == ["broken", "c"]
    (out / once[0]["solution"]).unlink()
    rows_of(files, out)
    assert driven == ["broken", "c", "a"]
    files[2].write_text(files[2].read_text().replace("50.0", "0.0"))
    assert rows_of(files, out)[2]["solved"] and driven[3:] == ["c"]
    rows_of(files, out, model="ST")
    assert driven[4:] == ["a", "broken", "c"]
    (out / "solved.csv").write_text("some,table\n1,2\n")
    assert len(rows_of(files, out)) == 3


def test_two_at_once_do_not_solve_into_one_folder(tmp_path: Path) -> None:
    files, out = three(tmp_path), tmp_path / "out"
    first = solve_all(files, predictor_of, out)
    next(first)
    with pytest.raises(DataError, match=r"writes to .*out; wait"):
        rows_of(files[2:], out)
    assert len(list(first)) == 2 and len(rows_of(files, out)) == 3


class Around:
    """A belief of a user's, without a hash."""

    def __init__(self, share: float):
        self.share = share

    def predict(self, *scene: Any) -> Any:
        return PREDICTOR.predict(*scene)


def test_an_own_belief_goes_on_until_it_is_made_with_something_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files, driven = [written(tmp_path, SOON)], list[float]()

    def noted(file: Path, belief: Around, *rest: Any) -> object:
        driven.append(belief.share)
        return solve(file, belief, *rest)

    monkeypatch.setattr(batch, "solve", noted)
    for share in (1.0, 1.0, 2.0):
        list(solve_all(files, lambda _, share=share: Around(share), tmp_path / "out"))
    assert driven == [1.0, 2.0]


def test_settings_of_the_planner_are_driven_with(tmp_path: Path) -> None:
    """And rows that were made with others are replaced; size and wanted speed are those of car and problem."""
    files, out = [written(tmp_path, SOON)], tmp_path / "out"
    even = checked(PlannerSettings, {"problem": {"cost": {"acceleration_change": 50.0}}})
    large = adapted(PlannerSettings(), length=9.0, width=2.5, wanted_speed=3.0)
    (usual,) = rows_of(files, out)
    assert rows_of(files, out, planner=PlannerSettings()) == [usual]
    jerks = [rows_of(files, out, planner=each)[0]["jerk_longitudinal"] for each in (even, large)]
    assert jerks[0] < 0.7 * usual["jerk_longitudinal"] and jerks[1] == usual["jerk_longitudinal"]


def test_other_scenarios_stay_in_the_table(tmp_path: Path) -> None:
    """And so do their solutions, be they of the same benchmark; what is there of a changed scenario is replaced."""
    out, (a, _, b) = tmp_path / "out", three(tmp_path)
    (first,) = rows_of([a], out)
    solution = (out / first["solution"]).read_bytes()
    (second,) = rows_of([b], out)
    table = pl.read_csv(out / "solved.csv")
    assert table["scenario"].to_list() == ["a", "c"]
    assert table["file"].to_list() == [str(each.resolve()) for each in (a, b)]
    assert first["solution"] != second["solution"] and (out / first["solution"]).read_bytes() == solution
    (tmp_path / "elsewhere").mkdir()
    (third,) = rows_of([written(tmp_path / "elsewhere", SOON, name="a")], out)
    assert rows_of([a, b], out) == [first, second]
    b.write_text(b.read_text().replace("50.0", "0.0"))
    (changed,) = rows_of([b], out)
    assert changed["solved"] and changed["solution"] == second["solution"]
    (out / third["solution"]).unlink()
    assert rows_of([a], out, model="ST")[0]["solution"] == first["solution"]
    table = pl.read_csv(out / "solved.csv")
    assert table["scenario"].to_list() == ["a", "c"] and table["model"].to_list() == ["ST", "KS"]


def test_a_folder_may_be_called_as_a_pattern(tmp_path: Path) -> None:
    first, _, last = three(tmp_path)
    rows_of([first], tmp_path / "out1")
    for file in (last, first):
        rows_of([file], tmp_path / "out[1]")
    assert pl.read_csv((tmp_path / "out[1]" / "solved.csv").read_bytes())["scenario"].to_list() == ["a", "c"]


def test_scenarios_of_one_name_have_drawings_of_their_own(tmp_path: Path) -> None:
    files, out, drawn = list[Path](), tmp_path / "out", list[str]()
    for folder in ("x", "y"):
        (tmp_path / folder).mkdir()
        files.append(written(tmp_path / folder, SOON, name="a"))

    def draw(drive: Drive, name: str) -> str:
        drawn.append(name)
        (out / f"{name}_7").mkdir()
        (out / f"{name}_7" / "drive.mp4").write_text("frames")
        return f"{name}_7/drive.mp4"

    rows_of(files[1:], out, draw=draw)
    rows = rows_of(files, out, draw=draw)
    assert drawn == ["a", "a (2)"] and {row["video"] for row in rows} == {"a_7/drive.mp4", "a (2)_7/drive.mp4"}
    assert len(rows_of(files, out, draw=draw)) == 2 and len(drawn) == 2


def test_a_problem_that_is_not_driven_is_known_by_its_number_and_has_no_solution(tmp_path: Path) -> None:
    file = written(tmp_path, SOON)
    away = problem(SOON, left=500.0).replace('id="7"', 'id="8"')
    file.write_text(file.read_text().replace("</commonRoad>", f"{away}</commonRoad>"))
    driven, undriven = rows_of([file], tmp_path / "out")
    assert (driven["problem"], undriven["problem"]) == (7, 8) and "start is on no road" in undriven["reason"]
    assert driven["solution"] and not undriven["solution"]
    assert rows_of([file], tmp_path / "out") == [driven, undriven]


def test_what_is_solved_but_not_drawn_is_driven_again(tmp_path: Path) -> None:
    files, out, drawn = three(tmp_path), tmp_path / "out", list[str]()

    def draw(drive: Drive, name: str) -> str:
        drawn.append(drive.problem.file.stem)
        (out / f"{drawn[-1]}.mp4").write_text("frames")
        return f"{drawn[-1]}.mp4"

    solutions = [row["solution"] for row in rows_of(files, out)]
    once = rows_of(files, out, draw=draw)
    assert drawn == ["a", "c"] and sorted(row["video"] or "" for row in once) == ["", "a.mp4", "c.mp4"]
    assert [row["solution"] for row in pl.read_csv(out / "solved.csv").iter_rows(named=True)] == solutions
    assert rows_of(files, out, draw=draw) == rows_of(files, out) and drawn == ["a", "c"]
    (out / "c.mp4").unlink()
    rows_of(files, out, draw=draw)
    assert drawn == ["a", "c", "c"]
    files[0].write_text(files[0].read_text() + "\n")
    rows_of(files, out)
    rows_of(files, out, draw=draw)
    assert drawn == ["a", "c", "c", "a"]


def test_what_has_no_predictor_is_a_row(tmp_path: Path) -> None:
    def refused(scenario: Path) -> Belief:
        raise DataError("there are too few scenes")

    ((row,),) = solve_all([written(tmp_path, SOON)], refused, tmp_path / "out")
    assert row["reason"] == "not driven: there are too few scenes" and not row["solved"]


def test_reasons_have_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(scenario: Path) -> Belief:
        raise DataError("there are\n  too few\tscenes\n")

    def broken(*_: object) -> None:
        raise ValueError("a state\nof many\n lines")

    path = written(tmp_path, SOON)
    ((row,),) = solve_all([path], refused, tmp_path / "out")
    assert row["reason"] == "not driven: there are too few scenes"
    monkeypatch.setattr(solved, "drive", broken)
    (found,) = solve(path, PREDICTOR)
    assert found.row["reason"] == "not driven: ValueError: a state of many lines; please report it"


ONE = driving(100, 90.0, -1.75, 14.0, 20)
CIRCLE = "<circle><radius>1.0</radius></circle>"
RECTANGLE = r"<rectangle><length>4.6</length>.*?</rectangle>"
STANDING = re.sub("<trajectory>.*</trajectory>", "", ONE).replace("dynamicObstacle", "staticObstacle")
SPREAD = f"<velocity>{between('exact', 1.0, 2.0)}</velocity>".replace("<exact>", "").replace("</exact>", "")
DRIVEN: dict[str, str] = {
    "speeds are intervals": re.sub("<velocity>.*?</velocity>", SPREAD, ONE),
    "a circle": re.sub(RECTANGLE, CIRCLE, ONE),
    "a polygon": re.sub(
        RECTANGLE,
        "<polygon>"
        + "".join(f"<point><x>{x}</x><y>{y}</y></point>" for x, y in ((-2, -1), (2, -1), (2, 1)))
        + "</polygon>",
        ONE,
    ),
    "one that stands": STANDING,
    "a pedestrian": ONE.replace("<type>car", "<type>pedestrian"),
    "a bicycle": ONE.replace("<type>car", "<type>bicycle"),
    "no trajectory": re.sub("<trajectory>.*</trajectory>", "", ONE),
}


@pytest.mark.parametrize("case", DRIVEN)
def test_obstacles_of_any_kind_are_driven_with(case: str, tmp_path: Path) -> None:
    (found,) = solve(written(tmp_path, SOON, traffic=DRIVEN[case]), PREDICTOR)
    assert found.row["solved"], found.row["reason"]
    assert found.drive is not None and set(found.drive.problem.others(0)) == {100}


def edit(pattern: str, text: str, count: int = 1) -> Callable[[str], str]:
    return lambda content: re.sub(pattern, text, content, count=count, flags=re.DOTALL)


GOAL = r"(<goalState>.*?)"
NAN = r"\1NaN"
REFUSED: dict[str, tuple[Callable[[str], str], str]] = {
    "an obstacle at NaN": (edit(r"(<staticObstacle.*?<x>|<dynamicObstacle.*?<x>)[^<]*", NAN), "position of obstacle"),
    "a negative length": (edit("<length>4.6", "<length>-4.6"), "commonroad-io cannot read|length of obstacle"),
    "a length of NaN": (edit("<length>4.6", "<length>NaN"), "length of obstacle 100 is nan"),
    "no goal": (edit("<goalState>.*</goalState>", ""), "no goal|cannot read"),
    "a goal of NaN": (edit(GOAL + r"<intervalStart>0\.0", r"\1<intervalStart>NaN"), "velocity of its goal|cannot read"),
    "a goal after a day": (edit(GOAL + "<intervalEnd>4", r"\1<intervalEnd>900000"), "s after the start; expected"),
    "a goal before the start": (edit("(<planningProblem.*?<exact>)0", r"\g<1>900"), "s after the start; expected"),
    "a start at -5": (edit("(<planningProblem.*?<exact>)0", r"\g<1>-5"), "time_step of its start|cannot read"),
    "a start of 200 m/s": (edit("(<planningProblem.*?<velocity><exact>)[^<]*", r"\g<1>200"), "velocity of its start"),
    "a start at NaN": (edit("(<planningProblem.*?<x>)[^<]*", NAN), "position of its start|cannot read"),
    "a start off the road": (edit("(<planningProblem.*?<x>)[^<]*", r"\g<1>9e5"), "no road"),
    "a start without speed": (edit("(<planningProblem.*?)<velocity>.*?</velocity>", r"\1"), "has no velocity"),
    "a time step of 0": (edit('Size="0.1"', 'Size="0"'), "timeStepSize is 0 s"),
    "an unknown encoding": (edit("utf-8", "ebcdic-cp-be"), "not a CommonRoad file"),
    "a lanelet as a goal that is none": (
        edit("(<goalState>)", r'\1<position><lanelet ref="999"/></position>'), "cannot read|999"
    ),
    "a long id": (edit('id="7"', f'id="{10**400}"'), "its number is not between"),
}  # fmt: skip


def test_what_stands_needs_no_speed_in_an_older_format(tmp_path: Path) -> None:
    """Of 2018b, where obstacles say by their role whether they move."""
    path = written(tmp_path, SOON, traffic=TRAFFIC)
    content = re.sub(
        "<location>.*</scenarioTags>", "", path.read_text().replace("2020a", '2018b" tags="'), flags=re.DOTALL
    )
    content = re.sub(r'<dynamicObstacle (id="\d+")>', r"<obstacle \1><role>dynamic</role>", content)
    path.write_text(content.replace("</dynamicObstacle>", "</obstacle>"))
    (driven,) = solve(path, PREDICTOR)
    assert driven.row["solved"], driven.row["reason"]
    bare = re.sub(r"(<initialState>.*?)<velocity>.*?</velocity>", r"\1", path.read_text(), count=1, flags=re.DOTALL)
    path.write_text(bare)
    (moving,) = solve(path, PREDICTOR)
    assert "the initial state of a dynamicObstacle has no velocity" in moving.row["reason"]
    late = re.sub("(<role>dynamic</role>)(.*?</initialState>)", r"\2\1", bare, count=1, flags=re.DOTALL)
    for twisted, whose in ((late, "a dynamicObstacle"), (bare.replace("<role>dynamic</role>", "", 1), "an obstacle")):
        path.write_text(twisted)
        assert f"the initial state of {whose} has no velocity" in next(solve(path, PREDICTOR)).row["reason"]
    path.write_text(
        re.sub("<role>dynamic(.*?)<trajectory>.*?</trajectory>", r"<role>static\1", bare, count=1, flags=re.DOTALL)
    )
    (standing,) = solve(path, PREDICTOR)
    assert standing.drive is not None, standing.row["reason"]


@pytest.mark.parametrize("case", REFUSED)
def test_what_nobody_can_drive_is_a_row_with_its_reason(case: str, tmp_path: Path) -> None:
    change, problem = REFUSED[case]
    path = written(tmp_path, SOON, traffic=TRAFFIC)
    path.write_text(change(content := path.read_text()))
    assert path.read_text() != content
    (found,) = solve(path, PREDICTOR)
    assert found.drive is None and not found.row["solved"]
    assert re.match("not (read|driven): .*USA_Test-1_1_T-1", found.row["reason"])
    assert re.search(problem, found.row["reason"]), found.row["reason"]
