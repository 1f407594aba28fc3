"""``coverdrive certify``: all methods of calibration side by side."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from coverdrive.cli.options import Config, Location, Out, Recordings, config_of, console, experiment_of
from coverdrive.progress import stages

Counted = Literal["window", "vehicle", "drawn window"]


def certify(
    *,
    recording: Recordings = None,
    epsilon: Annotated[tuple[float, ...], Parameter(help="Bound on the miss rate to ask for.")] = (0.05, 0.1, 0.2),
    unit: Annotated[Counted | None, Parameter(help="What the bound counts; else that of the settings.")] = None,
    out: Out = Path("results"),
    config: Config = None,
    location: Location = None,
) -> dict[str, Any]:
    """Compare all methods of calibration on the predictor in a results folder, on the recordings that made it."""
    from coverdrive import workflow
    from coverdrive.report import style
    from coverdrive.report.risk_figure import risk_figure
    from coverdrive.report.terminal import methods_table
    from coverdrive.results import load_predictor

    experiment = experiment_of(config_of(out, config), None, location)
    predictor = load_predictor(out)
    with stages() as bars:
        recordings = workflow.load_recordings(experiment, recording or [], bars.share("recordings"))
        compared = workflow.compare_methods(experiment, predictor, recordings, epsilon, unit, bars.report)
    workflow.save_comparison(compared, predictor, out)
    console.print(methods_table(compared))
    for method in dict.fromkeys(each.method for each in compared):
        console.print(f"{method.value}: {method.help}", style="dim", highlight=False)
    for refused in (each for each in compared if each.refusal):
        asked = "" if refused.target is None else f" at ε = {refused.target:g}"
        console.print(f"• {refused.method.value}{asked}: {refused.refusal}")
    style.save(risk_figure(compared), out / "figures" / "methods")
    console.print(f"The comparison is in {out}")
    return {"results": str(out), "methods": [asdict(each) for each in compared]}
