"""Every benchmark runs at a small size, and its baselines find what the package finds."""

import ast
import importlib.util
import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coverdrive.certificates.methods import Method
from coverdrive.cli.demo import STORED

FOLDER = Path(__file__).parents[1] / "benchmarks"


def ran(name: str, out: Path, monkeypatch: pytest.MonkeyPatch, *arguments: str) -> Any:
    """What a benchmark writes."""
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None and spec.loader is not None
    monkeypatch.syspath_prepend(FOLDER)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(sys, "argv", [name, "--out", str(out), *arguments])
    module.main()
    return json.loads(out.read_text(encoding="utf-8"))


@pytest.mark.parametrize("file", sorted(FOLDER.rglob("*.py")), ids=lambda file: file.stem)
def test_what_it_takes_from_the_package_is_there(file: Path) -> None:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("coverdrive."):
            module = importlib.import_module(str(node.module))
            assert not [each.name for each in node.names if not hasattr(module, each.name)]


def test_basis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = ran("basis", tmp_path / "basis.json", monkeypatch, "--segments", "300", "--full", "500")
    assert result["dense NumPy greedy"]["bases"] == result["coverdrive, all candidates"]["bases"] > 1
    assert result["coverdrive"]["times faster"] > 0


def test_road_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("commonroad_clcs", reason="needs the extra test")
    result = ran("road_frame", tmp_path / "frame.json", monkeypatch, "--points", "2000", "--length", "500")
    assert result["there and back [m]"] < 1e-8
    assert max(result["apart from commonroad-clcs (lon, lat) [m]"]) < 0.05
    assert result["times faster"] > 0


@pytest.mark.slow
def test_certify(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = ran("certify", tmp_path / "certify.json", monkeypatch, "--samples", "4000")
    assert set(result["methods"]) == {method.value for method in Method}
    for name, each in result["methods"].items():
        assert each["same rule"], name
        assert each["times faster"] > 0


@pytest.mark.slow
def test_set_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    quick = ("--scenes", "6", "--seeds", "1", "--epochs", "1")
    result = ran("set_size", tmp_path / "set_size.json", monkeypatch, *quick)
    assert len(result) == 8
    assert result["the paper's network"]["ratio"][1] == pytest.approx(1.0)


@pytest.mark.slow
def test_prediction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = ran("prediction", tmp_path / "prediction.json", monkeypatch, "--scenes", "50")
    assert result["scenes"] == 50 and result["vehicles"] == 8
    assert 0 < result["lowest tenth ms"] <= result["median ms"] <= result["p99 ms"]


@pytest.mark.slow
def test_drives(quick_predictor: Path, tmp_path: Path) -> None:
    """In a process of its own, which keeps to one core; against itself."""
    out = tmp_path / "drives.json"
    few = ("--predictor", str(quick_predictor), "--trials", "1", "--traffics", "drivers", "--out", str(out))
    subprocess.run([sys.executable, FOLDER / "drives.py", *few], check=True)
    result = json.loads(out.read_text(encoding="utf-8"))
    assert set(result) == {"drivers"}
    for each in result.values():
        assert each["equal rows"] == each["trials"] == 1
        assert 0.2 < each["ratio"] < 5


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the peak memory of a process is read from Linux's /proc")
def test_portal(tmp_path: Path) -> None:
    """In a process of its own, whose memory is measured."""
    out = tmp_path / "portal.json"
    small = ("--rows", "280000", "--steps", "300", "--file", str(tmp_path / "portal.csv"), "--out", str(out))
    subprocess.run([sys.executable, FOLDER / "portal.py", *small], check=True)
    result = json.loads(out.read_text(encoding="utf-8"))
    assert list(result["stages"]) == [
        *("imports", "recordings", "place", "segments", "affordances", "training", "certificate", "comparison"),
        "saving",
    ]
    assert 0.95 * 280_000 < result["rows"] <= 280_000  # what is seen begins 0.2 s after the first position
    assert result["of constant velocity"] < 1
    assert result["peak GB"] < 2
    assert result["processor s"] > 0


@pytest.mark.slow
def test_occupied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    quick = ("--scenes", "9", "--folds", "3", "--steps", "20")
    rows = ran("occupied", tmp_path / "occupied.json", monkeypatch, *quick)
    assert {row["unit"] for row in rows} == {"vehicle", "window"}
    assert all(row["ratio"] > 0 and 0 <= row["missed"] < 0.5 for row in rows)


@pytest.mark.slow
def test_planner(quick_predictor: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    few = ("--predictor", str(quick_predictor), "--trials", "1", "--compared", "4")
    result = ran("planner", tmp_path / "planner.json", monkeypatch, *few)
    assert sum(result["coverdrive"]["share of each status"].values()) == pytest.approx(1.0)
    agreement = result["cost at most 1 % above IPOPT's best of eight starts"]
    compared = [agreement[kind] for kind in ("of those that are solved", "of those that are not")]
    missing = sum(each["IPOPT found none doing no more harm"] for each in compared)
    assert sum(each["doing no more harm"]["of"] for each in compared) + missing == 4
    assert sum(each["doing any harm"]["of"] for each in compared) == 4
    assert result["the paper's way"]["converged"] > 0
    assert result["times faster, medians"] > 1


@pytest.mark.slow
def test_emergency(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = ran("emergency", tmp_path / "emergency.json", monkeypatch, "--stride", "80")
    assert set(result) == {"blocked", "cut-in", "squeeze", "follower"}
    for kind, each in result.items():
        assert each["scenes"] >= 8, kind
        assert each["avoided by full braking but hit"] == 0, kind
        if kind != "follower":
            assert each["worse than full braking by 0.5 m/s"] == 0, kind
            assert 0 < each["mean relative speed over that of full braking"] < 1, kind


@pytest.mark.slow
def test_rare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with zipfile.ZipFile(STORED) as stored:
        stored.extract("predictor.safetensors", tmp_path)
    given = ("--predictor", str(tmp_path / "predictor.safetensors"))
    quick = (*given, "--drives", "3", "--particles", "4", "--repetitions", "2", "--duration", "2")
    result = ran("rare", tmp_path / "rare.json", monkeypatch, *quick)
    assert result["plain"]["drives"] == 3
    assert 0 <= result["splitting"]["probability"] <= 1 and result["splitting"]["drives"] > 4


@pytest.mark.slow
def test_adapting(quick_predictor: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    quick = ("--predictor", str(quick_predictor), "--drives", "2", "--duration", "4")
    result = ran("adapting", tmp_path / "adapting.json", monkeypatch, *quick)
    assert set(result) == {"adaptive", "λ = 1"}
    for each in result.values():
        assert each["whole"]["drives"] == 6 and each["whole"]["windows near the ego"] > 0
        assert 0 <= each["whole"]["missed"][0] <= 1
    assert result["λ = 1"]["whole"]["λ after a drive"] == [1.0, 1.0, 1.0]
    assert result["adaptive"]["whole"]["missed"][0] <= result["adaptive"]["whole"]["bound"]


@pytest.mark.slow
def test_random_emergencies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hardly any is hit that one of 40 fixed manoeuvres avoids, and on average none of them is needed."""
    result = ran("random_emergencies", tmp_path / "random.json", monkeypatch, "--scenes", "300")
    assert result["scenes"] == 300 == len(result["drives"])
    assert result["off the road"] == 0
    assert result["hit though one of 40 avoids"] <= 6
    first, hardest = (result[f"by the {contact} contact"] for contact in ("first", "hardest"))
    assert first["worse than full braking"] <= 6 and hardest["worse than full braking"] <= 3
    assert first["worse than the best of 40"] <= 18 and hardest["worse than the best of 40"] <= 12
    for mean in (first["mean [m/s]"], hardest["mean [m/s]"]):
        assert mean["planner"] < mean["best of 40"] < mean["full braking"]


def test_severity_is_that_of_bodies_in_the_map(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 20 m/s towards a standing car; full braking from 40 m avoids it, and who leaves the road is worse off."""
    monkeypatch.syspath_prepend(FOLDER)
    emergencies = importlib.import_module("random_emergencies")
    road, state = emergencies.Road.straight(1), emergencies.np.array([100.0, 1.8, 20.0, 0.0])
    scene = emergencies.Scene(0, road, state, [], [emergencies.other(140.0, 1.8, 0.0, emergencies.CAR)])
    motions = emergencies.manoeuvres(
        scene, [(0.0, 1.8), (-8.0, 1.8), (0.0, 9.0)], emergencies.table_of(road, emergencies.PROBLEM)
    )
    got = emergencies.severities(motions, scene)
    assert got.tolist() == [pytest.approx([20.0, 20.0]), [0.0, 0.0], [emergencies.np.inf] * 2]
    beyond = emergencies.other(160.0, 1.8, -10.0, emergencies.CAR)  # drives into the ego after the first contact
    assert emergencies.severities(motions[:1], scene._replace(others=[*scene.others, beyond])).tolist() == [
        pytest.approx([20.0, 30.0])
    ]


@pytest.mark.slow
def test_manners(quick_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = (str(quick_run / "out"), "--traffics", "drivers", "--drives", "2")
    found = ran("manners", tmp_path / "manners.json", monkeypatch, *given)
    headway = {name: each["headway"]["all moments"][0] for name, each in found.items()}
    assert headway["drivers: ours, paper"] < headway["drivers: ours, human"]
    assert found["drivers: IDM and MOBIL"]["drives"] == 2


@pytest.mark.slow
def test_rules(quick_predictor: Path, tmp_path: Path) -> None:
    shutil.copy(quick_predictor, tmp_path / "generated.safetensors")
    few = ("--drives", "2", "--workers", "1", "--rules", "foresight")
    traffics = ("drivers", "drivers, at times unseen", "emergencies")
    command = [sys.executable, FOLDER / "rules.py", *few, "--folder", tmp_path, "--traffics", *traffics]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert printed.count("| nothing |") == printed.count("| foresight |") == 3
    assert "`drivers`, 2 drives a row" in printed and "Random emergencies, 2 a row" in printed
    seen, unseen = (json.loads((tmp_path / f"{each}, all rules, 0, 2.json").read_text()) for each in traffics[:2])
    assert unseen != seen


@pytest.mark.slow
def test_problems(quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("driving", "recordings"):
        monkeypatch.syspath_prepend(Path(__file__).parent / room)
    fakes = importlib.import_module("problem_fakes")
    there = fakes.written(tmp_path, fakes.goal(), name="USA_There-1_1_T-1")
    never = fakes.written(tmp_path, fakes.goal(fakes.box(170.0, -1.75), first=4, last=5), name="USA_Never-1_1_T-1")
    given = (str(there), str(never), "--predictor", str(quick_fit), "--folder", str(tmp_path / "solutions"))
    found = ran("problems", tmp_path / "problems.json", monkeypatch, *given)
    assert list(found) == ["elsewhere"]
    only = found["elsewhere"]
    assert (only["problems"], only["solved"], only["share"][0], only["collisions"]) == (2, 1, 0.5, 0)
    assert only["not solved"] == [["USA_Never-1_1_T-1", 7, "goal missed: not far enough"]]


@pytest.mark.filterwarnings("ignore:Call to deprecated create function:DeprecationWarning")  # of commonroad-io
def test_recorded_problems(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two vehicles one is seen for long enough; it is taken out, and its last state is the goal."""
    pytest.importorskip("commonroad.geometry.shape", reason="needs the extra commonroad")
    for room in (FOLDER, *(Path(__file__).parent / name for name in ("driving", "recordings"))):
        monkeypatch.syspath_prepend(room)
    fakes, scenarios = (
        importlib.import_module("problem_fakes"),
        importlib.import_module("commonroad.common.file_reader"),
    )
    traffic = fakes.driving(100, 20.0, -1.75, 14.0, 75) + fakes.driving(101, 20.0, -9.0, 10.0, 30)
    file = fakes.written(tmp_path, fakes.goal(), traffic=traffic)
    monkeypatch.setattr(sys, "argv", ["recorded_problems", str(file), str(tmp_path / "made")])
    importlib.import_module("recorded_problems").main()
    left, problems = scenarios.CommonRoadFileReader(tmp_path / "made" / "USA_Test-1_3_T-100.xml").open()
    assert [each.obstacle_id for each in left.obstacles] == [101]
    driven = scenarios.CommonRoadFileReader(file).open()[0].obstacle_by_id(100)
    made, arrival = problems.planning_problem_dict[90_100], driven.prediction.trajectory.final_state
    assert made.goal.is_reached(arrival) and not made.goal.is_reached(driven.state_at_time(arrival.time_step - 11))
    assert np.allclose(made.initial_state.position, driven.initial_state.position)


def test_other_planners(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Without the peers nothing is driven, and why is a row; what was driven is not driven again."""
    for room in ("driving", "recordings"):
        monkeypatch.syspath_prepend(Path(__file__).parent / room)
    fakes, out = importlib.import_module("problem_fakes"), tmp_path / "rows.json"
    known = {"scenario": "USA_US101-1_1_T-1", "problem": 7, "planner": "FISS+", "reason": "", "seconds": [0.2, 0.4]}
    out.write_text(json.dumps([known]), encoding="utf-8")
    files = [fakes.written(tmp_path, fakes.goal(), name=name) for name in (known["scenario"], "USA_New-1_1_T-1")]
    monkeypatch.setitem(sys.modules, "commonroad_rp", None)
    monkeypatch.setitem(sys.modules, "fiss_planner", None)
    rows = ran("other_planners", out, monkeypatch, *map(str, files))
    assert rows[0] == known and [row["planner"] for row in rows[1:]] == ["reactive planner", "FISS+"]
    assert rows[1]["reason"].startswith("not driven: ModuleNotFoundError")
    assert rows[2]["reason"].startswith("not driven: it needs fiss-planner")
    assert "FISS+ {'US-101': '1 of 1', 'elsewhere': '0 of 1'}" in capsys.readouterr().out
