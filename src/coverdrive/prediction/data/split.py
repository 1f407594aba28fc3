"""Splitting samples into training, calibration and test, disjoint by vehicle *and* by group of scenes.

Windows of one vehicle overlap, and vehicles of one scene react to each other: samples that share a vehicle or a scene
never stand on two sides. Groups that share a vehicle (blocks of one long recording) stay in their order, so that each
side is a contiguous stretch of time; a vehicle that still crosses a border keeps only its side with most samples.

Where all scenes are of two groups, none is left to test on: one trains, and the other calibrates *and* tests
(`coverdrive.prediction.certifying.calibrate.held_back`), either way round.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field, model_validator

from coverdrive.errors import DataError
from coverdrive.linked import parts_of_groups
from coverdrive.settings import Settings


class SplitSettings(Settings):
    """Shares of the samples; what is left is the test split."""

    train: float = Field(default=0.5, gt=0, lt=1)
    """share of the samples that the basis and the network are made from (Ω₁)"""
    calibration: float = Field(default=0.25, gt=0, lt=1)
    """share of the samples that the certificate is computed from (Ω₂)"""

    @model_validator(mode="after")
    def _leaves_a_test_split(self) -> "SplitSettings":
        if self.train + self.calibration >= 1:
            raise ValueError(f"train + calibration must be less than 1, got {self.train} + {self.calibration}")
        return self


_DRAWS = 100


@dataclass(frozen=True)
class Split:
    """Indices of the samples of each side."""

    train: Int[np.ndarray, " n1"]
    calibration: Int[np.ndarray, " n2"]
    test: Int[np.ndarray, " n3"]
    dropped: int
    """samples left out because their vehicle stands on another side"""

    @property
    def crossed(self) -> bool:
        """Whether those that calibrate also test, each judged by what the others calibrate."""
        return np.array_equal(self.calibration, self.test)


def split(
    vehicle: Int[np.ndarray, " N"], group: Int[np.ndarray, " N"], settings: SplitSettings | None = None, seed: int = 0
) -> Split:
    """Deal whole groups out to the three sides, as near to the shares as a seeded search finds.

    ``vehicle`` and ``group`` are the keys of each sample; groups ascend in time within one recording. Of only two
    groups, the one with more vehicles calibrates, which is settled before anything is learned.

    Raises:
        DataError: a single group, or a side stays empty.
    """
    settings = settings or SplitSettings()
    if len(np.unique(group)) == 2:
        return max(both_ways(vehicle, group), key=lambda each: len(np.unique(vehicle[each.calibration])))
    borders = np.cumsum([settings.train, settings.calibration])
    return _split(vehicle, _dealt(vehicle, group, borders, seed))


def rotations(vehicle: Int[np.ndarray, " N"], group: Int[np.ndarray, " N"], folds: int, seed: int = 0) -> list[Split]:
    """All ways in which two of so many parts of whole groups calibrate and test, and the others train.

    Of two groups, there are the two ways in which one trains, and the other calibrates and tests.

    Raises:
        DataError: fewer than three parts, a single group, or a side stays empty.
    """
    if folds < 3:
        raise DataError(f"to train, to calibrate and to test takes at least 3 folds, got {folds}")
    if len(np.unique(group)) == 2:
        return both_ways(vehicle, group)
    fold = _dealt(vehicle, group, np.arange(1, folds) / folds, seed)
    roles = [(one, other) for one in range(folds) for other in range(folds) if one != other]
    return [_split(vehicle, np.where(fold == one, 1, np.where(fold == other, 2, 0))) for one, other in roles]


def both_ways(vehicle: Int[np.ndarray, " N"], group: Int[np.ndarray, " N"]) -> list[Split]:
    """Of two groups, each once to train, while the other one calibrates and tests."""
    part = np.unique(group, return_inverse=True)[1]
    return [_split(vehicle, np.where(part == train, 0, 1), crossed=True) for train in range(2)]


def _split(vehicle: Int[np.ndarray, " N"], side: Int[np.ndarray, " N"], crossed: bool = False) -> Split:
    """The samples of sides 0, 1 and 2, without those whose vehicle has more of them on another one.

    If crossed, those of side 1 are those of side 2 as well.
    """
    _, vehicles = np.unique(vehicle, return_inverse=True)
    counts = np.zeros((vehicles.max() + 1, 3), dtype=np.int64)
    np.add.at(counts, (vehicles, side), 1)
    kept = counts.argmax(1)[vehicles] == side
    sides = [np.flatnonzero(kept & (side == number)) for number in ((0, 1, 1) if crossed else range(3))]
    if min(map(len, sides)) == 0:
        raise DataError(
            f"the split leaves a side empty ({', '.join(str(len(s)) for s in sides)} samples for training, "
            "calibration and test); give more scenes, or change the shares"
        )
    return Split(*sides, dropped=int((~kept).sum()))


def _dealt(
    vehicle: Int[np.ndarray, " N"], group: Int[np.ndarray, " N"], borders: Float[np.ndarray, " b"], seed: int
) -> Int[np.ndarray, " N"]:
    """The part, 0 … b, of each sample: of several random orders of groups the one that comes nearest to the shares.

    One that leaves no part empty comes before all that do.
    """
    names, first, groups = np.unique(group, return_index=True, return_inverse=True)
    if len(names) < 3:
        raise DataError(
            f"a split by scenes needs at least two groups of scenes that share no vehicle, got {len(names)}; "
            "give scenes of another time or place as well, or a recording of at least three minutes"
        )
    component = np.unique(parts_of_groups(vehicle, group)[first], return_inverse=True)[1]
    sizes = np.bincount(groups)
    shares = np.diff([0, *borders, 1])
    random = np.random.default_rng(seed)

    def draw() -> Int[np.ndarray, " G"]:
        order = np.argsort(random.permutation(component.max() + 1)[component], kind="stable")
        middle = (np.cumsum(sizes[order]) - sizes[order] / 2) / sizes.sum()
        side = np.empty(len(order), dtype=np.int64)
        side[order] = np.searchsorted(borders, middle, side="right")
        return side

    def imbalance(side: Int[np.ndarray, " G"]) -> tuple[bool, float]:
        parts = np.bincount(side, sizes, minlength=len(shares)) / sizes.sum()
        return bool((parts == 0).any()), float(np.abs(parts - shares).max())

    return min((draw() for _ in range(_DRAWS)), key=imbalance)[groups]
