"""Choose the fastest of several candidates whose risk can be proved: pilot drives choose, other drives prove.

Nothing is assumed about how the risk depends on the candidate. Because pilot drives fix the order before the first
drive of the proof, testing may go on at the full level up to the first candidate that fails (learn then test,
Angelopoulos et al. 2021). The limit of the one that fails holds as well, at the same level: let j be the first
candidate whose true risk is larger than asked. If an earlier one fails, its risk is as small as asked, and so below its
limit; if j is tested, all is true unless j's limit is below its risk; and only then is a later one tested. Every event
has hypotheses of its own, and a candidate passes if it passes for every event.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Float, Num

from coverdrive.certificates.bounds import check_confidence
from coverdrive.certificates.drives import (
    Procedure,
    Proof,
    drives_needed,
    holm,
    limit_of,
    log_evidence,
    p_value,
    pilot_order,
    proved_at,
)
from coverdrive.errors import CertificateError
from coverdrive.percentages import percent

Hits: TypeAlias = Bool[np.ndarray, "drives kinds"]
"""whether each kind of event happened"""

Measures: TypeAlias = Num[np.ndarray, "drives measures"] | Bool[np.ndarray, "drives measures"]
"""the events, and then whatever says more of a drive's risk than these, which are seldom seen"""

Pilot: TypeAlias = Callable[[int, int, int], tuple[Measures, Float[np.ndarray, " drives"]]]
"""The same of pilot drives, called like `Drives`."""

Drives: TypeAlias = Callable[[int, int, int], tuple[Hits, Float[np.ndarray, " drives"]]]
"""Drives a candidate, from the number of its first drive, so many times: events and mean speeds [m/s], in order.

What happens in a drive is to depend on its number alone. Fewer drives than asked for say that there are no more."""


@dataclass(frozen=True)
class Asked:
    """A risk that is to be proved of an event."""

    event: str
    """what drives do, as in "touch anybody" """
    risk: float

    def __post_init__(self) -> None:
        if not 0 < self.risk < 1:
            raise CertificateError(
                f"the risk that drives {self.event} must lie strictly between 0 and 1, got {self.risk}; 0.002 is 0.2 %"
            )


@dataclass(frozen=True)
class Tried:
    """A candidate of which the risks were tested."""

    candidate: int
    speed: float
    """mean of the proof's drives [m/s]"""
    proofs: tuple[Proof, ...]
    """for each event"""

    @property
    def reached(self) -> bool:
        """Whether everything that was asked is proved."""
        return all(proof.reached for proof in self.proofs)

    @property
    def sentence(self) -> str:
        """What is proved of each event, and with what confidence of all together."""
        said = ". ".join(proof.sentence for proof in self.proofs) + "."
        if len(self.proofs) == 1:
            return said
        together = 1 - sum(1 - proof.confidence for proof in self.proofs)
        joint = f"all together hold with {percent(together, 10)}" if together > 0 else "nothing is said of all together"
        return f"{said} Each of these statements holds by itself with its confidence; {joint}."


@dataclass(frozen=True)
class Turned:
    """What was proved of the candidates that were tried; all of it holds together, for each event."""

    tried: tuple[Tried, ...]
    """in the order of the pilot, from the safest to the fastest"""

    @property
    def chosen(self) -> Tried | None:
        """The fastest one of which everything that was asked is proved."""
        return next((one for one in reversed(self.tried) if one.reached), None)

    @property
    def sentence(self) -> str:
        """What is proved of the chosen one; if there is none, of the safest."""
        return (self.chosen or self.tried[0]).sentence


@dataclass(frozen=True)
class Dial:
    """What is to be proved of candidates, and how; the same outcomes always give the same result."""

    asked: tuple[Asked, ...]
    """in the order of events, the first one orders the pilot"""
    confidence: float = 0.99
    procedure: Procedure = "anytime"
    pilot: int = 100
    """pilot drives for each candidate"""
    most: int = 10_000
    """drives to prove one candidate: so many at most at any time, else exactly so many"""
    batch: int = 100
    """drives after which, at any time, it is seen whether to go on"""
    gain: float = 0.0
    """share by which a candidate has to be faster than those before it in the pilot to be worth a proof"""
    unit: str = "20-s drives"

    def __post_init__(self) -> None:
        check_confidence(self.confidence)
        if not self.asked or min(self.pilot, self.most, self.batch) < 1:
            raise CertificateError(
                f"a dial needs an event, and at least 1 drive of the pilot, of the proof and of a batch, got "
                f"{len(self.asked)} events and {self.pilot}, {self.most} and {self.batch} drives"
            )

    def turn(self, candidates: int, pilot: Pilot, prove: Drives) -> Turned:
        """Order the candidates by pilot drives and prove them by other ones, until the first that fails.

        By Holm, all are driven. `CertificateError` if the drives could prove nothing even without any event.
        """
        self.check(candidates)
        order = self.order(candidates, pilot) if candidates > 1 else [0]
        if self.procedure == "Holm":
            return self._holm(order, [self._drive(candidate, prove) for candidate in order])
        tried: list[Tried] = []
        for candidate in order:
            hits, speeds = self._drive(candidate, prove)
            passed = [self._passes(kind, hits) for kind in range(len(self.asked))]
            tried.append(self._tried(candidate, hits, speeds, passed, [self.confidence] * len(passed)))
            if not all(passed):
                break
        return Turned(tuple(tried))

    def order(self, candidates: int, pilot: Pilot) -> list[int]:
        """The candidates that the pilot leaves to be proved, in the order of proving."""
        driven = [pilot(candidate, 0, self.pilot) for candidate in range(candidates)]
        rates = np.array([measures.mean(0) for measures, _ in driven])
        return pilot_order(rates, np.array([speeds.mean() for _, speeds in driven]), self.gain)

    def check(self, candidates: int) -> None:
        """Raise `CertificateError` if so many candidates cannot be proved, whatever happens in the drives."""
        if candidates < 1 or (self.procedure == "named beforehand" and candidates > 1):
            raise CertificateError(
                f"{candidates} candidates, but expected {'one' if candidates else 'at least one'}; name one, or prove "
                "several by a fixed sequence, by Holm or at any time"
            )
        parts = candidates if self.procedure == "Holm" else 1
        confidence, risk = 1 - (1 - self.confidence) / parts, min(one.risk for one in self.asked)
        anytime = self.procedure == "anytime"
        if p_value(0, self.most, risk, anytime) > 1 - confidence:
            needed = drives_needed(0, risk, confidence, anytime)
            raise CertificateError(
                f"{self.most:,} {self.unit} cannot prove a risk of {percent(risk)} with {percent(self.confidence, 10)} "
                f"confidence ({self.procedure}), whatever happens in them; {needed:,} without any event would do: "
                "drive more, allow a larger risk, or ask for less confidence"
            )

    def _drive(self, candidate: int, prove: Drives) -> tuple[Hits, Float[np.ndarray, " drives"]]:
        """All drives of a candidate; at any time, until all is proved or something cannot be proved any more."""
        if self.procedure != "anytime":
            hits, speeds = prove(candidate, 0, self.most)
            if len(hits) < self.most:
                raise CertificateError(
                    f"{len(hits):,} of {self.most:,} {self.unit}; their number has to be fixed beforehand "
                    f"({self.procedure}), so ask for no more than there are, or prove at any time"
                )
            return hits, speeds
        hits, speeds = np.zeros((0, len(self.asked)), dtype=bool), np.zeros(0)
        while not self._done(hits):
            count = min(self.batch, self.most - len(hits))
            new, speeds_of_new = prove(candidate, len(hits), count)
            hits, speeds = np.concatenate([hits, new]), np.concatenate([speeds, speeds_of_new])
            if len(new) < count:
                break
        return hits, speeds

    def _done(self, hits: Hits) -> bool:
        proved = [self._passes(kind, hits) for kind in range(len(self.asked))]
        goal, events = -math.log1p(-self.confidence), hits.sum(0)
        return all(proved) or any(
            not passed and log_evidence(int(count), self.most, one.risk) < goal
            for passed, count, one in zip(proved, events, self.asked, strict=True)
        )

    def _passes(self, kind: int, hits: Hits) -> bool:
        risk = self.asked[kind].risk
        if self.procedure == "anytime":
            return proved_at(hits[:, kind], risk, self.confidence)
        return p_value(int(hits[:, kind].sum()), len(hits), risk) <= 1 - self.confidence

    def _holm(self, order: list[int], driven: list[tuple[Hits, Float[np.ndarray, " drives"]]]) -> Turned:
        events = np.array([hits.sum(0) for hits, _ in driven])
        passed = np.stack(
            [
                holm(np.array([p_value(int(count), self.most, one.risk) for count in counts]), self.confidence)
                for counts, one in zip(events.T, self.asked, strict=True)
            ],
            axis=1,
        )
        levels = 1 - (1 - self.confidence) / np.maximum((~passed).sum(0), 1)
        rows = zip(order, driven, passed.tolist(), strict=True)
        return Turned(tuple(self._tried(one, *drives, mask, levels.tolist()) for one, drives, mask in rows))

    def _tried(
        self,
        candidate: int,
        hits: Hits,
        speeds: Float[np.ndarray, " drives"],
        passed: Sequence[bool],
        levels: Sequence[float],
    ) -> Tried:
        """What is proved: what was asked, or else the limit at the level of the event; if named, always the limit."""
        named, anytime = self.procedure == "named beforehand", self.procedure == "anytime"
        proofs: list[Proof] = []
        for asked, series, reached, level in zip(self.asked, hits.T, passed, levels, strict=True):
            limit = limit_of(series, level, anytime) if named or not reached else 0.0
            bound = limit if named else max(limit, asked.risk)
            bound = min(bound, asked.risk) if reached else bound  # where they are equal but for rounding
            known = int(series.sum()), len(series), asked.risk, bound, self.confidence
            proofs.append(Proof(asked.event, *known, self.procedure, self.unit, level))
        return Tried(candidate, float(speeds.mean()) if len(speeds) else math.nan, tuple(proofs))
