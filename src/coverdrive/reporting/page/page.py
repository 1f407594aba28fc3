"""The page: its parts put into the template, with all scripts and styles inside."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from coverdrive.files import write_atomically
from coverdrive.prediction.learning.affordance import FEATURES
from coverdrive.progress import done, stage
from coverdrive.reporting.affordance_figure import affordance_figure
from coverdrive.reporting.contents import Contents
from coverdrive.reporting.drawing import inline_svg
from coverdrive.reporting.figure import to_json
from coverdrive.reporting.figures import figures_of
from coverdrive.reporting.page.replay import SLACK, STATUSES, replay_data
from coverdrive.reporting.page.study import ends
from coverdrive.reporting.page.summary import facts, heading, tiles, verdict
from coverdrive.reporting.page.trials import COLUMNS, LEAST_FIRST, trial_rows
from coverdrive.simulation.notable import NEAR_GAP, NEAR_TIME, NEARLY
from coverdrive.simulation.outcome import Kind

_TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Drawn:
    """One figure of the page."""

    caption: str
    json: Markup
    """as `figure.js` draws it"""


@dataclass(frozen=True)
class Replay:
    """One drive of the page."""

    trial: int
    label: str
    """what the list of drives says"""
    json: Markup
    """the drive, as `replay_data` packs it"""


def write_page(contents: Contents, path: Path) -> None:
    """Write the report as one HTML file that needs nothing else.

    Args:
        contents: what it shows.
        path: of the file.
    """
    text = page(contents)
    write_atomically(path, lambda file: file.write_text(text, encoding="utf-8"))


def page(contents: Contents) -> str:
    """The report as HTML."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    with stage("report"):
        replays = _replays(contents)
        drawn = {
            name: Drawn(figure.caption, _script_json(to_json(figure))) for name, figure in figures_of(contents).items()
        }
        return environment.get_template("page.html.jinja").render(
            asset=_asset,
            contents=contents,
            certificates=contents.certified.certificates,
            heading=heading(contents),
            verdict=verdict(contents),
            tiles=tiles(contents),
            facts=facts(contents),
            sketch=Markup(inline_svg(affordance_figure())),
            features=FEATURES,
            drawn=drawn,
            refused=[each for each in contents.compared if each.refusal],
            columns=[(label, "ascending" if name in LEAST_FIRST else "descending") for name, label, _ in COLUMNS],
            rows=trial_rows(contents),
            ends=ends(contents),
            near_gap=NEAR_GAP,
            near_time=NEAR_TIME,
            statuses=STATUSES,
            slack=SLACK,
            replays=replays,
            horizon=max((trace.horizon for trace in contents.traces.values()), default=0.0),
        )


def _replays(contents: Contents) -> list[Replay]:
    replays: list[Replay] = []
    for trial, trace in contents.traces.items():
        near = trace.outcome.kind is Kind.FINISHED and _was_near(contents, trial)
        data = {**replay_data(trial, trace, contents.constraints), "near": near}
        ended = trace.outcome.kind.value + ", near miss" * near
        label = f"trial {trial}: {int(trace.scene.valid[0].sum()) - 1} vehicles, {ended}"
        replays.append(Replay(trial, label, _script_json(data)))
        done(len(replays), len(contents.traces))
    return replays


def _was_near(contents: Contents, trial: int) -> bool:
    """Whether a trial without a collision was a near miss."""
    return contents.trials is not None and contents.trials.filter(NEARLY, pl.col("trial") == trial).height > 0


def _script_json(value: Any) -> Markup:
    """JSON that may stand inside a script element."""
    return Markup(json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"))


def _asset(name: str) -> Markup:
    """A style sheet or script of the package, as it is."""
    return Markup((_TEMPLATES / name).read_text(encoding="utf-8"))
