"""Recorded traffic: sets are tried on scenes that share no vehicle with those that they were fitted to.

Replays of one scene depend on each other, and so do scenes with the same vehicles: what counts is the group of scenes
in which no vehicle of another one drives. A certificate needs many of them. A size of the sets can be chosen with two:
each group is driven by what was fitted to all others. Sizes are compared by the share of a calibration vehicle's
windows that leave the sets, because λ is relative to sets whose size depends on how many vehicles calibrated them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from coverdrive.errors import DataError
from coverdrive.files import write_stream
from coverdrive.league.beliefs import KnownFuture
from coverdrive.linked import linked
from coverdrive.percentages import percent
from coverdrive.prediction.certifying.scored import ScoredSides
from coverdrive.prediction.data.segments import Segments, cut_segments
from coverdrive.prediction.data.split import Split
from coverdrive.prediction.fit import PredictionSettings, fit, scale_left
from coverdrive.prediction.fits.provenance import made_from
from coverdrive.prediction.predictor import AnyPredictor, Predictor
from coverdrive.progress import stage
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.measures.notable import COLLIDED, OWN_FAULT
from coverdrive.simulation.measures.statistics import plan_share
from coverdrive.simulation.measures.trial import STARTED
from coverdrive.simulation.predictor import Belief
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.studies.study import drive_missing
from coverdrive.simulation.traffic.reactive_replay import ReactiveReplaySettings
from coverdrive.simulation.traffic.replay import cut_scenarios

SHARES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8)
"""of a calibration vehicle's windows that leave the sets that are tried"""

FUTURE = 0.0
"""stands in the table for knowing the future"""

_SIDES = 3
"""groups that a fit by whole groups needs"""

_TRAINING, _CALIBRATION = 0.65, 0.3
"""shares of the vehicles, where the scenes that are left to fit to are all of one recording"""


def independent(recordings: Sequence[Recording]) -> list[list[Recording]]:
    """The recordings in parts of which no vehicle is in two, the largest part first."""
    shown = pl.concat(
        each.table.select("identity").unique().with_columns(recording=pl.lit(number, pl.Int64))
        for number, each in enumerate(recordings)
    )
    links = shown.join(shown, on="identity", suffix="_b")
    part = linked(links["recording"].to_numpy(), links["recording_b"].to_numpy(), len(recordings))
    return [[recordings[i] for i in np.flatnonzero(part == each).tolist()] for each in np.argsort(-np.bincount(part))]


def sides_by_vehicle(segments: Segments, seed: int) -> Split:
    """Sides of segments by vehicles alone, for scenes that are all of one recording."""
    vehicle = np.unique(segments.vehicle, return_inverse=True)[1]
    place = np.random.default_rng(seed).permutation(vehicle.max() + 1) / (vehicle.max() + 1)
    side = np.searchsorted([_TRAINING, _TRAINING + _CALIBRATION], place, side="right")[vehicle]
    return Split(*(np.flatnonzero(side == each) for each in range(3)), dropped=0)


def across_groups(
    recordings: Sequence[Recording],
    settings: PredictionSettings,
    setup: Setup,
    folder: Path,
    drives: int = 100,
    workers: int = 1,
    cluster: str | None = None,
) -> pl.DataFrame:
    """Replays of every group of scenes, driven by what was fitted to all others; a line for each, by `SHARES`.

    Args:
        recordings: all of them.
        settings: of the fits.
        setup: of the replays; predictor and scenes are replaced.
        folder: of fits and drives, which go on where they were stopped.
        drives: trials of each group, for every share; those that cannot start are no drives, and a group of which none
            can is left out.
        workers: number of processes.
        cluster: address of a Dask scheduler whose workers drive instead.

    Returns:
        Columns ``group``, ``share`` (0: the future is known, unless vehicles react), ``scale``, ``drives``,
        ``collisions``, ``own_fault``, ``mean_speed``, ``share_unsafe``.

    Raises:
        DataError: all scenes show vehicles of one another, or too few to be fitted to, or no drive can start.
    """
    groups = independent(recordings)
    if len(groups) < 2:
        raise DataError(
            f"all {len(recordings)} recordings share vehicles, so that nothing can be fitted to some and tried on "
            "others; give recordings of another time or place as well"
        )
    lines = list[dict[str, object]]()
    for number, group in enumerate(groups):
        scenarios = tuple(cut_scenarios(group))
        if not scenarios:
            continue
        others = [each for other in groups if other is not group for each in other]
        predictor, scales = _fitted(others, settings, setup.seed, folder / "fits")
        reacting = isinstance(setup.traffic, ReactiveReplaySettings)
        beliefs: dict[float, Belief] = {} if reacting else {FUTURE: KnownFuture(scenarios)}
        beliefs |= {share: predictor.scaled(scale) for share, scale in zip(SHARES, scales, strict=True)}
        for share, belief in beliefs.items():
            there = replace(setup, predictor=belief, scenarios=scenarios)
            files = StudyFolder(folder / "groups" / str(number) / f"{share:g}")
            files.claim(there.description())
            with stage(f"replays of group {number + 1} of {len(groups)}, share {share:g} ({drives})"):
                table = drive_missing(files.table_of([]), drives, files, there, workers, cluster).filter(STARTED)
            if table.is_empty():
                break
            lines.append(
                {
                    "group": number,
                    "share": share,
                    "scale": getattr(belief, "scale", None),
                    "drives": table.height,
                    "collisions": int(table.select(COLLIDED.sum()).item()),
                    "own_fault": int(table.select(OWN_FAULT.sum()).item()),
                    "mean_speed": float(table["mean_speed"].to_numpy().mean()),
                    "share_unsafe": plan_share(table, "unsafe"),
                }
            )
    if not lines:
        raise DataError(
            f"no replay of any of the {len(groups)} groups of scenes could start; give longer recordings, or a smaller "
            "traffic.gap"
        )
    found = pl.DataFrame(lines, infer_schema_length=None)
    write_stream(folder / "groups.csv", found.write_csv)
    return found


@dataclass(frozen=True)
class ChosenOnGroups:
    """A scale that was chosen on replays, of which nothing is proved."""

    share: float
    """of calibration windows that leave the sets"""
    scale: float
    """λ with which those of the predictor do"""
    groups: int
    """groups of scenes that share no vehicle"""
    needed: int
    """groups without a collision that would prove the risk that was asked for"""
    table: pl.DataFrame
    """of `across_groups`"""

    @property
    def sentence(self) -> str:
        """What was chosen, and why nothing is proved."""
        known, ours = (self.table.filter(pl.col("share") == share) for share in (FUTURE, self.share))
        best = {
            group: f" of {speed:.1f} with the future known"
            for group, speed in known.select("group", "mean_speed").iter_rows()
        }
        spread = " and ".join(
            f"{mine['mean_speed']:.1f} m/s{best.get(mine['group'], '')}, {mine['collisions']} collisions in "
            f"{mine['drives']} drives, {percent(mine['share_unsafe'])} unsafe plans"
            for mine in ours.iter_rows(named=True)
        )
        return (
            f"Nothing is proved of replays: {self.groups} groups of scenes share no vehicle, and {self.needed:,} would "
            "be needed, none with a collision. Chosen are sets that a calibration vehicle leaves in "
            f"{percent(self.share)} of its windows (scale {self.scale:.2g}); in the groups, each driven by what was "
            f"fitted to the others: {spread}."
        )


def chosen_share(table: pl.DataFrame) -> float:
    """The share with the fewest collisions at the ego's fault, and then the fewest unsafe plans, all groups alike."""
    ours = table.filter(pl.col("share") != FUTURE)
    each = ours.group_by("share").agg((pl.col("own_fault") / pl.col("drives")).mean(), pl.col("share_unsafe").mean())
    return float(each.sort("own_fault", "share_unsafe", "share")["share"][0])


def _fitted(
    recordings: Sequence[Recording], settings: PredictionSettings, seed: int, folder: Path
) -> tuple[AnyPredictor, list[float]]:
    """What was fitted to recordings, once, and the scale for each share; each fit has its own folder."""
    folder /= made_from(recordings, settings, seed)
    predictor, scores = folder / "predictor.safetensors", folder / "scores.safetensors"
    if not scores.exists():
        sides = None
        if len(independent(recordings)) < _SIDES:
            sides = sides_by_vehicle(cut_segments(recordings, settings.segments), seed)
        result = fit(recordings, settings, seed, epsilon="auto", sides=sides)
        result.predictor.save(predictor)
        result.scored.save(scores)
    found = Predictor.load(predictor)
    calibration = ScoredSides.load(scores, found).calibration
    return found, [scale_left(found, calibration, share) for share in SHARES]
