"""Every setting of an experiment takes what makes sense and refuses the rest with its name."""

import math
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from coverdrive.config import Experiment
from coverdrive.errors import SettingError
from coverdrive.settings import Settings

KINDS = ("set-sampling", "drivers", "aggressive", "mixed", "replay", "reactive-replay")
ODD = (
    math.inf,
    -math.inf,
    math.nan,
    1e300,
    -1e300,
    10**400,
    -1,
    0,
    0.0,
    "",
    "ten",
    "\x00",
    [],
    [math.nan] * 2,
    {},
    True,
)


def keys(settings: Settings, *place: str) -> Iterator[tuple[str, ...]]:
    """All settings, tables within tables included."""
    for name in type(settings).model_fields:
        value = getattr(settings, name)
        if isinstance(value, Settings):
            yield from keys(value, *place, name)
        else:
            yield (*place, name)


def nested(place: tuple[str, ...], value: Any) -> dict[str, Any]:
    for name in reversed(place):
        value = {name: value}
    return value


def numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict):
        for inner in value.values():
            yield from numbers(inner)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            yield from numbers(inner)
    elif isinstance(value, (int, float)):
        yield value


EVERY = [
    pytest.param(kind, place, id=f"{kind}:{'.'.join(place)}")
    for kind in KINDS
    for place in keys(Experiment().updated({"traffic": {"kind": kind}}))
    if kind == KINDS[0] or place[0] == "traffic"
]


def test_all_settings_are_walked_over() -> None:
    assert len(EVERY) > 130


@pytest.mark.parametrize(("kind", "place"), EVERY)
def test_nonsense_is_refused_by_name(kind: str, place: tuple[str, ...]) -> None:
    usual = Experiment().updated({"traffic": {"kind": kind}})
    for odd in ODD:
        try:
            made = usual.updated(nested(place, odd))
        except SettingError as error:
            assert len(str(error)) < 400
        else:
            assert all(math.isfinite(value) and abs(value) < 2**63 for value in numbers(made.model_dump(mode="json")))


@pytest.mark.parametrize(("kind", "place"), EVERY)
def test_every_number_has_bounds(kind: str, place: tuple[str, ...]) -> None:
    usual = Experiment().updated({"traffic": {"kind": kind}})
    value: Any = usual
    for name in place:
        value = getattr(value, name)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return
    for odd in (1e300, -1e300, math.inf, math.nan):
        with pytest.raises(SettingError, match=place[-1]):
            usual.updated(nested(place, odd))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("[study]\nvehicles = [100000]", "study.vehicles.0"),
        ("[study]\nvehicles = []", "study.vehicles"),
        ("[study]\ntrials = 1e20", "study.trials"),
        ("[study]\nworkers = 100000", "study.workers"),
        ("seed = 100000000000000000000000", "seed"),
        ("seed = -1", "seed"),
        ("[generated]\nvehicles = [12, 10]", "generated.vehicles"),
        ("[generated]\nspeed = [1, inf]", "generated.speed.1"),
        ("[generated]\nscenes = 10000\nduration = 3600", "fewer or shorter scenes"),
        ("[prediction.segments]\nhorizon = 60\nstep = 0.01", "6001 points"),
        ("[prediction.segments]\nhorizon = 0.1\nstep = 10", "1 points"),
        ("[prediction.certificate]\nepsilon = 'automatic'", "prediction.certificate.epsilon"),
        ("[prediction.certificate]\nepsilon = 1.0", "prediction.certificate.epsilon"),
        ("[traffic]\nkind = ['drivers']", "traffic"),
        ("traffic = 5", "traffic"),
        ("self = 5", "self"),
        ("planner = 'fast'", "planner"),
        ("seed = 1\nseed = 2", "not a readable TOML file"),
        ("[[[", "not a readable TOML file"),
        ("a = " + 5000 * "[", "not a readable TOML file"),
    ],
)
def test_a_wrong_file_is_named_with_the_setting(text: str, complaint: str, tmp_path: Path) -> None:
    file = tmp_path / "[red]wrong.toml"
    file.write_text(text)
    with pytest.raises(SettingError) as refused:
        Experiment.load(file)
    assert str(refused.value).count(str(file)) == 1 and complaint in str(refused.value)


def test_files_that_are_no_text(tmp_path: Path) -> None:
    (tmp_path / "latin.toml").write_bytes("location = 'Jütland'".encode("latin-1"))
    for path in (tmp_path / "latin.toml", tmp_path, tmp_path / "none.toml"):
        with pytest.raises(SettingError, match="not a readable TOML file"):
            Experiment.load(path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_written_file_says_what_every_setting_means_and_gives_the_same_back(kind: str, tmp_path: Path) -> None:
    made = Experiment.preset("paper").updated(
        {"traffic": {"kind": kind}, "location": 'a "quoted" place\n', "study": {"until_width": 0.1}, "seed": 2**63 - 1}
    )
    made.save(tmp_path / "config.toml")
    assert Experiment.load(tmp_path / "config.toml") == made
    lines = (tmp_path / "config.toml").read_text(encoding="utf-8").splitlines()
    for line, before in zip(lines[1:], lines, strict=False):
        if "=" in line and not line.startswith("#"):
            assert before.startswith("# "), line
        assert len(line) <= 120
    tables = [line[1:-1] for line in lines if line.startswith("[")]
    tops = list(dict.fromkeys(table.split(".")[0] for table in tables))
    assert tops == [name for name in Experiment.model_fields if name in tops] and len(tops) == 7


def test_what_is_not_set_stays_so(tmp_path: Path) -> None:
    Experiment().save(tmp_path / "config.toml")
    text = (tmp_path / "config.toml").read_text(encoding="utf-8")
    assert "# location is not set" in text and "location" not in tomllib.loads(text)
    assert "vehicles = [3, 4, 5, 6, 7]" in text
    assert Experiment.load(tmp_path / "config.toml") == Experiment()


def test_the_paper_has_base_trajectories_and_plans_without_a_second_branch() -> None:
    paper, usual = Experiment.preset("paper"), Experiment.preset("default")
    assert (paper.prediction.sets, paper.planner.problem.branches.fail_safe) == ("bases", False)
    assert paper.planner.problem.vehicle.max_steering_rate > 100 * usual.planner.problem.vehicle.max_steering_rate
    assert (usual.prediction.sets, usual.planner.problem.branches.fail_safe) == ("boxes", True)


@pytest.mark.parametrize("experiment", [Experiment(), Experiment.preset("paper")], ids=["default", "paper"])
def test_every_preset_asks_for_what_its_method_can_prove(experiment: Experiment) -> None:
    claim = experiment.prediction.certificate
    assert claim.method.bounds_losses or claim.unit in ("vehicle", "window")


@pytest.mark.parametrize("value", [True, False])
def test_truths_are_no_numbers(value: bool) -> None:
    for place in keys(Experiment()):
        own = Experiment().model_dump()
        for name in place:
            own = own[name]
        if isinstance(own, (int, float)) and not isinstance(own, bool):
            with pytest.raises(SettingError, match=f"{place[-1]}: Input should be|as a whole"):
                Experiment().updated(nested(place, value))


def test_truths_are_no_numbers_of_a_list() -> None:
    with pytest.raises(SettingError, match=r"vehicles.0: Input should be a valid number, got True"):
        Experiment().updated({"study": {"vehicles": [True, 3]}})


def test_a_file_may_begin_with_a_mark_of_its_bytes(tmp_path: Path) -> None:
    (tmp_path / "marked.toml").write_text("[episode]\nduration = 3.0\n", encoding="utf-8-sig")
    assert Experiment.load(tmp_path / "marked.toml").episode.duration == 3.0
