"""What a calibration proves, in numbers and in one sentence."""

import hashlib
from dataclasses import dataclass
from typing import Literal

import numpy as np

from coverdrive.percentages import at_most, counted, percent

Unit = Literal["window", "vehicle", "share", "group"]
"""What is bounded: how many single windows are missed; how many vehicles (one misses if any of its windows does); the
share of a vehicle's windows, on average over vehicles; the share of a scene group's vehicles, on average over groups"""

NOUNS = {"share": "vehicle", "group": "scene group"}
"""What is counted, where it is not called like the unit"""

FEW, SEVERAL, ALIKE = 30, 2, 1.5
"""Scene groups below which it is said what they do to a bound; windows for each vehicle, and design effect, above which
it is said, too"""


def of_mean(unit: Unit) -> bool:
    """Whether what is bounded is the mean of a loss, instead of how many are missed."""
    return unit in ("share", "group")


@dataclass(frozen=True)
class Certificate:
    """With probability ``confidence`` over the calibration samples, a new one misses with probability at most ε.

    Without a confidence, ε bounds the probability over calibration samples and new sample together.
    """

    method: str
    """name of the method, as in `Method`"""
    epsilon: float
    """bound on the probability of a miss"""
    confidence: float | None
    """probability, over the draw of the calibration samples, with which the bound holds; none if it is marginal"""
    samples: int
    """number N₂ of calibration samples, counted in ``unit``"""
    unit: Unit
    """what is counted, and what the statement is about"""
    bases: int
    """number M of base trajectories"""
    uncovered: int
    """calibration samples that no base covers; they count as misses"""
    unseen_bases: int
    """bases with too few calibration samples for a threshold; they are always possible"""
    discarded: int
    """covered calibration samples that the rule misses"""
    tube: float
    """radius around a base, in the norm of the basis, within which it covers a vehicle's path"""
    fingerprint: str
    """of the calibration samples"""
    groups: int = 1
    """M, if the bound holds for every base by itself; with one, it holds for all bases together"""
    prediction_epsilon: float | None = None
    """bound on missing a sample that a base covers, as a share of all samples; of post-bloating, Φ(ε, M − 1, N₂), and
    of support vectors"""
    paper_epsilon: float | None = None
    """the same by the dimension alone: by the paper's Theorem 1, Φ(ε, M + 1, N₂), or for hyperplanes, by M(n̄ + 1)"""
    support: int | None = None
    """calibration samples that support the hyperplanes, counted in ``unit``"""
    vehicles: int = 0
    """calibration vehicles"""
    scenes: int = 0
    """groups of scenes that they are from"""
    scale: float = 1.0
    """λ: times as large are the sets as those that were calibrated for a claim; what is proved of others is in ε"""
    design_effect: float | None = None
    """variance of missed vehicles between groups of scenes, as a multiple of that of independent vehicles; none if
    there is one group, or if nothing or everything is missed"""

    @property
    def noun(self) -> str:
        """What is counted."""
        return NOUNS.get(self.unit, self.unit)

    @property
    def sentence(self) -> str:
        """The statement that is proved, with its assumption."""
        if self.epsilon >= 1:
            return (
                f"Nothing is proved about how often vehicles leave these sets, which are {self.scale:g} times as large "
                "as those that were calibrated."
            )
        sure = "Over calibration and test together"
        if self.confidence is not None:
            sure = f"With {percent(self.confidence, 10)} confidence"
        return (
            f"{sure}, {self._miss} is at most {at_most(self.epsilon)} "
            f"({self.method}, {counted(self.samples, f'calibration {self.noun}')}{self._origin}{self._uncovered}, "
            f"{f'{self.bases} bases' if self.bases > 1 else 'boxes'}"
            f"{'' if self.scale == 1 else f' of {self.scale:g} times the calibrated size'}"
            f"{'' if self.support is None else f', {self.support} supporting {self.noun}s'}), if new {self.noun}s are "
            f"independent draws from the same traffic as the calibration {self.noun}s.{self._limits}"
        )

    @property
    def _origin(self) -> str:
        vehicles = f" of {counted(self.vehicles, 'vehicle')}" if self.unit in ("window", "group") else ""
        scenes = f" in {counted(self.scenes, 'scene group')}" if self.unit != "group" else ""
        return vehicles + scenes if self.scenes else ""

    @property
    def _uncovered(self) -> str:
        what = "with uncovered windows" if of_mean(self.unit) else "uncovered"
        return f", {self.uncovered:,} of them {what}" if self.uncovered else ""

    @property
    def _miss(self) -> str:
        miss = {
            "window": "a vehicle leaves its predicted set within the horizon of one window",
            "vehicle": "a vehicle leaves its predicted set in any window in which it is seen",
            "group": "a vehicle of a new scene group leaves its predicted set in any window in which it is seen",
        }
        if self.unit == "share":
            return "the expected share of a vehicle's windows in which it leaves its predicted set"
        if self.groups == 1:
            return f"the probability that {miss[self.unit]}"
        if self.unit == "vehicle":
            return (
                "the probability that a vehicle that drives a calibrated base leaves its predicted set in any window "
                "in which it does, for every such base,"
            )
        return f"the probability that {miss[self.unit]}, whichever calibrated base it drives there,"

    @property
    def _limits(self) -> str:
        limits = ""
        if self.confidence is None:
            limits += (
                " This is an average over all calibrations, without confidence: the rule of this one may miss more "
                "often, and so may those that are left where some calibrations are refused, on average."
            )
        if self.unit == "window" and self.samples > SEVERAL * self.vehicles > 0:
            limits += (
                f" Windows of one vehicle are not independent, and here each has {self.samples / self.vehicles:.0f}: "
                "the bound can be far too small; claim a share of windows instead."
            )
        alike = self.unit != "group" and self.design_effect is not None and self.design_effect > ALIKE
        if alike and self.scenes >= FEW:
            limits += (
                f" Vehicles of one scene group are alike (design effect {self.design_effect:.1f}), not independent: "
                "the bound can be too small; claim what a new scene group does instead."
            )
        if self.unit != "group" and 0 < self.scenes < FEW:
            found = "" if self.design_effect is None else f" (design effect {self.design_effect:.1f})"
            alone = "is only one, which does not show how much groups differ" if self.scenes == 1 else ""
            limits += (
                " Vehicles of one scene group may be alike, and of groups there "
                f"{alone or f'are only {self.scenes}{found}'}."
            )
        if self.groups > 1 and self.unit == "vehicle":
            limits += (
                " A vehicle that drives several of them may be missed in each, so that a larger share of all vehicles "
                "may be missed."
            )
        if self.groups > 1 and self.unseen_bases:
            limits += (
                f" Bases that are not calibrated, because too few {self.unit}s stay near them for this ε: "
                f"{self.unseen_bases}. They are always possible, and nothing is proved about how often a vehicle that "
                "drives one of them leaves its tube."
            )
        return limits


def fingerprint(*arrays: np.ndarray) -> str:
    """A short hash of the contents of arrays."""
    digest = hashlib.blake2b(digest_size=8)
    for array in arrays:
        digest.update(repr((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
