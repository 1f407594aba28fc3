from typing import get_args

import pytest

from coverdrive.cli.options import TrafficName
from coverdrive.config import Experiment
from coverdrive.errors import SettingError
from coverdrive.grid import cells_of


def test_every_combination_is_a_cell():
    cells = cells_of(["planner.problem.obstacles.order=2,4", "traffic.kind=drivers,mixed"])
    assert [cell.name for cell in cells] == [
        "planner.problem.obstacles.order=2,traffic.kind=drivers",
        "planner.problem.obstacles.order=2,traffic.kind=mixed",
        "planner.problem.obstacles.order=4,traffic.kind=drivers",
        "planner.problem.obstacles.order=4,traffic.kind=mixed",
    ]
    assert cells[3].changes == {"planner": {"problem": {"obstacles": {"order": 4}}}, "traffic": {"kind": "mixed"}}


def test_values_are_toml_or_bare_text():
    (cell,) = cells_of(["planner.a=[1, 2]"])
    assert cell.changes == {"planner": {"a": [1, 2]}}
    assert [cell.changes["planner"]["a"] for cell in cells_of(["planner.a=true,1e-3,text"])] == [True, 1e-3, "text"]


def test_names_are_fit_for_folders():
    (cell,) = cells_of(["planner.a=[1, 2]"])
    assert cell.name == "planner.a=_1,_2_"


@pytest.mark.parametrize("wrong", ["planner", "planner.a=", "prediction.basis.radius=0.5", "seed=1,2"])
def test_what_a_study_cannot_vary_is_refused(wrong):
    with pytest.raises(SettingError, match="does not vary a study"):
        cells_of([wrong])


def test_cells_change_an_experiment_and_unknown_names_are_refused():
    (cell,) = cells_of(["episode.duration=5"])
    assert Experiment().overridden(**cell.changes).episode.duration == 5
    (typo,) = cells_of(["episode.duratoin=5"])
    with pytest.raises(SettingError, match=r"episode.duratoin"):
        Experiment().overridden(**typo.changes)


def test_traffic_is_told_apart_by_its_kind(tmp_path):
    usual = Experiment()
    assert usual.traffic.kind == "set-sampling"
    aggressive = usual.overridden(traffic={"kind": "aggressive"})
    assert aggressive.traffic.kind == "aggressive" and "interval" not in aggressive.traffic.model_dump()
    assert aggressive.overridden(traffic={"kind": None}) == aggressive
    assert aggressive.overridden(traffic={"kind": "aggressive", "gap": 9.0}).traffic.model_dump()["gap"] == 9.0
    aggressive.save(tmp_path / "config.toml")
    assert Experiment.load(tmp_path / "config.toml") == aggressive
    (tmp_path / "old.toml").write_text("[traffic]\ninterval = 0.6\n")
    assert Experiment.load(tmp_path / "old.toml").traffic.model_dump() == {"kind": "set-sampling", "interval": 0.6}
    named = get_args(get_args(get_args(TrafficName)[0])[0])
    assert {usual.overridden(traffic={"kind": name}).traffic.kind for name in named} == set(named) and len(named) == 5
    with pytest.raises(SettingError, match="traffic"):
        usual.overridden(traffic={"kind": "bicycles"})
