from functools import partial
from itertools import count

import numpy as np
import pytest
from scipy.stats import norm
from splitting_toys import Patient, Still, Sudden, Walk

from coverdrive.dialling import splitting
from coverdrive.dialling.splitting import split
from coverdrive.dialling.tape import Tape
from coverdrive.errors import SettingError, StartError

STEEP = partial(Walk, slope=0.5)
CASES = {
    "walk 1e-2": (Walk, 2.35, Walk.probability),
    "still 1e-2": (Still, 2.326, norm.sf),
    "walk 1e-6": (Walk, 4.7, Walk.probability),
    "still 1e-6": (Still, 4.753, norm.sf),
    "slope 1e-5": (STEEP, 4.7, partial(Walk.probability, slope=0.5, points=401)),
}


def case(name: str):
    """Where it starts, the level, and the probability to reach it."""
    start, barrier, probability = CASES[name]
    return start, barrier, probability(barrier)


def estimates(start, barrier: float, repetitions: int, particles: int, **options) -> np.ndarray:
    return np.array([
        split(start, np.random.default_rng((5, each)), barrier, particles, **options).probability
        for each in range(repetitions)
    ])  # fmt: skip


def apart(found: np.ndarray, truth: float) -> float:
    """Standard errors between the mean and the truth."""
    return abs(found.mean() - truth) / (found.std(ddof=1) / np.sqrt(len(found)))


def test_truths_agree_with_many_walks():
    steps = np.random.default_rng(0).standard_normal((200_000, 10)) / np.sqrt(10)
    many = (steps.cumsum(1).max(1) >= 2.35).mean()
    assert many == pytest.approx(Walk.probability(2.35), rel=0.1)


@pytest.mark.parametrize("name", ["walk 1e-2", "still 1e-2"])
def test_it_finds_the_probability(name: str):
    start, barrier, truth = case(name)
    found = estimates(start, barrier, 16, 40)
    assert apart(found, truth) < 3
    assert found.std() < truth


@pytest.mark.slow
def test_it_is_right_where_a_later_moment_draws_a_number_of_times_that_varies():
    found = estimates(Patient, 120.0, 150, 40)
    assert apart(found, 0.95**119) < 3


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if not name.endswith("1e-2")])
def test_it_is_right_down_to_a_millionth(name: str):
    start, barrier, truth = case(name)
    found = estimates(start, barrier, 10, 200)
    assert apart(found, truth) < 3
    assert found.std(ddof=1) / np.sqrt(len(found)) < 0.35 * truth


@pytest.mark.parametrize(
    ("start", "probability", "of_all"),
    [
        (partial(Still, most=0.0), partial(Still.probability, most=0.0), norm.sf),
        (
            partial(Walk, slope=1.0, steepest=0.1),
            partial(Walk.probability, slope=1.0, points=401, steepest=0.1),
            partial(Walk.probability, slope=1.0, points=401),
        ),
    ],
    ids=["still", "walk"],
)
def test_of_paths_that_may_not_start_it_is_the_probability_of_those_that_can(start, probability, of_all):
    """About half of them can; who reaches the level is mostly among the others."""
    truth = probability(2.0)
    found = estimates(start, 2.0, 8, 60)
    assert np.array_equal(found[:1], estimates(start, 2.0, 1, 60))
    assert apart(found, truth) < 3
    assert min(apart(found, of_all(2.0)), apart(found, 2 * truth)) > 3


def test_where_hardly_any_path_can_start_there_is_no_probability():
    begun = list[Tape]()

    def impossible(tape: Tape) -> Walk:
        begun.append(tape)
        raise StartError("no room")

    with pytest.raises(SettingError, match=r"none of 100 starts .* take fewer vehicles.*no room"):
        split(impossible, np.random.default_rng(0))
    assert len(begun) == 100


def test_changes_that_forget_the_level_are_wrong(monkeypatch: pytest.MonkeyPatch):
    """Copies that fell back count as if they were above the level, so that too few surpass the next one."""
    start, barrier, truth = case("still 1e-2")
    right = splitting._Walk.changed
    monkeypatch.setattr(splitting._Walk, "changed", lambda self, path, level: right(self, path, level - 0.5))
    found = estimates(start, barrier, 8, 60)
    assert found.mean() < truth / 2 and apart(found, truth) > 5


def test_changes_of_what_does_not_matter_are_wrong(monkeypatch: pytest.MonkeyPatch):
    """Copies stay what they are: all that was drawn at the start is kept, and a rare start is never found."""
    start, barrier, truth = case("still 1e-6")
    monkeypatch.setattr(splitting._Walk, "_tried", lambda self, path, level: None)
    found = estimates(start, barrier, 4, 60)
    assert found.max() < truth / 3


def moments_above(changes: int) -> np.ndarray:
    """When a path is above the level, after each of many changes in a row."""
    walk, path = splitting._Walk(Sudden, np.random.default_rng(3)), None
    while path is None or path.level < 1:
        path = walk.first(0)
    found = []
    for _ in range(changes):
        path = walk._tried(path, 0.5) or path
        found.append(path.above(0.5))
    return np.array(found)


@pytest.mark.parametrize("forgotten", [False, True])
def test_changes_leave_the_moment_of_the_level_its_law_unless_odds_are_forgotten(
    forgotten: bool, monkeypatch: pytest.MonkeyPatch
):
    if forgotten:
        monkeypatch.setattr(splitting, "_odds", lambda *_: 1.0)
    distance = apart(moments_above(4000).reshape(20, -1).mean(1), Sudden.mean())
    assert distance > 5 if forgotten else distance < 3


def test_what_is_certain_or_never_happens():
    certain = split(Still, np.random.default_rng(0), -100.0, 20)
    assert certain.probability == 1 and len(certain.found) == 20 and not certain.stages
    walk = split(partial(Walk, steps=3), np.random.default_rng(0), np.inf, 10)
    assert walk.rarer and walk.probability < 1e-15 and not walk.found


def test_what_is_rarer_than_was_looked_for_is_bounded_from_above():
    """Where it ends, what is estimated is more probable than the target, and as probable as its last level."""
    start, barrier, truth = case("walk 1e-6")
    ends = [split(start, np.random.default_rng(each), barrier, 60, rarest=0.1) for each in range(12)]
    assert all(each.rarer and 0.1 / 3 < each.probability < 0.1 and not each.found for each in ends)
    levels = [Walk.probability(each.stages[-1].level) for each in ends]
    assert apart(np.array([each.probability for each in ends]) / levels, 1.0) < 3 and min(levels) > truth
    often, barrier, truth = case("walk 1e-2")
    assert not any(split(often, np.random.default_rng(each), barrier, 60, rarest=truth / 5).rarer for each in range(8))


def test_the_curve_tells_how_probable_every_level_is():
    found = [split(Walk, np.random.default_rng(each), 2.35, 60) for each in range(20)]
    for each in found:
        levels, shares = np.array(each.curve).T
        assert (np.diff(levels) > 0).all() and (np.diff(shares) < 0).all()
        assert shares[-1] == pytest.approx(each.probability) and levels[-1] < 2.35
    for level in (0.5, 1.3, 2.1):
        curves = [[1.0] + [share for at, share in each.curve if at <= level] for each in found]
        assert apart(np.array([each[-1] for each in curves]), Walk.probability(level)) < 3


def test_paths_that_all_end_alike_are_given_up_together():
    class Flat(Still):
        def __init__(self, tape):
            super().__init__(tape)
            self.level = float(self.level > 1)

    found = [split(Flat, np.random.default_rng(each), 1.0, 30).probability for each in range(20)]
    assert apart(np.array(found), norm.sf(1)) < 3
    assert split(Flat, np.random.default_rng(0), 2.0, 30).probability == 0


def test_what_is_found_got_there_and_its_tape_leads_there_again():
    result = split(STEEP, np.random.default_rng(0), 2.0, 40)
    assert result.found and len(result.stages) == len({stage.level for stage in result.stages})
    for path in result.found:
        assert path.level >= 2.0
        assert through(type(path.tape).of(path.tape.arrays)) == path.levels


def through(tape) -> list[float]:
    """The levels of a path along a tape from its start."""
    walk = STEEP(tape)
    levels = [walk.level]
    while not walk.over:
        tape.turn(len(levels))
        walk.advance()
        levels.append(walk.level)
    return levels


def test_numbers_that_make_no_sense_are_refused():
    for particles, kept in ((1, 0.5), (10, 1.0), (10, 0.0)):
        with pytest.raises(SettingError, match="at least 2 paths"):
            split(Still, np.random.default_rng(0), 1.0, particles, kept)


class Tries(Still):
    """Draws until something fits, as starts of drives do."""

    def __init__(self, tape):
        self.level = float(next(number for number in count(1) if tape.random() < 0.05))


@pytest.mark.parametrize(("calls", "taken"), [(20, False), (16, True)])
def test_what_a_new_start_does_not_ask_for_is_forgotten_before_it_is_accepted(
    calls: int, taken: bool, monkeypatch: pytest.MonkeyPatch
):
    """One that fits at the sixth try: of a start of 20, other calls than there could be nudged on the way back."""
    monkeypatch.setattr(splitting, "_ANEW", 0.0)
    tries = [np.array([0.5])] * calls
    tries[-1] = np.array([0.01])
    walk = splitting._Walk(Tries, np.random.default_rng(0))
    path = walk._begun(Tape({0: tries}), 0)
    path.tape.turn(1)
    tries[5] = np.array([0.01])
    monkeypatch.setattr(Tape, "nudged", lambda *_: Tape({0: tries}))
    tried = walk._tried(path, 0.0)
    assert (tried is not None) is taken
    assert tried is None or (tried.level, tried.tape.calls(0)) == (6.0, 6)
