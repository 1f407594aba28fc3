"""Summary tables for the terminal."""

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from coverdrive.certificates.comparison import Compared
from coverdrive.numbers import at_most
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.prediction.fit import Fit
from coverdrive.recordings.summary import Summary
from coverdrive.reporting.claim import BY_ITSELF, ON_AVERAGE, signs, strength, whose
from coverdrive.reporting.fitting import FittingTable


def recordings_table(summaries: Sequence[Summary]) -> Table:
    """What is in each recording, and in a line below it what had to be repaired."""
    table = FittingTable(title="Recordings", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    table.add_column("recording")
    for name in ("groups", "vehicles", "min", "rows", "lanes", "m/s"):
        table.add_column(name, justify="right", no_wrap=True)
    for summary in summaries:
        table.add_row(
            Text(summary.name),
            _range(summary.groups),
            str(summary.vehicles),
            f"{summary.minutes:.2f}",
            str(summary.rows),
            str(summary.lanes),
            f"{summary.mean_speed:.1f}/{summary.max_speed:.1f}",
        )
        for kind, count in summary.repairs.items():
            table.add_row(Text(f"  {count} {kind}", style="dim"))
    steps = ", ".join(sorted({f"{summary.dt:g} s" for summary in summaries}))
    table.caption = f"m/s: mean/max; time step {steps}"
    return table


def _range(numbers: tuple[int, ...]) -> str:
    """Numbers without gaps as first–last, else one by one."""
    first, last = numbers[0], numbers[-1]
    if last - first + 1 == len(numbers) > 1:
        return f"{first}–{last}"
    return ", ".join(map(str, numbers))


def fit_table(result: Fit) -> Table:
    """The predictor, its guarantee, and how it did on scenes that it never saw."""
    evaluation, basis = result.evaluation, result.predictor.basis
    table = _facts("Predictor")
    table.add_row("segments", f"{len(result.segments)} of {basis.horizon:g} s")
    table.add_row(
        "split by vehicle and scene",
        f"{len(result.split.train)} training, {len(result.split.calibration)} calibration, "
        f"{len(result.split.test)} test; {result.split.dropped} left out",
    )
    table.add_row("base trajectories", f"{len(basis)} (ε = {basis.radius:g}, all training segments covered)")
    for certificate in result.certificates:
        table.add_row(
            f"bound on missed {certificate.unit}s",
            f"{at_most(certificate.epsilon)} of {whose(certificate)}, {strength(certificate)}, by {certificate.method} "
            f"({certificate.samples} {certificate.unit}s, {certificate.uncovered} of them uncovered)",
        )
        if certificate.prediction_epsilon is not None and certificate.paper_epsilon is not None:
            ours = (
                "exact" if certificate.support is None else f"by {certificate.support} supporting {certificate.unit}s"
            )
            table.add_row(
                "  of those that a base covers",
                f"{at_most(certificate.prediction_epsilon)} {ours}, {at_most(certificate.paper_epsilon)} "
                "by the paper's theorem",
            )
    table.add_row("missed test windows", str(evaluation.windows))
    table.add_row("missed test vehicles", str(evaluation.vehicles))
    table.add_row(
        "  not predicted / outside the tube", f"{evaluation.not_predicted} / {evaluation.outside_tube} windows"
    )
    table.add_row("test windows that no base covers", str(result.uncovered))
    table.add_row(
        "set size on test windows",
        f"mean {evaluation.mean_set_size:.1f}, median {evaluation.median_set_size:g} of {len(basis)}",
    )
    if result.predictor.certificate.tubes == "per base":
        table.add_row("mean radius of their tubes", f"{evaluation.mean_tube:.3f}")
    for stage, seconds in result.seconds.items():
        table.add_row(f"time for {stage}", f"{seconds:.1f} s")
    return table


def methods_table(compared: Sequence[Compared]) -> Table:
    """The bounds of every method, what happened on unseen samples, how large its sets are, and how long it took."""
    table = FittingTable(title="Methods", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    table.add_column("method", no_wrap=True)
    for name in ("asked ε", "bound ε", "observed (95 %)", "set size", "s"):
        table.add_column(name, justify="right", no_wrap=True)
    for each in compared:
        asked = "" if each.target is None else f"{each.target:.3g}"
        if each.certificate is None or each.evaluation is None or each.missed is None:
            table.add_row(each.method.value, asked, "refused")
            continue
        missed, sizes = each.missed, each.evaluation
        table.add_row(
            each.method.value,
            asked,
            f"{at_most(each.certificate.epsilon)}{signs(each.certificate):\u00a0<2}",
            f"{missed.value:.2%} ({missed.low:.1%}–{missed.high:.1%})",
            f"{sizes.mean_set_size:.1f}, {sizes.median_set_size:g}",
            f"{each.seconds:.2f}",
        )
    table.caption = (
        f"bounds hold with the confidence asked for, but {ON_AVERAGE} only on average over calibrations, without it; "
        f"{BY_ITSELF} each base or group of bases by itself: a vehicle that drives several may be missed more often; "
        "set size: mean, median"
    )
    return table


def bases_table(studied: Sequence[StudiedBasis]) -> Table:
    """Bases of several ε, how they cover their segments, and how small any other could be."""
    table = FittingTable(title="Bases", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for name in (
        "ε",
        "M",
        "M is at least",
        "for any bases",
        "covered",
        "farthest",
        "10 commonest",
        "s",
        "s for bounds",
    ):
        table.add_column(name, justify="right")
    for each in studied:
        table.add_row(
            f"{each.basis.radius:g}",
            str(len(each.basis)),
            "" if each.among_segments is None else str(each.among_segments),
            str(each.anywhere),
            f"{each.covered:.2%}",
            f"{each.largest:.4f}",
            f"{each.cumulative[:10][-1]:.1%}",
            f"{each.seconds:.1f}",
            f"{each.bound_seconds:.1f}",
        )
    return table


def _facts(title: str) -> Table:
    table = FittingTable(title=title, show_header=False)
    table.add_column(style="dim")
    table.add_column()
    return table
