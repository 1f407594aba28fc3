from typing import get_args

import pytest

from coverdrive.cli.shared.options import TrafficName
from coverdrive.config import Experiment
from coverdrive.errors import SettingError
from coverdrive.sweep import changes_of, sweep


def test_every_combination_is_a_variant():
    variants = sweep(["planner.problem.obstacles.order=2,4", "traffic.kind=drivers,mixed"])
    assert list(variants) == [
        "planner.problem.obstacles.order=2,traffic.kind=drivers",
        "planner.problem.obstacles.order=2,traffic.kind=mixed",
        "planner.problem.obstacles.order=4,traffic.kind=drivers",
        "planner.problem.obstacles.order=4,traffic.kind=mixed",
    ]
    assert list(variants.values())[3] == {
        "planner": {"problem": {"obstacles": {"order": 4}}},
        "traffic": {"kind": "mixed"},
    }


def test_values_are_toml_or_bare_text_and_names_are_fit_for_folders():
    assert sweep(["planner.a=[1, 2]"])["planner.a=_1,_2_"] == {"planner": {"a": [1, 2]}}
    several = sweep(["planner.a=true,1e-3,text"]).values()
    assert [changes["planner"]["a"] for changes in several] == [True, 1e-3, "text"]


@pytest.mark.parametrize("wrong", [["prediction.basis.radius=0.5"], ["seed=1,2"], ["study.trials=3"]])
def test_what_a_study_cannot_vary_is_refused(wrong):
    with pytest.raises(SettingError, match="cannot vary between studies of one predictor"):
        sweep(wrong)


@pytest.mark.parametrize("wrong", ["planner", "planner.a=", "=3", "planner..a=3", "[red]=3", ""])
def test_what_is_no_setting_with_a_value_is_refused(wrong):
    for parsed in (sweep, changes_of):
        with pytest.raises(SettingError, match="is no setting with its value"):
            parsed([wrong])


def test_a_setting_is_swept_once():
    with pytest.raises(SettingError, match="named twice"):
        sweep(["planner.a=1", "planner.a=2"])


def test_settings_have_one_value_each_where_nothing_is_swept():
    changes = changes_of(["seed=3", "prediction.training.hidden=[8, 8]", "location=us-101", "seed=4"])
    assert changes == {
        "seed": 4,
        "prediction": {"training": {"hidden": [8, 8]}},
        "location": "us-101",
    }
    assert Experiment().updated(changes).prediction.training.hidden == (8, 8)
    with pytest.raises(SettingError, match=r"traffic\.kind"):
        changes_of(["traffic=drivers", "traffic.kind=drivers"])


def test_variants_change_an_experiment_and_unknown_names_are_refused():
    (changes,) = sweep(["episode.duration=5"]).values()
    assert Experiment().updated(changes).episode.duration == 5
    (typo,) = sweep(["episode.duratoin=5"]).values()
    with pytest.raises(SettingError, match=r"episode.duratoin"):
        Experiment().updated(typo)


def test_traffic_is_told_apart_by_its_kind(tmp_path):
    usual = Experiment()
    assert usual.traffic.kind == "set-sampling"
    aggressive = usual.updated({"traffic": {"kind": "aggressive"}})
    assert aggressive.traffic.kind == "aggressive" and "interval" not in aggressive.traffic.model_dump()
    assert aggressive.updated({"traffic": {"kind": None}}) == aggressive
    assert aggressive.updated({"traffic": {"kind": "aggressive", "gap": 9.0}}).traffic.model_dump()["gap"] == 9.0
    aggressive.save(tmp_path / "config.toml")
    assert Experiment.load(tmp_path / "config.toml") == aggressive
    (tmp_path / "old.toml").write_text("[traffic]\ninterval = 0.6\n")
    assert Experiment.load(tmp_path / "old.toml").traffic.model_dump() == {"kind": "set-sampling", "interval": 0.6}
    named = get_args(get_args(get_args(TrafficName)[0])[0])
    assert {usual.updated({"traffic": {"kind": name}}).traffic.kind for name in named} == set(named) and len(named) == 6
    with pytest.raises(SettingError, match="traffic"):
        usual.updated({"traffic": {"kind": "bicycles"}})
