"""``coverdrive calibrations``: all methods of calibration side by side."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import TARGETS, Confidence, Folder, Unit, between, console, listed

if TYPE_CHECKING:
    from coverdrive.certificates.certificate import Unit as Bounded
    from coverdrive.certificates.comparison import Compared
    from coverdrive.results import Results


def calibrations(
    folder: Folder = Path("results"),
    /,
    *,
    epsilon: Annotated[
        tuple[float, ...],
        Parameter(
            consume_multiple=True,
            validator=between(0, 1),
            help="Bounds to prove on the share that is missed, between 0 and 1, as in `--epsilon 0.05 0.1`.",
            show_default=listed,
        ),
    ] = TARGETS,
    confidence: Confidence = None,
    unit: Unit = None,
) -> dict[str, Any]:
    """Compare all methods of calibration on the predictor in a results folder, on the scores that its fit has kept.

    For example:

    - of the predictor in `results/`: `coverdrive calibrations`
    - with bounds on windows: `coverdrive calibrations us101 --epsilon 0.1 --unit window`
    """
    with waiting():
        from coverdrive.reporting.report import draw_methods
        from coverdrive.reporting.tables.summaries import methods_table
        from coverdrive.results import Results
    results = Results(folder)
    compared = compare_and_save(results, epsilon, confidence, unit)
    console.print(methods_table(compared))
    for method in dict.fromkeys(each.method for each in compared):
        console.print(f"{method.value}: {method.help}", style="dim", highlight=False)
    for refused in (each for each in compared if each.refusal):
        asked = "" if refused.target is None else f" at ε = {refused.target:g}"
        console.print(f"• {refused.method.value}{asked}: {refused.refusal}")
    with waiting("drawing"):
        draw_methods(results.fitted)
    console.print(f"The comparison is in {folder}")
    return {"results": str(folder), "methods": [asdict(each) for each in compared]}


def compare_and_save(
    results: "Results",
    targets: Sequence[float] = TARGETS,
    confidence: float | None = None,
    unit: "Bounded | None" = None,
) -> "list[Compared]":
    """Compare all methods on the scores of a fit."""
    from coverdrive.prediction.fits.calibrations import certify

    with stages():
        compared = certify(results, targets, unit, confidence)  # pyright: ignore[reportArgumentType]  (cached properties)
        results.save_methods(compared)
    console.print(f"• All methods of calibration are compared in {results.folder / 'methods.csv'}")
    return compared
