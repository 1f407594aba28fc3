"""How probable a collision is in a drive, where drives that one can afford have none: splitting over the traffic.

All that is random in a drive comes from a tape: number and places of the vehicles, and what the traffic draws at its
beginning and on its way. The level of a moment is minus the distance that is left between the ego and another vehicle
once they have shed the speed at which they approach; contact is above all.

A folder holds ``study.json`` (what is driven) · ``repetitions/`` one file for each that is finished · ``collisions/``
drives that were found, as traces and as tapes, from which `again` drives them.
"""

import copy
import json
import math
import time
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_FLOOR
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit

from coverdrive.certificates.methods import to_two_digits
from coverdrive.dialling.splitting import Path as Found
from coverdrive.dialling.splitting import split
from coverdrive.dialling.tape import Tape
from coverdrive.errors import CertificateError, DataError, SettingError, blaming, during
from coverdrive.files import write_arrays, write_json
from coverdrive.geometry import turned_half_extents
from coverdrive.locks import alone
from coverdrive.percentages import at_most, percent
from coverdrive.progress import done, stage
from coverdrive.scene import Scene
from coverdrive.simulation.drives.episode import begin, take_step
from coverdrive.simulation.drives.fault import collision_at
from coverdrive.simulation.drives.outcome import judge
from coverdrive.simulation.drives.storage import save_trace
from coverdrive.simulation.drives.trace import Step, Trace, make_trace
from coverdrive.simulation.measures.trial import Row
from coverdrive.simulation.predictor import Learning
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.setup import Participants, Setup
from coverdrive.simulation.studies.workers import run_trials

CONTACT = 1000.0
"""level of a contact, to which its relative speed [m/s] is added; before, levels are lower"""
_SHED, _COUNTS = np.array([4.0, 2.0]), np.array([1.0, 3.0])
"""along and across the road: [m/s²] at which the speed of an approach is shed, and as how many a metre counts: within
1.4 m across of somebody who keeps to the next lane is ordinary"""
_STORED = 5
"""collisions of a repetition that are stored"""


def danger(scene: Scene) -> float:
    """Minus the distance [m] that is left between the ego and the vehicle that is most dangerous to it.

    Of the gap along or across the road, whichever leaves more, speed² / (2 deceleration) is lost if it closes, and
    gained if it grows; across the road a metre counts as three. Where both leave less than nothing, it is their
    geometric mean. Whoever keeps to the next lane is as near as every other there, however fast the ego passes.
    """
    states, extents = scene.states, turned_half_extents(scene.half_sizes, scene.heading)
    velocity = states[:, 2, None] * np.stack([np.cos(states[:, 3]), np.sin(states[:, 3])], axis=-1)
    apart, leaving = states[:, :2] - states[EGO, :2], velocity - velocity[EGO]
    closing = -np.sign(apart) * leaving
    each = _COUNTS * (np.abs(apart) - extents - extents[EGO] - np.abs(closing) * closing / (2 * _SHED))
    left = np.where((each < 0).all(-1), -np.sqrt(np.abs(each.prod(-1))), each.max(-1))
    others = np.asarray(scene.valid) & (np.arange(scene.vehicles) != EGO)
    return float(np.clip(-left[others].min(initial=CONTACT), -CONTACT, CONTACT - 1))


class Drive:
    """A drive on its way, as `coverdrive.dialling.splitting.Process`."""

    def __init__(self, setup: Setup, participants: Participants, tape: Tape):
        """Draw the number of vehicles and the start; a StartError if they cannot be placed."""
        self._belief, self._settings, self._tape = participants[0], setup.episode, tape
        scenarios = () if callable(setup.scenarios) else setup.scenarios
        self._shared: list[Any] = [setup.predictor, setup.sampled, *scenarios]
        """what no drive changes"""
        self._planner, self._traffic = self._copies(participants[1:], tape)
        vehicles = int(tape.choice(np.array(setup.vehicles)))
        self._scene, self._road, self._last = begin(self._traffic, self._settings, vehicles, tape)
        self._shared.append(self._road)
        with blaming("planner", self._planner):
            self._planner.reset(self._settings.step)
        self._moment, self.level, self.over = 0, danger(self._scene), False

    def _copies(self, parts: Any, tape: Tape) -> Any:
        kept = {id(each): each for each in self._shared}
        return copy.deepcopy(parts, kept | {id(self._tape): tape})

    def advance(self) -> Step:
        """One step, and what happened in it."""
        with during(f"in step {self._moment + 1}, {self._moment * self._settings.step:g} s after the start"):
            taken = take_step(self._belief, self._planner, self._traffic, self._settings, self._scene, self._road)
        before, self._scene = self._scene, taken.moved.scene
        self._moment += 1
        contact = judge(before, self._scene, self._road)
        self.over = contact is not None or self._moment >= self._last
        self.level = danger(self._scene) if contact is None else CONTACT + _relative_speed(before, contact[1])
        return taken

    def copied(self, tape: Tape) -> "Drive":
        """The same, to go on with another tape."""
        other = copy.copy(self)
        other._planner, other._traffic = self._copies((self._planner, self._traffic), tape)
        other._tape = tape
        return other

    def traced(self) -> Trace:
        """Drive to the end, from the start, and keep all that happens."""
        start, scenes, steps, dt = self._scene, [self._scene], list[Step](), self._settings.step
        while not self.over:
            self._tape.turn(len(scenes))
            steps.append(self.advance())
            scenes.append(self._scene)
        return make_trace(start, self._road, steps, dt, collision_at(len(steps), scenes, dt, self._road))


def _relative_speed(scene: Scene, other: int) -> float:
    """[m/s] of the ego and another vehicle."""
    velocity = scene.speed * np.exp(1j * np.asarray(scene.heading))
    return float(abs(velocity[other] - velocity[EGO]))


def again(setup: Setup, tape: Path, participants: Participants | None = None) -> Trace:
    """A drive that was found, driven again from its file; a DataError if that is none or the drive is another one."""
    try:
        with np.load(tape, allow_pickle=False) as file:
            kept = Tape.of(dict(file))
    except (OSError, ValueError, KeyError) as error:
        raise DataError(f"{tape} is not the tape of a drive ({error}); name one of a folder `collisions`") from error
    return Drive(setup, participants or setup.participants(), kept).traced()


@dataclass(frozen=True)
class Rare:
    """How probable a collision is in a drive."""

    folder: Path
    repetitions: list[Row]
    """what came out of each, of which all are independent"""

    @property
    def level(self) -> float | None:
        """Minus the metres left, which all repetitions came above, where some ended without a collision, or None."""
        return min((each["curve"][-1][0] for each in self.repetitions if each["rarer"]), default=None)

    @property
    def estimates(self) -> list[float]:
        """Of the probability of a collision, or of getting above `level`, one of each repetition."""
        level = self.level
        return [each["probability"] if level is None else _above(each["curve"], level) for each in self.repetitions]

    @property
    def probability(self) -> float:
        """That the ego touches another vehicle in a drive, or that it gets above `level`, which is more.

        Estimates are unbiased at every level, and so at the first one at which a repetition ends.
        """
        return float(np.mean(self.estimates))

    @property
    def standard_error(self) -> float:
        """Of `probability`, from the spread of the repetitions."""
        return _error(self.estimates)

    @property
    def interval(self) -> tuple[float, float]:
        """Of the probability of a collision, 95 %: Student's, of the logarithm by the delta method.

        Where repetitions ended before, the upper end is that of getting above `level`, and they count as 0 in the lower
        one, which is 0 where all ended so. With few particles the estimates are so skew that it ends too low: of two to
        eight estimates that are lognormal, the truth is outside in 5 to 6 % of the cases if they spread by half their
        mean, and in 6 to 10 % if they do by as much as their mean. Estimates that are all equal tell nothing.
        """
        reached = [0.0 if each["rarer"] else each["probability"] for each in self.repetitions]
        return _ends(reached)[0], _ends(self.estimates)[1]

    @property
    def drives(self) -> float:
        """What was driven, in whole drives."""
        return sum(each["drives"] for each in self.repetitions)

    @property
    def seconds(self) -> float:
        """[s] that it took, all processes together."""
        return sum(each["seconds"] for each in self.repetitions)

    @property
    def collisions(self) -> list[Path]:
        """Traces of drives that were found; the tape of each lies beside it."""
        return [self.folder / "collisions" / name for each in self.repetitions for name in each["collisions"]]

    @property
    def sentence(self) -> str:
        """What is claimed."""
        low, high = self.interval
        if self.probability == 0:
            return "No collision was found: take more particles, or drive where there are some."
        rarer, level = sum(each["rarer"] for each in self.repetitions), self.level
        low = to_two_digits(low, ROUND_FLOOR)
        error = f"standard error {100 * self.standard_error / self.probability:.0f} %"
        if level is not None:
            return (
                f"A drive has a collision with probability less than {at_most(high, 2)} (the upper end of a 95 % "
                f"interval that begins at {percent(low, 2)}): in {percent(self.probability, 2)} of drives ({error}) "
                f"less than {-level:.2f} m are left between the ego and another vehicle once they have braked, a metre "
                f"across counting as three, by {len(self.estimates)} independent repetitions, of which {rarer} ended "
                "without a collision, below what was to be looked for."
            )
        return (
            f"A drive has a collision with probability {self.probability:.2g} (95 % interval "
            f"{low:.2g} to {to_two_digits(high):.2g}; {error}): {len(self.estimates)} independent repetitions."
        )


def _ends(estimates: Sequence[float]) -> tuple[float, float]:
    """Ends of a 95 % interval of the mean of estimates."""
    mean = float(np.mean(estimates))
    if np.ptp(estimates) == 0:
        return 0.0, 1.0
    reach = stdtrit(len(estimates) - 1, 0.975) * _error(estimates) / mean
    return mean * math.exp(-reach), min(1.0, mean * math.exp(reach))


def _above(curve: Sequence[tuple[float, float]], level: float) -> float:
    """How probable it is to get above a level, by the curve of a repetition."""
    known = bisect_right([each for each, _ in curve], level)
    return curve[known - 1][1] if known else 1.0


def _error(estimates: Sequence[float]) -> float:
    """Standard error of the mean of estimates."""
    return float(np.std(estimates, ddof=1) / math.sqrt(len(estimates)))


@dataclass(frozen=True)
class _Repetitions:
    """Repetitions as what `coverdrive.simulation.studies.workers` runs."""

    setup: Setup
    folder: Path
    particles: int
    changes: int
    rarest: float

    @property
    def seed(self) -> int:
        return self.setup.seed

    @property
    def mine(self) -> Row:
        """What tells rows of this estimate from others."""
        return {"study": StudyFolder(self.folder).digest, "seed": self.seed}

    def description(self) -> dict[str, Any]:
        return self.setup.description() | {
            "splitting": {"particles": self.particles, "changes": self.changes, "rarest": self.rarest}
        }

    def participants(self) -> Participants:
        return self.setup.participants()

    def row(self, trial: int, participants: Participants) -> Row:
        """Estimate once, and keep the estimate and some of the collisions."""
        begun = time.perf_counter()
        random = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(trial,)))
        start = partial(Drive, self.setup, participants)
        with during(f"in repetition {trial} of seed {self.seed}"):
            found = split(start, random, CONTACT, self.particles, changes=self.changes, rarest=self.rarest)
        first = list({each.ancestor: each for each in found.found}.values())  # of different ancestors
        chosen = (first + [each for each in found.found if each not in first])[:_STORED]
        row: Row = {
            **self.mine,
            "repetition": trial,
            "probability": found.probability,
            "rarer": found.rarer,
            "stages": [each._asdict() for each in found.stages],
            "curve": found.curve,
            "found": len(found.found),
            "ancestors": len(first),
            "drives": found.moments / self.setup.episode.steps + len(chosen),
            "collisions": [self._store(each, f"{trial:04d}-{i}", participants) for i, each in enumerate(chosen)],
        }
        row["seconds"] = time.perf_counter() - begun
        write_json(self.file(trial), row)
        return row

    def _store(self, found: Found, name: str, participants: Participants) -> str:
        """Write a drive, as it is driven again, and its tape."""
        folder = self.folder / "collisions"
        write_arrays(folder / f"{name}.tape.npz", found.tape.arrays)
        save_trace(again(self.setup, folder / f"{name}.tape.npz", participants), folder / f"{name}.npz")
        return f"{name}.npz"

    def file(self, repetition: int) -> Path:
        return self.folder / "repetitions" / f"{repetition:04d}.json"

    def known(self, repetition: int) -> Row | None:
        """What came out if it is finished."""
        try:
            row = json.loads(self.file(repetition).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        mine = {**self.mine, "repetition": repetition}
        return row if isinstance(row, dict) and mine.items() <= row.items() and "curve" in row else None


def rare(
    setup: Setup,
    folder: Path | str,
    *,
    particles: int = 200,
    changes: int = 4,
    rarest: float = 1e-6,
    repetitions: int = 4,
    workers: int = 1,
) -> Rare:
    """Estimate the probability of a collision in a drive that can start, with any of the setup's numbers of vehicles.

    Args:
        setup: who drives where.
        folder: of this estimate and no other; what it holds is not driven again.
        particles: number of drives that each repetition goes on with.
        changes: number of times that a copy of a drive is changed.
        rarest: probability below which no collision is looked for.
        repetitions: that are independent; two at least.
        workers: number of processes.

    Raises:
        SettingError: a number makes no sense, hardly any drive can start, or the belief of the ego learns from drive
            to drive.
        CertificateError: the drives are replays.
        DataError: the folder holds something else, or another process drives in it.
    """
    if setup.replays:
        raise CertificateError(
            "replays of recorded scenes depend on each other, so that there is no probability of a collision to "
            "estimate; choose another traffic, as in `coverdrive rare --traffic drivers`"
        )
    if isinstance(setup.predictor, Learning):
        raise SettingError(
            "drives are copied midway and changed, which a belief that learns from one to the next does not allow; "
            "give the predictor at a fixed scale, as predictor.scaled(1.0)"
        )
    if min(repetitions - 1, workers) < 1:
        raise SettingError(
            f"a standard error needs at least 2 repetitions, and 1 worker; got {repetitions} and {workers}"
        )
    if not 0 < rarest < 1:
        raise SettingError(f"a collision is looked for down to a probability between 0 and 1, as 1e-6; got {rarest}")
    work = _Repetitions(setup.loaded(), Path(folder), particles, changes, rarest)
    with alone(work.folder):
        StudyFolder(work.folder).claim(work.description())
        rows = {each: row for each in range(repetitions) if (row := work.known(each))}
        with stage(f"repetitions ({repetitions})"):
            done(len(rows), repetitions)
            for row in run_trials(work, [each for each in range(repetitions) if each not in rows], workers):
                rows[row["repetition"]] = row
                done(len(rows), repetitions)
    return Rare(work.folder, [rows[each] for each in range(repetitions)])
