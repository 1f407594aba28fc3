import numpy as np
import pytest
from scipy import stats

from coverdrive.dialling.tape import Tape
from coverdrive.errors import DataError


def tape(seed: int = 0) -> Tape:
    return Tape(random=np.random.default_rng(seed))


def asked(of: np.random.Generator) -> list[np.ndarray]:
    """What every kind of call gives."""
    return [
        of.random((2, 3)), of.uniform(1, 2, 4), of.uniform((0, 10), (1, 11)), of.standard_normal(3), of.normal(5, 2, 3),
        of.integers(3, 6, size=5), of.choice([(1, 2), (3, 4)], 3), of.choice(4, p=[0, 0, 1, 0]), of.permutation(5),
        of.exponential(size=3), of.permuted(np.arange(4)), of.choice(9, 3, replace=False), np.array(of.random()),
    ]  # fmt: skip


def test_it_stands_for_a_generator():
    usual, taped = asked(np.random.default_rng(0)), asked(tape())
    assert [each.shape for each in map(np.asarray, taped)] == [each.shape for each in map(np.asarray, usual)]
    assert isinstance(tape(), np.random.Generator) and taped[7] == 2
    assert set(taped[5]) <= {3, 4, 5} and set(taped[8]) == set(range(5)) and len(set(taped[11])) == 3


def test_what_it_draws_has_the_right_law():
    of = tape(1)
    laws = {
        "uniform": (of.random(4000), stats.uniform()),
        "between": (of.uniform(2, 5, 4000), stats.uniform(2, 3)),
        "normal": (of.standard_normal(4000), stats.norm()),
        "wider": (of.normal(1, 2, 4000), stats.norm(1, 2)),
        "exponential": (np.array([of.exponential() for _ in range(4000)]), stats.expon()),
    }
    for name, (drawn, law) in laws.items():
        assert stats.kstest(drawn, law.cdf).pvalue > 1e-3, name
    shares = np.bincount(of.choice(3, 4000, p=[0.2, 0.3, 0.5])), np.bincount(of.integers(0, 3, 4000))
    assert stats.chisquare(shares[0], [800, 1200, 2000]).pvalue > 1e-3
    assert stats.chisquare(shares[1]).pvalue > 1e-3


def test_moved_numbers_have_the_same_law_and_their_neighbours_stay():
    of, random = tape(2), np.random.default_rng(3)
    before = of.random(4000)
    of.turn(1)
    after = of.nudged(0.3, 0.0, 0.5, random).random(4000)
    assert 0.25 < np.mean(before != after) < 0.35
    assert stats.kstest(after, stats.uniform().cdf).pvalue > 1e-3
    assert np.array_equal(of.nudged(0.0, 1.0, 0.5, random).random(4000), before)


def test_what_is_read_again_is_the_same():
    of = tape()
    first = asked(of)
    of.turn(1)
    second = of.random(3)
    of.turn(2)
    for kept in (Tape.of(of.arrays), of.until(5, np.random.default_rng(9))):
        assert all(np.array_equal(one, other) for one, other in zip(asked(kept), first, strict=True))
        kept.turn(1)
        assert np.array_equal(kept.random(3), second)
    with pytest.raises(DataError, match="the tape ends at moment 1"):
        kept = Tape.of(of.arrays)
        kept.turn(1)
        kept.random(4)
    later = of.until(1, np.random.default_rng(9))
    assert all(np.array_equal(one, other) for one, other in zip(asked(later), first, strict=True))
    later.turn(1)
    assert not np.array_equal(later.random(3), second)


def test_of_the_beginning_only_the_last_calls_change():
    of = tape()
    before = [of.random() for _ in range(20)]
    of.turn(1)
    moved = of.nudged(1.0, 0.0, 1.0, np.random.default_rng(0))
    after = [moved.random() for _ in range(20)]
    moved.turn(1)
    assert [one == other for one, other in zip(before, after, strict=True)] == [True] * 4 + [False] * 16
    assert moved.reversible(of)
    moved = of.nudged(1.0, 0.0, 1.0, np.random.default_rng(0))
    moved.random()
    moved.turn(1)
    assert not moved.reversible(of) and moved.calls(0) == 1


def test_of_what_comes_later_all_calls_change():
    of = tape()
    of.turn(1)
    before = [of.random() for _ in range(20)]
    of.turn(2)
    moved = of.nudged(0.0, 1.0, 1.0, np.random.default_rng(0))
    moved.turn(1)
    assert all(moved.random() != each for each in before)


def test_of_what_comes_later_only_that_since_a_moment_changes():
    of = tape()
    before = []
    for moment in range(4):
        of.turn(moment)
        before.append(of.random())
    of.turn(4)
    moved = of.nudged(1.0, 1.0, 1.0, np.random.default_rng(0), since=2)
    after = []
    for moment in range(4):
        moved.turn(moment)
        after.append(moved.random())
    assert [one == other for one, other in zip(before, after, strict=True)] == [True, True, False, False]


FEW, MORE = np.array([1, 2, 4]), np.array([1, 2, 4, 6, 8])


def test_each_of_some_whole_numbers_is_as_probable():
    of = tape(4)
    for among in (FEW, MORE, np.array([7, 0, 900]), np.array([2**40, 3, 3]), np.array([3, 3, 4])):
        drawn = [int(of.choice(among)) for _ in range(3000)]
        taken = np.array([drawn.count(each) for each in np.unique(among)])
        shares = np.unique(among, return_counts=True)[1] / len(among)
        assert stats.chisquare(taken, 3000 * shares).pvalue > 1e-3


@pytest.mark.parametrize(("by_number", "least", "most"), [(True, 0.85, 1.0), (False, 0.0, 0.7)])
def test_a_choice_among_whole_numbers_stays_where_others_go(by_number: bool, least: float, most: float):
    """Negative control: a place in what there is to choose from is another number where something else is missing."""

    def chosen(among: np.ndarray) -> np.ndarray:
        of = tape(5)
        return np.array([of.choice(among) if by_number else among[of.integers(len(among))] for _ in range(2000)])

    more = chosen(MORE)
    there = np.isin(more, FEW)
    assert least <= np.mean(chosen(FEW)[there] == more[there]) <= most


@pytest.mark.parametrize(
    ("loc", "scale", "size"), [(5.0, 2.0, 4), ([1.0, 2.0, 3.0], 2.0, None), (1.0, [2.0, 3.0], None)]
)
def test_every_element_of_a_normal_draw_has_its_own_number(loc, scale, size):
    of, count = tape(), size or np.broadcast(loc, scale).size
    drawn = of.normal(loc, scale, size=size)
    assert of.arrays["places"].tolist() == [[0, count]]
    assert np.array_equal(drawn, np.add(loc, np.multiply(scale, tape().standard_normal(count))))
