import json
import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simulation_fakes import REPLAYED, ConstantPlanner, fakes, make_scene
from splitting_toys import Walk

from coverdrive.dialling import rare as rare_module
from coverdrive.dialling.rare import CONTACT, Drive, Rare, _ends, again, danger, rare
from coverdrive.dialling.splitting import Path as Found
from coverdrive.dialling.splitting import _Walk, split
from coverdrive.dialling.tape import Tape
from coverdrive.errors import CertificateError, DataError, SettingError
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.locks import alone
from coverdrive.planning.planner import MpcPlanner
from coverdrive.prediction.adaptive import Adaptive
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.storage import load_trace
from coverdrive.simulation.roads import initial
from coverdrive.simulation.studies.setup import Setup

TRAFFICS = "set-sampling", "drivers", "aggressive", "mixed"


def setup_of(planner=ConstantPlanner, **changes) -> Setup:
    """Drives of two seconds, which have stops."""
    return replace(fakes(planner, **changes), episode=EpisodeSettings(duration=2.0))


def reckless(**changes) -> Setup:
    """An ego that brakes whoever is behind."""
    return setup_of(partial(ConstantPlanner, -4.0), **changes)


def driven(setup: Setup, seed: int = 0) -> tuple[Found, _Walk]:
    walk = _Walk(partial(Drive, setup, setup.participants()), np.random.default_rng(seed))
    return walk.first(0), walk


@pytest.mark.parametrize("traffic", TRAFFICS)
def test_a_tape_gives_the_same_drive_again(traffic: str):
    setup = setup_of(MpcPlanner, traffic=traffic)
    path, _ = driven(setup)
    trace = Drive(setup, setup.participants(), Tape.of(path.tape.arrays)).traced()
    assert [danger(scene_at(trace, k)) for k in range(len(trace) + 1)] == path.levels


def scene_at(trace, moment: int):
    scene = trace.scene
    return replace(scene, **{name: value[moment] for name, value in vars(scene).items()})


@pytest.mark.parametrize("traffic", TRAFFICS)
def test_a_drive_that_goes_on_from_a_stop_is_that_from_the_start(traffic: str):
    path, walk = driven(setup_of(MpcPlanner, traffic=traffic), seed=1)
    assert list(path.stops) == [0, 5, 10, 15]
    for _ in range(2):  # a stop stays as it is
        tape = Tape.of(path.tape.arrays)
        other = Found(tape, path.stops[10].copied(tape), 0, path.levels[:11])
        walk._go(other)
        assert other.levels == path.levels
    cut = walk._on(path, 4)
    assert cut.levels == path.levels[:5]
    walk._go(cut)
    if traffic in ("set-sampling", "mixed"):  # drivers draw little that matters so soon
        states = [each.process._scene.states for each in (cut, path) if isinstance(each.process, Drive)]
        assert not np.array_equal(*states)


def test_nothing_drawn_anew_is_the_same_drive():
    setup = fakes(MpcPlanner, traffic="drivers")
    path, walk = driven(setup)
    same = walk._begun(path.tape.nudged(0.0, 0.0, 0.5, np.random.default_rng(0)), 0)
    walk._go(same)
    assert same.levels == path.levels


def test_danger_grows_towards_a_contact():
    nearer = [danger(make_scene([0, gap], [1.8, 1.8], [30, 20])) for gap in (60, 30, 15, 8, 5)]
    assert nearer == sorted(nearer) and nearer[-1] > 4
    assert danger(make_scene([0, 14.8], [1.8, 1.8], [30, 20])) == pytest.approx(math.sqrt((10.0**2 / 8 - 10) * 3 * 1.9))
    assert danger(make_scene([0, 24.8], [1.8, 1.8], [20, 30])) == pytest.approx(-(10.0**2) / 8 - 20)
    beside, coming = (danger(make_scene([0, 0], [1.8, 5.4], [30, 20], [0, turn])) for turn in (0.0, -0.1))
    assert beside == pytest.approx(3 * -1.7) and beside < coming < 0
    assert danger(make_scene([0], [1.8])) == -CONTACT
    assert danger(make_scene([0, 1], [1.8, 1.8])) < CONTACT


def test_collisions_are_counted_stored_and_driven_again(tmp_path: Path):
    setup = reckless(seed=3)
    result = rare(setup, tmp_path, particles=8, repetitions=2, changes=1)
    seen = [Drive(setup, setup.participants(), Tape(random=np.random.default_rng(each))) for each in range(20)]
    share = np.mean([each.traced().outcome.kind is not Kind.FINISHED for each in seen])
    assert 0.02 < share < 0.98
    assert abs(result.probability - share) < 5 * math.hypot(result.standard_error, math.sqrt(share * (1 - share) / 20))
    assert 0 < result.interval[0] < result.probability < result.interval[1] <= 1
    assert "2 independent repetitions" in result.sentence
    assert result.collisions
    for file in result.collisions:
        trace = load_trace(file)
        assert trace.outcome.kind is not Kind.FINISHED
        driven_again = again(setup, file.with_name(f"{file.stem}.tape.npz"))
        assert np.array_equal(driven_again.scene.states, trace.scene.states)
    assert result.drives > 8 and result.seconds > 0


def test_drives_that_cannot_start_are_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Of two numbers of vehicles one never fits: what is found is what is found among the other."""
    monkeypatch.setattr(initial, "_ATTEMPTS", 200)
    setup = reckless(vehicles=(3, 40), seed=3)
    result = rare(setup, tmp_path, particles=16, repetitions=2, changes=1)
    fits = reckless(vehicles=(3,), seed=3)
    share = np.mean([fits.drive(trial).outcome.kind is not Kind.FINISHED for trial in range(20)])
    assert 0.02 < share < 0.98
    assert abs(result.probability - share) < 5 * math.hypot(result.standard_error, math.sqrt(share * (1 - share) / 20))
    assert result.collisions
    for file in result.collisions:
        driven_again = again(setup, file.with_name(f"{file.stem}.tape.npz"))
        assert driven_again.scene.vehicles == 4
        assert np.array_equal(driven_again.scene.states, load_trace(file).scene.states)


def test_an_estimate_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    options = {"particles": 4, "changes": 1}
    first = rare(reckless(), tmp_path, repetitions=2, **options)
    known = tmp_path / "repetitions" / "0001.json"
    known.write_text(json.dumps(first.repetitions[1] | {"probability": 0.25}))
    more = rare(reckless(), tmp_path, repetitions=3, **options)
    assert more.estimates[:2] == [first.estimates[0], 0.25]
    known.write_text("half of a fi")
    assert rare(reckless(), tmp_path, repetitions=2, **options).estimates == first.estimates
    monkeypatch.setattr(rare_module, "split", None)
    assert rare(reckless(), tmp_path, repetitions=2, **options).estimates == first.estimates
    with pytest.raises(DataError, match="another configuration"):
        rare(reckless(), tmp_path, particles=5)


def test_what_is_no_repetition_of_this_estimate_is_made_anew(tmp_path: Path):
    """Damaged, of another number, or of other settings."""
    options = {"particles": 4, "changes": 1, "repetitions": 2}
    first = rare(reckless(), tmp_path / "a", **options)
    rare(reckless(), tmp_path / "b", **options | {"particles": 5})
    whole, other = first.repetitions
    theirs = json.loads((tmp_path / "b" / "repetitions" / "0001.json").read_text())
    for damaged in ({"seed": whole["seed"]}, whole, theirs, {**other, "more": 1}):
        (tmp_path / "a" / "repetitions" / "0001.json").write_text(json.dumps(damaged))
        again = rare(reckless(), tmp_path / "a", **options)
        assert again.estimates == first.estimates
        assert [each["repetition"] for each in again.repetitions] == [0, 1]


@pytest.mark.slow
def test_workers_find_the_same(tmp_path: Path):
    setup = replace(reckless(), planner=ConstantPlanner)
    one, two = (rare(setup, tmp_path / str(n), particles=4, repetitions=2, workers=n) for n in (1, 2))
    assert one.estimates == two.estimates


def repetitions(*probabilities: float, ended: int = 0, level: float = 3.0) -> list[dict[str, Any]]:
    """As many as there are probabilities; the first of them ended at a level, which is half as probable as 1 lower."""
    rows = list[dict[str, Any]]()
    for number, each in enumerate(probabilities):
        came = [(level - 1, 2 * each), (level, each)] + ([] if number < ended else [(9.0, 1e-9)])
        rows.append({"probability": each, "rarer": number < ended, "curve": came})
    return rows


def test_intervals():
    found = Rare(Path(), repetitions(1e-5, 2e-5, 3e-5))
    assert found.probability == pytest.approx(2e-5) and found.level is None
    assert found.standard_error == pytest.approx(1e-5 / math.sqrt(3))
    low, high = found.interval
    assert low * high == pytest.approx(found.probability**2) and high / low > 10
    assert "with probability 2e-05 (95" in found.sentence and found.sentence.endswith("3 independent repetitions.")
    ended = Rare(Path(), repetitions(1e-5, 2e-5, 3e-5, ended=1))
    assert ended.interval[0] < low and ended.interval[1] == high == pytest.approx(6.93e-5, rel=1e-3)
    assert "with probability less than 0.007 % (the upper end of a 95 % interval that" in ended.sentence
    assert "in 0.002 % of drives (standard error 29 %) less than -3.00 m are left" in ended.sentence
    half = Rare(Path(), repetitions(1.9e-6, 1e-6, ended=1))
    assert half.interval[0] < 1.6e-12 and "that begins at 0.00000000015 %)" in half.sentence
    assert ended.sentence.endswith("of which 1 ended without a collision, below what was to be looked for.")
    rarer = Rare(Path(), repetitions(1e-5, 2e-5, 3e-5, ended=3))
    assert rarer.interval == (0.0, high) and "interval that begins at 0 %)" in rarer.sentence
    assert "by 3 independent" in rarer.sentence
    alike = Rare(Path(), repetitions(0.1, 0.1, 0.1))
    assert alike.interval == (0.0, 1.0) and "probability 0.1 (95 % interval 0 to 1;" in alike.sentence
    nothing = Rare(Path(), repetitions(0.0, 0.0))
    assert nothing.interval == (0.0, 1.0) and "No collision was found" in nothing.sentence


def test_repetitions_that_ended_are_compared_at_the_level_that_all_came_to():
    """What each got to is as probable by design, and says nothing of how exact it is."""
    first, second = repetitions(1e-6, ended=1), repetitions(1e-6, ended=1, level=4.0)
    both = Rare(Path(), first + second)
    assert both.level == 3.0 and both.estimates == [1e-6, 2e-6]
    assert Rare(Path(), repetitions(1e-6, ended=1, level=2.5) + second).estimates == [1e-6, 1.0]


@pytest.mark.slow
def test_of_repetitions_that_end_early_the_interval_holds_the_truth():
    """Negative control: at the level of each by itself the spread is nearly none, whatever the error is."""
    inside, wrong, ratios, trials = 0, 0, list[float](), 40
    for trial in range(trials):
        ends = [split(Walk, np.random.default_rng((trial, each)), 9.0, 20, rarest=3e-3) for each in range(4)]
        found = Rare(Path(), [each._asdict() for each in ends])
        assert found.level
        truth = Walk.probability(found.level)
        inside += _ends(found.estimates)[0] < truth < found.interval[1]
        low, high = _ends([each.probability for each in ends])
        wrong += low < truth < high
        ratios.append(found.probability / truth)
    assert inside > 0.85 * trials and wrong < 0.3 * trials
    assert abs(np.mean(ratios) - 1) < 3 * np.std(ratios) / math.sqrt(trials)


def test_what_makes_no_sense_is_refused(tmp_path: Path):
    with pytest.raises(SettingError, match="at least 2 repetitions"):
        rare(fakes(), tmp_path, repetitions=1)
    for rarest in (0.0, 1.0, float("nan")):
        with pytest.raises(SettingError, match="between 0 and 1"):
            rare(fakes(), tmp_path, rarest=rarest)
    learning = Adaptive(ConstantVelocity(np.ones((3, 2))))
    with pytest.raises(SettingError, match="a belief that learns"):
        rare(replace(fakes(), predictor=learning), tmp_path)
    with alone(tmp_path), pytest.raises(DataError, match="another process writes to"):
        rare(fakes(), tmp_path)
    (tmp_path / "no.tape.npz").write_bytes(b"nothing")
    with pytest.raises(DataError, match=r"no\.tape\.npz is not the tape of a drive"):
        again(fakes(), tmp_path / "no.tape.npz")


@pytest.mark.parametrize("traffic", ["replay", "reactive-replay"])
def test_replays_have_no_probability(traffic: str, tmp_path: Path):
    with pytest.raises(CertificateError, match=r"depend on each other.* --traffic drivers"):
        rare(fakes(**REPLAYED | {"traffic": traffic}), tmp_path / "rare")
    assert not (tmp_path / "rare").exists()
