"""The page: its parts put into the template, with all scripts and styles inside."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import plotly.offline
import polars as pl
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from coverdrive.files import write_atomically
from coverdrive.prediction.learning.affordance import FEATURES
from coverdrive.report import style
from coverdrive.report.affordance_figure import affordance_figure
from coverdrive.report.contents import Contents
from coverdrive.report.page.basis import basis_plots
from coverdrive.report.page.calibration import calibration_plots
from coverdrive.report.page.plots import Plot
from coverdrive.report.page.replay import SLACK, STATUSES, replay_data
from coverdrive.report.page.study import ends, study_plots
from coverdrive.report.page.summary import facts, heading, tiles
from coverdrive.report.page.trials import COLUMNS, LEAST_FIRST, trial_rows
from coverdrive.simulation.notable import NEAR_GAP, NEAR_TIME, NEARLY
from coverdrive.simulation.outcome import Kind

_TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Replay:
    """One drive of the page."""

    trial: int
    label: str
    """what the list of drives says"""
    json: str
    """the drive, as `replay_data` packs it"""


def write_page(contents: Contents, path: Path, progress: Callable[[float], None] | None = None) -> None:
    """Write the report as one HTML file.

    Args:
        contents: what it shows.
        path: of the file.
        progress: called with the share that is done.
    """
    text = page(contents, progress)
    write_atomically(path, lambda file: file.write_text(text, encoding="utf-8"))


def page(contents: Contents, progress: Callable[[float], None] | None = None) -> str:
    """The report as HTML; arguments as in `write_page`."""
    report = progress or _ignore
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    replays: list[Replay] = []
    for trial, trace in contents.traces.items():
        near = trace.outcome.kind is Kind.FINISHED and _was_near(contents, trial)
        data = {**replay_data(trial, trace, contents.binding), "near": near}
        ended = trace.outcome.kind.value + ", near miss" * near
        label = f"trial {trial}: {int(trace.scene.valid[0].sum()) - 1} vehicles, {ended}"
        replays.append(Replay(trial, label, _script_json(data)))
        report(0.5 * len(replays) / len(contents.traces))
    html = environment.get_template("page.html.jinja").render(
        asset=_asset,
        plotly=Markup(plotly.offline.get_plotlyjs()),
        contents=contents,
        certificates=contents.certified.certificates,
        heading=heading(contents),
        tiles=tiles(contents),
        facts=facts(contents),
        sketch=Markup(style.inline_svg(affordance_figure())),
        features=FEATURES,
        basis_plots=basis_plots(contents.predictor.basis, contents.learned),
        calibration_plots=calibration_plots(contents.predictor, contents.learned, contents.compared),
        refused=[each for each in contents.compared if each.refusal],
        study_plots=_study_plots(contents),
        columns=[(label, "ascending" if name in LEAST_FIRST else "descending") for name, label, _ in COLUMNS],
        rows=trial_rows(contents),
        ends="" if contents.trials is None else ends(contents.trials),
        near_gap=NEAR_GAP,
        near_time=NEAR_TIME,
        statuses=STATUSES,
        slack=SLACK,
        replays=replays,
        horizon=max((trace.horizon for trace in contents.traces.values()), default=0.0),
        period=contents.period,
    )
    report(1.0)
    return html


def _was_near(contents: Contents, trial: int) -> bool:
    """Whether a trial without a collision was a near miss."""
    return contents.trials is not None and contents.trials.filter(NEARLY, pl.col("trial") == trial).height > 0


def _study_plots(contents: Contents) -> list[Plot]:
    return [] if contents.trials is None else study_plots(contents.trials, contents.period)


def _script_json(value: Any) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")


def _asset(name: str) -> Markup:
    """A style sheet or script of the package, as it is."""
    return Markup((_TEMPLATES / name).read_text(encoding="utf-8"))


def _ignore(share: float) -> None:
    """Report to nobody."""
