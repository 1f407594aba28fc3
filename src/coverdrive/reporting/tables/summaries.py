"""Summary tables for the terminal."""

from collections.abc import Iterator, Sequence

import numpy as np
from rich.table import Table
from rich.text import Text

from coverdrive.certificates.comparison import Compared
from coverdrive.percentages import at_most, counted, percent
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.fits.folds import Fold
from coverdrive.recordings.summary import Summary
from coverdrive.reporting.claim import BY_ITSELF, ON_AVERAGE, proved, set_facts, signs, strength, whose
from coverdrive.reporting.tables.fitting import columns_table, facts_table, or_none
from coverdrive.simulation.measures.trial import Row


def recordings_table(summaries: Sequence[Summary]) -> Table:
    """What is in each recording, and in lines below it how it was read and what had to be repaired."""
    rows: list[Sequence[str | Text]] = []
    for each in summaries:
        rows.append((
            Text(each.name), _range(each.groups), f"{each.vehicles:,}", f"{each.minutes:.2f}", f"{each.rows:,}",
            str(each.lanes), f"{each.mean_speed:.1f}/{each.max_speed:.1f}",
        ))  # fmt: skip
        how = [f"{name}: {note}" for name, note in each.notes.items() if name != "resampled"]
        rows += [(Text(f"  {line}", style="dim"),) for line in how]
        rows += [(Text(f"  {count:,} {kind}", style="dim"),) for kind, count in each.repairs.items()]
    columns = ("recording", "groups", "vehicles", "min", "rows", "lanes", "m/s")
    steps = ", ".join(sorted({f"{summary.dt:g} s" for summary in summaries}))
    caption = [f"m/s: mean/max; time step {steps}"]
    caption += sorted({f"resampled from {each.notes['resampled']}" for each in summaries if "resampled" in each.notes})
    return columns_table("Recordings", columns, rows, "; ".join(caption), first={}, no_wrap=True)


def _range(numbers: tuple[int, ...]) -> str:
    """Numbers without gaps as first–last, else one by one."""
    first, last = numbers[0], numbers[-1]
    if last - first + 1 == len(numbers) > 1:
        return f"{first}–{last}"
    return ", ".join(map(str, numbers))


def fit_table(result: Fit) -> Table:
    """The predictor, its guarantee, and how it did on scenes that did not train it."""
    return facts_table("Predictor", _fit_facts(result))


def _fit_facts(result: Fit) -> Iterator[tuple[str, str]]:
    evaluation, basis, split = result.evaluation, result.predictor.basis, result.split
    yield "segments", f"{len(result.segments):,} of {result.predictor.horizon:g} s"
    yield (
        "split by vehicle and scene",
        f"{len(split.train):,} training, {len(split.calibration):,} calibration, {len(split.test):,} test; "
        f"{split.dropped:,} left out",
    )
    if basis is not None:
        yield "base trajectories", f"{len(basis)} (ε = {basis.radius:g}, all training segments covered)"
    for each in result.certificates:
        yield (
            "bound on misses",
            f"{at_most(each.epsilon)} of {whose(each)}, {strength(each)}, by {each.method} "
            f"({counted(each.samples, each.noun)}, {each.uncovered:,} of them uncovered; "
            f"{counted(each.vehicles, 'vehicle')}, {counted(each.scenes, 'scene group')})",
        )
        if each.prediction_epsilon is not None and each.paper_epsilon is not None:
            ours = "exact" if each.support is None else f"by {each.support} supporting {each.noun}s"
            yield (
                "  though a base covers them",
                f"{at_most(each.prediction_epsilon)} {ours}, {at_most(each.paper_epsilon)} by the paper's theorem",
            )
    if result.predictor.scale != 1:
        driven, found = result.predictor.certificate, result.driven
        yield (
            f"sets that are planned against: scale {driven.scale:.2g}",
            f"{proved(driven)}; observed {found.missed(driven.unit)}; {found.sized}",
        )
    unit = result.certificates[0].unit
    yield from set_facts(result.predictor.basis, evaluation, result.occupied, result.uncovered, unit)
    for stage, seconds in result.seconds.items():
        yield f"time for {stage}", f"{seconds:.1f} s"


def folds_table(folds: Sequence[Fold]) -> Table:
    """A line for each assignment of scene groups to sides, and their mean and range."""
    rows: list[Sequence[str]] = []
    rates: list[tuple[float, ...]] = []
    for each in folds:
        places = tuple(" ".join(map(str, groups)) for groups in (each.calibration, each.test))
        if each.certificate is None or each.evaluation is None:
            rows.append((*places, "refused"))
            continue
        found, bound = each.evaluation, each.certificate.epsilon
        own, windows = found.missed(each.certificate.unit), found.windows.value
        rates.append((bound, own.value, windows, found.size))
        rows.append((*places, at_most(bound), own.brief, percent(windows), found.sized))
    if rates:
        *shares, size = ((float(np.mean(each)), min(each), max(each)) for each in zip(*rates, strict=True))
        said = ("{} ({}–{})".format(*map(percent, each)) for each in shares)
        rows.append(("mean (range)", "", *said, "{:.1f} ({:.1f}–{:.1f})".format(*size)))
    columns = ("calibration", "test", "bound ε", "missed (95 %)", "windows", "set size")
    return columns_table("Scene groups in every role", columns, rows, "numbers of the scene groups of a side", first={})


def methods_table(compared: Sequence[Compared]) -> Table:
    """The bounds of every method, what happened on unseen samples, how large its sets are, and how long it took."""
    return columns_table(
        "Methods",
        ("method", "asked ε", "bound ε", "observed (95 %)", "set size", "s"),
        [(each.method.value, "" if each.target is None else f"{each.target:.3g}", *_found(each)) for each in compared],
        f"bounds hold with the confidence asked for, but {ON_AVERAGE} only on average over calibrations, without it; "
        f"{BY_ITSELF} each base by itself: a vehicle that drives several may be missed more often; "
        "set size: mean number of bases, or of m²",
        first={"no_wrap": True},
        no_wrap=True,
    )


def _found(each: Compared) -> tuple[str, ...]:
    if each.certificate is None or each.evaluation is None or each.missed is None:
        return ("refused",)
    return (
        f"{at_most(each.certificate.epsilon)}{signs(each.certificate):\u00a0<2}",
        each.missed.brief,
        each.evaluation.sized,
        f"{each.seconds:.2f}",
    )


def bases_table(studied: Sequence[StudiedBasis]) -> Table:
    """Bases of several ε, how they cover their segments, and how small any other could be."""
    columns = ("ε", "M", "M is at least", "for any bases", "covered", "farthest", "10 commonest", "s", "s for bounds")
    rows = [
        (
            f"{each.basis.radius:g}", str(len(each.basis)),
            str(each.among_segments), str(each.anywhere),
            percent(each.covered), f"{each.largest:.4f}", percent(each.cumulative[:10][-1]), f"{each.seconds:.1f}",
            f"{each.bound_seconds:.1f}",
        )
        for each in studied
    ]  # fmt: skip
    return columns_table("Bases", columns, rows)


def solved_table(found: Sequence[Row]) -> Table:
    """What came of planning problems, and why of those that are not solved."""
    rows: list[Sequence[str | Text]] = []
    for row in found:
        driven: list[str] = []
        if row["time"] is not None:
            gap = or_none(row["minimum_gap"], "{:.1f}")
            driven = [f"{row['time']:.1f}", f"{row['mean_speed']:.1f}", gap, f"{100 * row['share_unsafe']:.0f}"]
        name = row["scenario"] if row["problem"] is None else f"{row['scenario']} {row['problem']}"
        rows.append((Text(name), Text("solved" if row["solved"] else row["reason"]), *driven))
    solved = sum(row["solved"] for row in found)
    without = sum(row["time"] is not None and not row["checked"] for row in found)
    judged = f"{without} judged without the drivability checker, which is not installed or came to no end"
    caption = f"{solved} of {len(found)} solved, {judged if without else 'judged by the drivability checker'}"
    columns = ("problem", "outcome", "s", "m/s", "least gap, m", "unsafe, %")
    return columns_table("Planning problems", columns, rows, caption, first={})
