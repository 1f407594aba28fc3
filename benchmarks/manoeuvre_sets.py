"""Would one box per manoeuvre miss fewer lane changes? `python benchmarks/manoeuvre_sets.py --recording commonroad/`.

The recorded scenes are two groups that share no vehicle. One trains; on the other, as in every fit, one number is
calibrated for all sets alike, and each vehicle is judged by what the others calibrate; then the other way round. A
window is missed unless the whole body stays in one box of its set every 0.1 s. *A box per manoeuvre*: boxes learned on
the windows of each alone (keep; left and right, from the lane changes to both; hard braking; hard acceleration), let in
and sized by the probability p of each: box k is s_k·(t + log p_k/(A_k·s_k²) + b_k)^(1/a) times as large as learned,
where that is positive, which are the level sets of a mixture. A_k is its area; s, a, and b, the thresholds of their
own, are those of the smallest sets for windows of one half of the training vehicles, predicted from the other half.
*Known*: the right box alone, as an oracle would choose. Lane changes are farther than 1.5 m across in 3 s, some of them
cut-ins, hard is farther than 6 m along from constant velocity. Areas are those of unions, mean over 0.5 to 3 s, without
bodies, and with. Intervals are 95 %, by vehicle. ``--write`` puts the tables into `benchmarks/RESULTS.md`.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import expit, logit
from scipy.stats import rankdata

import coverdrive
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.evaluation import Rate
from coverdrive.prediction.boxes import boxes as of_boxes
from coverdrive.prediction.boxes.boxes import TUBE, Boxes, scored_by
from coverdrive.prediction.boxes.network import BoxNetwork
from coverdrive.prediction.boxes.training import BoxSettings, train_boxes
from coverdrive.prediction.certifying.calibrate import CertificateSettings, calibrate, held_back
from coverdrive.prediction.data.manoeuvres import ACROSS, ALONG, manoeuvres_of
from coverdrive.prediction.data.segments import MIRROR, Segments
from coverdrive.prediction.fit import USUALLY_LEFT, PredictionSettings, cut_and_split
from coverdrive.prediction.learning.affordance import mirrored_features
from coverdrive.prediction.learning.samples import Samples, make_features
from coverdrive.prediction.learning.training import TrainingSettings, train
from coverdrive.recordings.recording import Recording
from results import write_section

KEEP, LEFT, RIGHT, BRAKE, ACCELERATE = range(5)
SWAPPED = [KEEP, RIGHT, LEFT, BRAKE, ACCELERATE]
COMMON, RARE = BoxSettings(), BoxSettings(weight_decay=1.0, most_steps=700)
SCORES = TrainingSettings(inputs="urgency", prior=0.1, noise=0.3, weight_decay=0.1, hidden=(64, 64), most_steps=1000)
POWERS, CHANGE, HARD, AT = (1.0, 1.5, 2.0), (-1.0, 0.0, 1.0, 2.0), (-1.5, 0.0, 1.5), (0.05, 0.1)
CLAIM, CHANGES_MISSED, MORE = 0.1, 0.35, (2.0, 4.0)
AHEAD = ((0.0, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 4.0), (4.0, 6.0))
ONE = "one box"
COLUMNS = ("sets", "area [m²]", "with bodies", "missed of a vehicle's windows", "of lane changes", "of cut-ins",
           "of hard", "of the rest", "paths")  # fmt: skip


@dataclass(frozen=True)
class Windows:
    """N windows, and what is seen at their start."""

    recordings: Sequence[Recording]
    segments: Segments
    features: np.ndarray

    def of(self, keep: np.ndarray) -> "Windows":
        """Some of them."""
        return Windows(self.recordings, self.segments.of(keep), self.features[keep])

    @property
    def kind(self) -> np.ndarray:
        """The manoeuvre of each."""
        along, across = self.segments.points[:, -1].T
        return np.select([across > ACROSS, across < -ACROSS, along < -ALONG, along > ALONG], range(1, 5), KEEP)


@dataclass(frozen=True)
class Sets:
    """K boxes of each of N windows, and how much larger than learned they are at a level."""

    centre: np.ndarray
    half: np.ndarray
    early: np.ndarray
    weight: np.ndarray | float = 0.0
    size: np.ndarray | float = 1.0
    power: float = 1.0

    def mixed(self, likely: np.ndarray, power: float, size: np.ndarray, bonus: np.ndarray) -> "Sets":
        """The level sets of a mixture."""
        area = 4 * self.half.prod(-1).mean(-1).T * size**2
        return replace(self, weight=np.log(np.maximum(likely, 1e-300) / area) + bonus, size=size, power=power)

    def ratios(self, windows: Windows) -> np.ndarray:
        """(N, K) scales from which on boxes hold whole windows."""
        boxes = [Boxes(centre, half, early=self.early) for centre, half in zip(self.centre, self.half, strict=True)]
        scores = [scored_by(each, windows.segments, windows.recordings).score_of_base for each in boxes]
        return 1 / np.maximum(np.stack(scores, -1), 1e-9) - 1

    def levels(self, ratios: np.ndarray) -> np.ndarray:
        """(N,) from which on windows that boxes hold at such scales are in the set."""
        return ((ratios / self.size) ** self.power - self.weight).min(1)

    def at(self, level: float) -> np.ndarray:
        """Half sizes (K, N, P, 2); 0 where a box is not in the set."""
        scale = self.size * np.maximum(level + self.weight, 0) ** (1 / self.power)
        return self.half * np.broadcast_to(scale, self.half.shape[1::-1]).T[:, :, None, None]


class Manoeuvres:
    """A box for each manoeuvre, and how likely it is."""

    def __init__(self, windows: Windows, early: np.ndarray):
        kind, before, after = windows.kind, windows.segments, windows.segments.mirrored
        right, mirrored = (kind == RIGHT)[:, None], mirrored_features(windows.features)
        points = np.where(right[..., None], after.points, before.points)
        segments = replace(before, points=points, heading=np.where(right, after.heading, before.heading))
        features = np.where(right, mirrored, windows.features)
        self.boxes = dict[int, BoxNetwork]()
        for name in (KEEP, LEFT, BRAKE, ACCELERATE):
            own = (kind == name) | (right[:, 0] & (name == LEFT))
            settings = (COMMON if name == KEEP else RARE).model_copy(update={"mirrored": name != LEFT})
            self.boxes[name], _ = train_boxes(features[own], segments.of(own), settings, 0, "share", early)
        empty = np.zeros((len(kind), 5), dtype=bool)
        lessons = Samples(windows.features, empty.astype(float), empty, kind, before.vehicle, before.group)
        lessons = lessons.and_also(replace(lessons, features=mirrored, base=np.array(SWAPPED)[kind]))
        self.scores, _ = train(lessons, SCORES)

    def sets(self, features: np.ndarray) -> Sets:
        """The boxes of all, as learned; those to the right are to the left of the mirror image."""
        own = {name: network.boxes_of(features) for name, network in self.boxes.items()}
        mirrored = self.boxes[LEFT].boxes_of(mirrored_features(features))
        own[RIGHT] = replace(mirrored, centre=mirrored.centre * MIRROR)
        centre, half = (np.stack([getattr(own[k], name) for k in range(5)]) for name in ("centre", "half_sizes"))
        return Sets(centre, half, own[KEEP].early)

    def probability(self, features: np.ndarray) -> np.ndarray:
        """(N, 5), the same for mirror images."""
        one, other = (np.asarray(self.scores.scores(each)) for each in (features, mirrored_features(features)))
        return (one + other[:, SWAPPED]) / 2


def tuned(halves: Sequence[tuple[Manoeuvres, Windows]]) -> tuple[float, np.ndarray, np.ndarray]:
    """The a, s and b with which sets are smallest for windows that did not train their boxes."""
    parts = [(made.sets(own.features), made.probability(own.features)) for made, own in halves]
    ratios = [sets.ratios(own) for (sets, _), (_, own) in zip(parts, halves, strict=True)]
    truth = np.eye(5, dtype=bool)[np.concatenate([own.kind for _, own in halves])]
    vehicle, r = np.concatenate([own.segments.vehicle for _, own in halves]), np.minimum(np.concatenate(ratios), 30)
    best: tuple[Any, ...] = (np.inf,)
    for power, change, hard in product(POWERS, CHANGE, HARD):
        mean = np.array([np.mean(r[own, k] ** power) if own.any() else 1.0 for k, own in enumerate(truth.T)])
        size, bonus = (power / 2 * mean) ** (1 / power), np.array([0, change, change, hard, hard])
        mixed = [sets.mixed(likely, power, size, bonus) for sets, likely in parts]
        levels = np.concatenate([each.levels(ratio) for each, ratio in zip(mixed, ratios, strict=True)])
        at = [quantile(levels, vehicle, share) for share in AT]
        cost = sum(np.log(np.mean([union_areas(each.centre, each.at(level)) for each in mixed])) for level in at)
        best = (cost, power, size, bonus) if cost < best[0] else best
    return best[1:]


def union_areas(centre: np.ndarray, half: np.ndarray) -> float:
    """[m²] of unions of K boxes (K, …, 2), on average."""
    edges = np.sort(np.concatenate([centre - half, centre + half]), axis=0)
    within = np.abs((edges[:-1] + edges[1:])[:, None] / 2 - centre) < half
    taken, apart = (within[:, None, ..., 0] & within[None, ..., 1]).any(2), np.diff(edges, axis=0)
    return float((taken * apart[:, None, ..., 0] * apart[None, ..., 1]).sum((0, 1)).mean())


def quantile(levels: np.ndarray, vehicle: np.ndarray, share: float) -> float:
    """The level at which this share of a vehicle's windows is missed, on average over vehicles."""
    member, order = np.unique(vehicle, return_inverse=True)[1], np.argsort(levels)
    held = np.cumsum((1 / np.bincount(member)[member])[order]) / (member.max() + 1)
    return float(levels[order][np.searchsorted(held, 1 - share)])


def judged(test: Windows, sets: Sets, missed: np.ndarray, level: float) -> list[str]:
    """What a row says of the sets of a level."""
    centre, half, body = sets.centre, sets.at(level), test.segments.half_sizes[:, None]
    vehicle, kinds = test.segments.vehicle, manoeuvres_of(test.recordings, test.segments)
    there, member = half.max(-1, keepdims=True) > 0, np.unique(vehicle, return_inverse=True)[1]
    groups = [kinds["cut_in"] | kinds["lane_change"], *(kinds[name] for name in ("cut_in", "hard", "rest"))]
    rates = [Rate.of_losses(np.bincount(member, missed) / np.bincount(member))]
    rates += [Rate.by_cluster(missed[own], vehicle[own]) for own in groups]
    areas = [union_areas(centre, each) for each in (half, (half + body) * there)]
    shown = [f"{100 * each.value:.1f} % ({100 * each.low:.1f}–{100 * each.high:.1f})" for each in rates]
    return [*(f"{area:.1f}" for area in areas), *shown, f"{there[..., 0, 0].sum(0).mean():.2f}"]


def foreseen(test: Windows, likely: np.ndarray) -> str:
    """AUC of probabilities against windows without a manoeuvre, of lane changes by the time before the line."""
    ahead, kind = np.full(len(likely), np.inf), test.kind
    for index in np.unique(test.segments.recording):
        recording, own = test.recordings[index], test.segments.recording == index
        vehicle, lon, lat = recording.table.select("vehicle", "lon", "lat").to_numpy().T
        lane, start = recording.road.lane_at(lon, lat), test.segments.row[own]
        over = np.append(np.flatnonzero((np.diff(lane) != 0) & (np.diff(vehicle) == 0)) + 1, len(lane))
        line = over[np.searchsorted(over, start, side="right")]
        same = np.append(vehicle, np.nan)[line] == vehicle[start]
        ahead[own] = np.where(same, (line - start) * recording.dt, np.inf)

    def auc(scores: np.ndarray, own: np.ndarray, others: np.ndarray) -> str:
        ranks = rankdata(np.concatenate([scores[own], scores[others]]))[: own.sum()]
        return f"{(ranks.mean() - (own.sum() + 1) / 2) / others.sum():.2f}"

    change, none = likely[:, LEFT] + likely[:, RIGHT], (kind == KEEP) & (ahead > AHEAD[-1][1])
    said = [f"{low:g} to {high:g} s {auc(change, (ahead > low) & (ahead <= high), none)}" for low, high in AHEAD]
    hard = [auc(likely[:, name], kind == name, kind == KEEP) for name in (BRAKE, ACCELERATE)]
    return f"\nAUC, before a lane line: {', '.join(said)}; of hard braking {hard[0]}, of hard acceleration {hard[1]}."


def tables(learning: Windows, test: Windows) -> list[str]:
    """Of one group that trains and one that calibrates and tests."""
    early, own = of_boxes.early_share(learning.segments, learning.recordings), learning.segments.vehicle
    box, _ = train_boxes(learning.features, learning.segments, COMMON, 0, "share", early)
    half = np.isin(own, np.random.default_rng(1).permutation(np.unique(own))[: len(np.unique(own)) // 2])
    halves = [(Manoeuvres(learning.of(~each), early), learning.of(each)) for each in (half, ~half)]
    made, (power, size, bonus) = Manoeuvres(learning, early), tuned(halves)
    still = of_boxes.constant_velocity(learning.segments, early)

    def alone(some: Windows, boxes: Boxes) -> Sets:
        place = np.zeros((1, *some.segments.points[:, 1:].shape))
        return Sets(place + boxes.centre, place + boxes.half_sizes, early)

    def mixture(some: Windows, more: float = 0, known: bool = False) -> Sets:
        likely = np.eye(5)[some.kind] if known else made.probability(some.features)
        return made.sets(some.features).mixed(likely, power, size, bonus + more * np.array([0, 1, 1, 0, 0]))

    makers: dict[str, Callable[[Windows], Sets]] = {
        "constant velocity": lambda some: alone(some, still),
        ONE: lambda some: alone(some, box.boxes_of(some.features)),
        "a box per manoeuvre": mixture,
        **{f"the same, b + {more:g} for lane changes": partial(mixture, more=more) for more in MORE},
        "known manoeuvre": partial(mixture, known=True),
    }
    blocks, vehicle, settings = dict[str, list[list[str]]](), test.segments.vehicle, CertificateSettings(epsilon=CLAIM)
    changes = np.abs(test.segments.points[:, -1, 1]) > ACROSS
    for name, maker in makers.items():
        samples, sets, level = list[ScoredSamples](), maker(test), np.zeros(0)
        for some in (learning, test):
            level, zero = (each := maker(some)).levels(each.ratios(some)), np.zeros(len(some.segments), dtype=int)
            about = some.segments.vehicle, None, some.segments.group
            samples += [ScoredSamples(expit(-level / 4)[:, None], zero, 0.0 * zero, *about)]
        rule, _ = calibrate(TUBE, *samples, settings, 0)
        threshold = rule.arrays["thresholds"][0]
        claimed = float(-4 * logit(threshold))
        usual, equal = quantile(level, vehicle, USUALLY_LEFT), float(np.quantile(level[changes], 1 - CHANGES_MISSED))
        for title, at, missed in (
            (f"At most {CLAIM:.0%} of a vehicle's windows, at 99 %", claimed,
             held_back(rule, TUBE, *samples, settings, 0).scores[:, 0] < threshold),
            (f"So large that {CHANGES_MISSED:.0%} of the lane changes are missed", equal, level > equal),
            (f"So large that {USUALLY_LEFT:.0%} of a vehicle's windows are missed", usual, level > usual),
        ):  # fmt: skip
            blocks.setdefault(title, []).append([name, *judged(test, sets, missed, at)])
    count = [len(np.unique(side.segments.vehicle)) for side in (learning, test)]
    said = f"s = {size.round(2).tolist()}, b = {bonus.tolist()}."
    lines = [f"\nTrained on {count[0]} vehicles, calibrated and tested on {count[1]} others: a = {power:g}, {said}"]
    for title, rows in blocks.items():
        lines += [f"\n{title}:\n", *(f"| {' | '.join(row)} |" for row in (COLUMNS, ["---"] * len(COLUMNS), *rows))]
    return [*lines, foreseen(test, made.probability(test.features))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recording", type=Path, nargs="+", required=True)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    recordings = coverdrive.read(given.recording)
    segments, sides = cut_and_split(recordings, PredictionSettings(), 0)
    if not sides.crossed:
        raise SystemExit("the recordings do not fall into two groups that share no vehicle")
    windows = Windows(recordings, segments, make_features(recordings, segments))
    groups = windows.of(sides.train), windows.of(sides.calibration)
    lines = [line for each in (groups, groups[::-1]) for line in tables(*each)]
    print("\n".join(lines))
    if given.write:
        write_section("One box per manoeuvre", __doc__, "\n".join(lines))


if __name__ == "__main__":
    main()
