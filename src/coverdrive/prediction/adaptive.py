"""Sets that adapt while driving: their scale λ follows how often vehicles near the ego leave them.

No certificate holds in traffic unlike the recorded one. What can be held in any traffic is an average: of the windows
near the ego that were settled since the beginning, at most a share τ is lost in the long run. That says nothing about
the next window, or about any group of them.

A *window* is one vehicle at one moment of prediction. It is *lost* as soon as every path that was predicted for the
vehicle has been left, by the body or by the centre (as in `coverdrive.simulation.measures.misses`), and *kept* once it
was seen to the end of the horizon. A vehicle that vanishes before leaves its windows unsettled.

Online quantile tracking: Gibbs & Candès, "Adaptive conformal inference under distribution shift", NeurIPS 2021;
Angelopoulos, Candès & Tibshirani, "Conformal PID control for time series prediction", NeurIPS 2023, its proportional
part. Losses that depend on what was decided: Lekeufack et al., "Conformal decision theory", ICRA 2024. Delays:
Joulani, György & Szepesvári, "Online learning under delayed feedback", ICML 2013.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.errors import SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.prediction.inside import every, inside
from coverdrive.prediction.stored import LARGEST
from coverdrive.road import Road
from coverdrive.scene import Scene

NEAR = 50.0
"""[m] along the road between the centres of the ego and of a vehicle near it"""

_JUMP = 2.0
"""[m] from where its speeds take it, beyond which a vehicle is another one"""

_ROUNDING = 1e-6
"""of a number of periods"""


def near(scene: Scene, road: Road, ego: int) -> Bool[np.ndarray, "*batch A"]:
    """Who is within 50 m along the road of the ego, in its lane or a neighbouring one."""
    lon, lane, valid = np.asarray(scene.lon), road.lane_at(scene.lon, scene.lat), np.array(scene.valid)
    valid[..., ego] = False
    apart = np.abs(lon - lon[..., ego, None]) <= NEAR
    return valid & apart & (np.abs(lane - lane[..., ego, None]) <= 1)


@dataclass
class LongRun:
    """Holds the average loss by moving ln λ, by ``rate`` · (loss − missed) for each window that is settled.

    λ is exp(level), at most ``largest``; the level stays above ln ``smallest``, so that no traffic, however dull, makes
    sets that take long to grow again. T windows are settled, never more than D are under way at once, and W of those
    with sets of the largest scale are lost (none, if these hold whatever a vehicle can do).

    **Bound.** For any traffic and any delays,

        average loss ≤ missed + (ln(largest / λ_0) / rate + (1 − missed) · (D + W)) / T.

    Proof. The floor only raises the level, so that rate · Σ (loss − missed) ≤ level_T − level_0. Since the level was
    last below ln largest, all new sets are of the largest scale, so that only the D windows under way then, and W, can
    have raised it, each by rate · (1 − missed): level_T ≤ ln largest + rate · (1 − missed) · (D + W). ∎ As level_T ≥
    ln smallest, the average is also at least missed − ln(λ_0 / smallest) / (rate · T), if the floor was not reached.
    """

    missed: float
    """the share of windows that is to be lost"""
    rate: float
    """by which ln λ grows for a lost window, nearly"""
    smallest: float
    """λ"""
    largest: float
    """λ"""
    first: float
    """ln λ at the beginning"""
    level: float
    """ln λ now, but for the largest"""
    settled: int = 0
    """windows, T"""
    lost: int = 0
    """of them"""
    most: int = 0
    """windows under way at once so far, D"""

    @classmethod
    def begun(cls, missed: float, rate: float, smallest: float, largest: float, scale: float) -> "LongRun":
        """An average of nothing yet, from a λ on, or the nearest that is allowed."""
        level = float(np.log(np.clip(scale, smallest, largest)))
        return cls(missed, rate, smallest, largest, level, level)

    @property
    def scale(self) -> float:
        """λ of the sets."""
        return float(min(np.exp(min(self.level, np.log(self.largest))), self.largest))

    @property
    def bound(self) -> float:
        """What the average loss cannot exceed, if no window of the largest sets is lost (W = 0)."""
        excess = (np.log(self.largest) - self.first) / self.rate + (1 - self.missed) * self.most
        return min(1.0, self.missed + excess / max(1, self.settled))

    def settle(self, lost: int, settled: int) -> None:
        """Learn from windows, of which some were lost."""
        self.level = max(self.level + self.rate * (lost - self.missed * settled), float(np.log(self.smallest)))
        self.settled += settled
        self.lost += lost


@dataclass
class _Windows:
    """Of the vehicles near the ego at one moment."""

    paths: PredictedPaths
    """with a point for every moment at which is looked: each period, or with ellipses their own"""
    half_sizes: Float[np.ndarray, "S 2"]
    """[m] of the vehicle of each path"""
    held: Bool[np.ndarray, " S"]
    """whether a path has held its vehicle so far"""
    open: Bool[np.ndarray, " A"]
    """whose windows are under way"""
    apart: float
    """periods between two points"""
    age: int = 0
    """periods since then"""
    seen: int = 0
    """points at which was looked"""

    def follow(
        self, before: Float[np.ndarray, "B 3"], now: Float[np.ndarray, "B 3"], same: Bool[np.ndarray, " B"]
    ) -> tuple[int, int]:
        """See where vehicles were, and are one period later: how many windows that settles, and how many as lost."""
        self.open[len(same) :] = False
        self.open[: len(same)] &= same[: len(self.open)]
        self.age += 1
        vehicle, last = np.where(self.open[self.paths.vehicle], self.paths.vehicle, 0), self.paths.points.shape[1] - 1
        while self.seen < last and (ago := self.age - (self.seen + 1) * self.apart) > -_ROUNDING:
            self.seen += 1
            then = now if ago < _ROUNDING else ago * before + (1 - ago) * now
            self.held &= inside(self.paths, self.seen, then[None, vehicle], self.half_sizes)[0]
        anywhere = np.zeros_like(self.open)
        anywhere[self.paths.vehicle[self.held]] = True
        lost = self.open & ~anywhere
        settled = self.open.copy() if self.seen == last else lost
        self.open &= ~settled
        return int(settled.sum()), int(lost.sum())


@dataclass(eq=False)
class Adaptive:
    """A predictor whose scale λ adapts while it is asked, once every period; a `Belief` with a memory.

    It remembers over drives, one after another in one process; a vehicle, or the ego, that is not where its speed took
    it is another one. The same scene object again is the same moment. Trials of a study each begin with what it knew
    when it was handed over (`anew`), so that none depends on another.
    """

    predictor: Any
    """a belief whose sets have a scale: `scaled(λ)` is the same with others"""
    missed: float = 0.1
    """share of the windows near the ego that is to be lost in the long run"""
    rate: float = 0.005
    """by which ln λ grows for a lost window, nearly; smaller is steadier and slower"""
    smallest: float = 0.1
    """λ of the smallest sets; 1 never goes below what was calibrated"""
    largest: float = 10.0
    """λ of the largest sets"""
    period: float = 0.1
    """[s] between two predictions, which has to be that of the drive"""
    start: float = 1.0
    """λ at the beginning, unless a state is given"""
    state: Mapping[str, float] | None = None
    """what `kept` gave: goes on from there, and with what was asked for there, or else begins a new average"""
    run: LongRun = field(init=False)
    """the average so far, and λ"""

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not callable(getattr(self.predictor, "scaled", None)):
            raise SettingError(f"{self.predictor!r} has no scaled(λ), which is what adapts; take one that was fitted")
        if not 0 < self.missed < 1 or not 0 < self.rate <= 1 or not 0 < self.period <= 1:
            raise SettingError(
                "expected a share missed between 0 and 1, a rate and a period [s] above 0 and at most 1, got "
                f"{self.missed}, {self.rate} and {self.period}; try 0.1, 0.005 and that of the simulation"
            )
        if not 0 < self.smallest <= self.start <= self.largest <= LARGEST:
            raise SettingError(
                f"expected 0 < smallest ≤ start ≤ largest ≤ {LARGEST:g}, got {self.smallest}, {self.start} and "
                f"{self.largest}; try 0.1, 1 and 10"
            )
        asked = {name: getattr(self, name) for name in ("missed", "rate", "smallest", "largest")}
        self.run = LongRun.begun(**asked, scale=self.start)
        if self.state is not None:
            state, expected = dict(self.state), asdict(self.run)
            if set(state) != set(expected) or not all(np.isfinite(each) for each in state.values()):
                raise SettingError(
                    f"got the state {state}; expected finite {', '.join(expected)}, as `kept` gives them"
                )
            known = LongRun(**state)  # pyright: ignore[reportArgumentType]
            alike = all(state[name] == value for name, value in asked.items())
            self.run = known if alike else LongRun.begun(**asked, scale=known.scale)
        self._open = list[_Windows]()
        self._last: Scene | None = None

    @property
    def scale(self) -> float:
        """λ now."""
        return self.run.scale

    @property
    def kept(self) -> dict[str, float]:
        """What it was asked for and has learned, as plain numbers; windows under way are left out."""
        return asdict(self.run)

    def anew(self) -> "Adaptive":
        """Another one that knows as much, with no windows under way."""
        return replace(self, state=self.kept)

    @property
    def fingerprint(self) -> str:
        """What tells it apart, what it has learned included."""
        inner = getattr(self.predictor, "fingerprint", None) or type(self.predictor).__qualname__
        return f"{inner}, adapting every {self.period:g} s from {asdict(self.run)}"

    @property
    def horizon(self) -> float:
        """[s] that the predictor looks ahead."""
        return self.predictor.horizon

    def choices(self, scene: Scene, road: Road, times: Float[np.ndarray, " n"]) -> tuple[np.ndarray, ...]:
        """What the predictor says that traffic may do."""
        return self.predictor.choices(scene, road, times)

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """The paths of the present scale, after learning from where vehicles are now; as `Belief.predict`."""
        again = scene is self._last
        if not again:
            self._learn(scene, ego)
        paths = self.predictor.scaled(self.scale).predict(scene, road, ego, dt, steps)
        if not again and (watched := near(scene, road, ego)).any():
            own = paths.of(watched[paths.vehicle])
            own = every(self.period, own) if own.ellipses is None else own
            held = np.ones(len(own), dtype=bool)
            self._open.append(_Windows(own, scene.half_sizes[own.vehicle], held, watched, own.dt / self.period))
            self.run.most = max(self.run.most, sum(int(each.open.sum()) for each in self._open))
        return paths

    def _learn(self, scene: Scene, ego: int) -> None:
        """Settle windows by the scene of the next moment."""
        before, self._last = self._last, scene
        same = np.zeros(0, dtype=bool) if before is None else _same(before, scene, self.period)
        if before is None or ego >= len(same) or not same[ego]:
            self._open.clear()  # another drive
            return
        first, then = (each.states[: len(same), [0, 1, 3]] for each in (before, scene))
        for windows in self._open:
            settled, lost = windows.follow(first, then, same)
            self.run.settle(lost, settled)
        self._open = [each for each in self._open if each.open.any()]


def _same(before: Scene, now: Scene, period: float) -> Bool[np.ndarray, " B"]:
    """Of the slots of both scenes, those with a vehicle that is where its speeds took it from one to the other."""
    slots = min(before.vehicles, now.vehicles)
    first, last = before.states[:slots], now.states[:slots]
    speed, heading = (first[:, 2:] + last[:, 2:]).T / 2
    way = period * speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    moved = np.abs(last[:, :2] - first[:, :2] - way).max(1) <= _JUMP
    return moved & np.asarray(before.valid)[:slots] & np.asarray(now.valid)[:slots]
