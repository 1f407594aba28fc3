"""``coverdrive certify``: all methods of calibration side by side."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import (
    TARGETS,
    Config,
    Location,
    Out,
    Recordings,
    config_of,
    console,
    experiment_of,
    usually,
)

Counted = Literal["window", "vehicle", "drawn window"]


def certify(
    *,
    recording: Recordings = None,
    epsilon: Annotated[tuple[float, ...], Parameter(help="Bound on the miss rate to ask for.")] = TARGETS,
    unit: Annotated[Counted | None, Parameter(help="What the bound counts.", show_default=usually("vehicle"))] = None,
    out: Out = Path("results"),
    config: Config = None,
    location: Location = None,
) -> dict[str, Any]:
    """Compare all methods of calibration on the predictor in a results folder, on the recordings that made it.

    For example:

    - for a predictor from generated traffic, in `results/`: `coverdrive certify`
    - for one from recordings: `coverdrive certify --recording scenarios/ --epsilon 0.1 --unit window`
    """
    experiment = experiment_of(config_of(out, config), None, location)
    with waiting():
        from coverdrive import workflow
        from coverdrive.report import style
        from coverdrive.report.risk_figure import risk_figure
        from coverdrive.report.terminal import methods_table
        from coverdrive.results import load_predictor
    predictor = load_predictor(out)
    with stages() as bars:
        recordings = workflow.load_recordings(experiment, recording or [])
        sides = workflow.scores_of(experiment, predictor, recordings, bars.report)
        compared = workflow.compare_methods(experiment, predictor, sides, epsilon, unit, bars.report)
    workflow.save_comparison(compared, predictor, out)
    console.print(methods_table(compared))
    for method in dict.fromkeys(each.method for each in compared):
        console.print(f"{method.value}: {method.help}", style="dim", highlight=False)
    for refused in (each for each in compared if each.refusal):
        asked = "" if refused.target is None else f" at ε = {refused.target:g}"
        console.print(f"• {refused.method.value}{asked}: {refused.refusal}")
    with waiting("drawing"):
        style.save(risk_figure(compared), out / "figures" / "methods")
    console.print(f"The comparison is in {out}")
    return {"results": str(out), "methods": [asdict(each) for each in compared]}
