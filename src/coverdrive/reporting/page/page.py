"""The page: its parts put into the template, with all scripts and styles inside."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from coverdrive.percentages import counted
from coverdrive.prediction.learning.affordance import FEATURES
from coverdrive.progress import done, stage
from coverdrive.reporting.contents import Contents
from coverdrive.reporting.figures.affordance import affordance_figure
from coverdrive.reporting.figures.frontier import frontier_sketch
from coverdrive.reporting.figures.gallery import figures_of
from coverdrive.reporting.page.replay import MARKS, SEVERITY, SLACK, STATUSES, replay_data
from coverdrive.reporting.page.summary import ends, facts, heading, tiles, verdict
from coverdrive.reporting.page.trials import COLUMNS, LEAST_FIRST, trial_rows
from coverdrive.reporting.plotting.drawing import inline_svg
from coverdrive.reporting.plotting.figure import Figure, to_json
from coverdrive.reporting.tables.league import league_of
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.measures.notable import NEAR_GAP, NEAR_TIME, NEARLY

_TEMPLATES = Path(__file__).parent / "templates"


def page(contents: Contents) -> str:
    """The report as one HTML page that needs nothing else."""
    with stage("report"):
        certified = contents.certified
        return rendered(
            "page",
            figures_of(contents),
            contents=contents,
            league=None if contents.league is None else league_of(contents.league),
            certificates=list(dict.fromkeys((*certified.planned_against, *certified.certificates))),
            heading=heading(contents),
            verdict=verdict(contents),
            tiles=tiles(contents),
            facts=facts(contents),
            sketched=_sketched(contents),
            sketch=Markup(inline_svg(affordance_figure())),
            features=FEATURES,
            refused=[each for each in contents.compared if each.refusal],
            columns=[(label, "ascending" if name in LEAST_FIRST else "descending") for name, label, _ in COLUMNS],
            rows=trial_rows(contents),
            ends=ends(contents),
            near_gap=NEAR_GAP,
            near_time=NEAR_TIME,
            statuses=STATUSES,
            marks=MARKS,
            slack=SLACK,
            severity=SEVERITY,
            replays=_replays(contents),
            horizon=max((trace.horizon for trace in contents.traces.values()), default=0.0),
        )


def rendered(template: str, figures: Mapping[str, Figure], **parts: Any) -> str:
    """A page of a template with figures by their names, and whatever else is in it."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["unbroken"] = _unbroken
    return environment.get_template(f"{template}.html.jinja").render(
        asset=lambda name: Markup((_TEMPLATES / name).read_text(encoding="utf-8")),  # a style sheet or script
        drawn={name: {"caption": each.caption, "json": _script_json(to_json(each))} for name, each in figures.items()},
        **parts,
    )


def _sketched(contents: Contents) -> Markup | None:
    """The frontier beside the numbers, if the drives are such as were dialled, and one's own point is not alone."""
    if contents.dialled is None or contents.unlike or len(contents.dialled.frontier) < 2:
        return None
    return Markup(frontier_sketch(contents.dialled.frontier, contents.dialled.scale))


def _unbroken(text: str) -> str:
    """Words in which no line ends between a number and its unit."""
    return re.sub(r"(?<=\d) (?=%|m\b|m/s|km\b|s\b|min\b|h\b)", "\u00a0", text)


def _replays(contents: Contents) -> list[dict[str, Any]]:
    """Of every drive its trial, what the list of drives says, and its data."""
    near_misses = [] if contents.trials is None else contents.trials.filter(NEARLY)["trial"].to_list()
    replays: list[dict[str, Any]] = []
    for trial, trace in contents.traces.items():
        near = trace.outcome.kind is Kind.FINISHED and trial in near_misses
        data = {**replay_data(trial, trace, contents.problem), "near": near}
        vehicles, ended = int(trace.scene.valid[0].sum()) - 1, trace.outcome.kind.value + ", near miss" * near
        label = f"trial {trial}: {counted(vehicles, 'vehicle')}, {ended}"
        replays.append({"trial": trial, "label": label, "json": _script_json(data)})
        done(len(replays), len(contents.traces))
    return replays


def _script_json(value: Any) -> Markup:
    """JSON that may stand inside a script element."""
    return Markup(json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"))
