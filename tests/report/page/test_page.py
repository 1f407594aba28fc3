"""The page holds everything, and says what is missing and how to make it."""

import json
import re
from dataclasses import replace

import polars as pl
import pytest
from report_fakes import make_contents, make_stray

from coverdrive.report.page.page import page, write_page
from coverdrive.report.page.study import ends
from coverdrive.report.page.summary import heading
from coverdrive.report.page.trials import COLUMNS, trial_rows
from coverdrive.simulation.trial import measure


@pytest.fixture(scope="module")
def html() -> str:
    return page(make_contents())


def test_certificate_is_in_plain_view(html: str) -> None:
    certificate = make_contents().predictor.certificate
    (shown,) = re.findall(r'<blockquote class="certificate">\s*<p>(.*?)</p>', html, re.DOTALL)
    assert shown == certificate.sentence
    assert shown.startswith("With 99 % confidence, ") and "at most 14.4 % (" in shown


def test_nothing_is_fetched(html: str) -> None:
    outside_plotly = re.sub(r"<script>.*?</script>", "", html, flags=re.DOTALL)
    assert not re.search(r'(src|href)="(https?:)?//', outside_plotly)
    assert "@import" not in html.split("</style>")[0]


def test_names_are_escaped(html: str) -> None:
    assert "results &lt;1&gt;" in html
    assert "results <1>" not in html


def test_every_plot_is_valid_json_with_data(html: str) -> None:
    plots = dict(
        re.findall(r'<script type="application/json" data-plot="plot-([\w-]+)">(.*?)</script>', html, re.DOTALL)
    )
    assert {"basis", "methods", "scores-driven", "collisions", "planning", "speed", "gap"} <= set(plots)
    assert all(json.loads(text)["data"] for text in plots.values())


def test_trials_link_to_their_replays(html: str) -> None:
    assert re.findall(r'href="#replay-(\d+)"', html) == ["0", "7"]
    assert re.findall(r'id="replay-data-(\d+)"', html) == ["0", "7"]
    assert '<span class="mark collision">side</span> <small>(at fault: other; ' in html
    assert "unsafe plans" in html
    assert "too few vehicles" in html


def test_missing_parts_name_their_command(tmp_path) -> None:
    shares = []
    contents = replace(make_contents({}), trials=None, compared=[])
    write_page(contents, tmp_path / "new" / "report.html", shares.append)
    html = (tmp_path / "new" / "report.html").read_text(encoding="utf-8")
    assert "<code>coverdrive certify</code>" in html
    assert "<code>coverdrive study</code>" in html
    assert 'id="player"' not in html
    assert shares[-1] == 1.0


def test_the_heading_says_what_was_run() -> None:
    contents = make_contents()
    run = {**contents.run, "recordings": [{"name": f"generated {k}", "rows": 1, "fingerprint": ""} for k in (1, 2)]}
    assert heading(contents) == "coverdrive on made up, 2 closed-loop trials"
    assert heading(replace(contents, run=run)) == "coverdrive on generated traffic, 2 closed-loop trials"
    three = {"recordings": [{"name": name} for name in "abc"]}
    assert heading(replace(contents, run=three, trials=None)) == "coverdrive on 3 recordings"
    html = page(contents)
    assert "<h1>coverdrive on made up, 2 closed-loop trials</h1>" in html
    assert "driven in set-sampling traffic" in html


def test_ends_are_counted_by_cause_and_fault() -> None:
    trials = make_contents().trials
    assert trials is not None
    columns = {"share_unsafe": pl.Series([0.5, 0.2]), "time": pl.Series([20.0, 10.0])}
    assert ends(trials.with_columns(**columns)) == (
        "1 of 2 drives ended in a collision (planning failure: 1, prediction miss: 0). At fault: own car: 0, other "
        "vehicle: 1, nobody: 0. 1 was a near miss. 40 % of all plans were unsafe: nothing clear of the "
        "predicted paths was found."
    )
    calm = ends(trials.head(1).with_columns(share_unsafe=pl.lit(0.0)))
    assert calm.startswith("None of 1 drives ended in a collision. 1 was a near miss. 0 % of")


def test_the_table_of_trials_counts_missed_windows_and_vehicles() -> None:
    stray = make_stray(40)
    (row,) = trial_rows(make_contents({0: stray}))
    found = measure(stray, 0, 0)
    texts = {name: text for (name, _, _), (_, text) in zip(COLUMNS, row.numbers, strict=True)}
    assert found.prediction_misses > 0
    assert texts["prediction_misses"] == f"{found.prediction_misses} of {found.windows}"
    assert texts["vehicles_missed"] == "1 of 2"


def test_a_replay_that_ends_otherwise_is_said_to() -> None:
    contents = make_contents()
    swapped = {0: contents.traces[7], 7: contents.traces[0]}
    assert page(replace(contents, traces=swapped)).count("the replay ends otherwise") == 2
