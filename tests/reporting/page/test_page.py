"""The page holds everything, and says what is missing and how to make it."""

import json
import math
import re
from dataclasses import fields, replace
from pathlib import Path

import polars as pl
import pytest
from report_fakes import make_contents, make_dialled, make_stray
from simulation_fakes import fakes

from coverdrive.certificates.bounds import rate_limit
from coverdrive.certificates.drives import anytime_limit
from coverdrive.percentages import at_most
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.rules.manners import MannersSettings
from coverdrive.progress import heard_by
from coverdrive.reporting.contents import Fitted
from coverdrive.reporting.page.page import _script_json, page
from coverdrive.reporting.page.summary import ends, facts, heading, tiles, verdict
from coverdrive.reporting.page.trials import COLUMNS, trial_rows
from coverdrive.reporting.report import contents_of
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.roads.places import Place
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.studies.study import Study

IDLE = Kind.NOT_STARTED.value


@pytest.fixture(scope="module")
def html() -> str:
    return page(make_contents())


def test_certificate_is_in_plain_view(html: str) -> None:
    certificate = make_contents().predictor.certificate
    (shown,) = re.findall(r'<blockquote class="certificate">\s*<p>(.*?)</p>', html, re.DOTALL)
    assert shown == certificate.sentence
    assert shown.startswith("With 99 % confidence, ") and "at most 14.4 % (" in shown


def test_nothing_is_fetched(html: str) -> None:
    assert not re.search(r'(src|href)="(https?:)?//', html)
    assert set(re.findall(r"https?://[^ \"'<]*", html)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }
    assert "@import" not in html.split("</style>")[0]


def test_no_line_ends_between_a_number_and_its_unit(html: str) -> None:
    (title,) = re.findall("<h1>(.*?)</h1>", html)
    assert "99.5\u00a0% of 20-s drives like these" in title and "24.4\u00a0m/s" in title
    assert "2.4\u00a0s, 0.0576\u00a0km" in html


def test_names_are_escaped(html: str) -> None:
    assert "results &lt;1&gt;" in html
    assert "results <1>" not in html


def test_names_cannot_end_a_script() -> None:
    contents = make_contents()
    evil = "</script><script>alert(1)</script>"
    run = {**contents.run, "recordings": [{"name": evil, "rows": 1, "fingerprint": evil}]}
    compared = [replace(contents.compared[1], refusal=evil)]
    text = page(replace(contents, name=evil, run=run, settings=evil, traffic=evil, compared=compared))
    assert "alert(1)</script>" not in text and "&lt;script&gt;alert(1)" in text
    assert "<" not in _script_json({"name": evil, "deep": [evil]})


def test_every_figure_is_valid_json_with_marks(html: str) -> None:
    figures = dict(re.findall(r'id="figure-(\w+)".*?<script type="application/json">(.*?)</script>', html, re.DOTALL))
    assert set(figures) == {
        "areas", "basis", "methods", "scores", "set_sizes", "losses", "collisions", "drives", "planning"
    }  # fmt: skip
    for text in figures.values():
        panels = [panel for row in json.loads(text)["rows"] for panel in row["panels"]]
        assert panels and all(panel["marks"] for panel in panels)


def test_replay_and_verdict_come_first(html: str) -> None:
    sections = re.findall(r'<section id="(\w+)">', html)
    assert sections == ["summary", "replay", "certificate", "study", "calibration", "settings"]
    assert html.index("<h1>") < html.index('class="tiles"') < html.index('id="read-worst"') < html.index("<blockquote")


def test_the_verdict_is_one_sentence_of_the_sets_without_drives() -> None:
    assert verdict(replace(make_contents(), trials=None)) == (
        "Of vehicles at most 14.4 % are missed by their predicted sets (with 99 % confidence), and 4 % were on scenes "
        "that did not train the predictor."
    )


def test_the_verdict_is_what_the_drives_prove() -> None:
    assert verdict(make_contents()) == f"{make_contents().proved}; 24.4 m/s on average."


def test_what_is_proved_depends_on_whether_the_number_of_drives_was_fixed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    contents, study = make_contents(), Study(fakes(), tmp_path)
    fitted = Fitted(**{each.name: getattr(contents, each.name) for each in fields(Fitted)})
    for trials, bound in ((1, rate_limit(0.99, 0, 1)), (2, anytime_limit(0, 2, 0.99))):
        found = contents_of(fitted, study.run(trials), [])
        assert found.proved.startswith(f"With 99 % confidence at most {at_most(bound)} of ")
        assert found.proved.endswith(f" drives like these touch anybody (0 of {trials})")
    monkeypatch.setattr(Setup, "replays", True)
    said = "0 of 2 drives touched anybody, which proves nothing of scenes other than those replayed"
    assert contents_of(fitted, study, []).proved == said


def test_the_verdict_is_what_was_dialled_with_the_speed_of_knowing_the_future() -> None:
    contents, lines = make_contents(), pl.DataFrame({"who": ["default", "known-future"], "mean_speed": [34.0, 35.5]})
    dialled = replace(make_dialled(), frontier=lines)
    said = "With 99 % confidence at most 0.2 % of 20-s drives like these touch anybody (0 of 2,301); 34.5 m/s"
    assert verdict(replace(contents, dialled=dialled)) == f"{said}, 97 % of knowing the future."
    alone = replace(dialled, frontier=lines.head(1))
    assert verdict(replace(contents, dialled=alone)) == f"{said}."
    others = replace(contents, dialled=dialled, unlike="These drives are others than those that were proved: traffic")
    assert verdict(others) == verdict(contents) != said


def test_the_frontier_of_such_drives_stands_beside_the_numbers() -> None:
    dialled = replace(make_contents(), dialled=make_dialled())
    assert 'class="tile sketched" href="#dial"' in page(dialled)
    assert "tile sketched" not in page(replace(dialled, unlike="These are others"))


def test_the_numbers_say_how_close_it_was_and_how_mannered() -> None:
    contents = make_contents()
    near, headway, jerk, plans, _ = tiles(contents)
    assert near.value == "1 of 2" and near.main and near.note.endswith("2.4 s, 0.0576 km")
    assert near.note.startswith(f"least gap {contents.trials['minimum_gap'].min():.2f} m, least time to collision ")
    assert (headway.value, headway.note) == (f"{contents.trials['usual_headway'].median():.2f} s", "")
    behind = "; of those behind up to 0.0 in half of the drives, at least 0.0 in 1 of 20"
    assert jerk.note.startswith("hardest braking") and jerk.note.endswith(behind)
    nobody = contents.trials.with_columns(minimum_time_to_collision=pl.lit(float("inf")))
    assert "least time to collision –; " in tiles(replace(contents, trials=nobody))[0].note
    people = contents.run | {"recorded_near_misses": {"share": 0.237, "seconds": 5.9}}
    near = tiles(replace(contents, run=people))[0].note
    assert near.endswith("0.0576 km; 24 % of recorded vehicles came as near in 6 s each")
    unknown = contents.trials.with_columns(hardest_braking_behind=pl.lit(None, pl.Float64()))
    for other in (replace(contents, replayed=True), replace(contents, trials=unknown)):
        assert tiles(other)[2].note == jerk.note.removesuffix(behind)
    assert plans.label.startswith("of 24 plans clear")
    left = {"vehicles_missed": 3, "vehicles_seen": 4, "shares_missed": 1.0}
    counted = replace(contents, trials=contents.trials.with_columns(**left))
    sets = tiles(counted)[-1]
    assert sets.value == "75 %" and sets.label.startswith("of the others left their sets here: less is better (95 %: ")
    assert ", not this: ≤ 14.4 %" in sets.note and sets.note.endswith(
        "4 % on scenes that did not train the predictor (95 %: 1–10 %)"
    )
    sets = tiles(replace(counted, replayed=True))[-1]
    assert sets.label.endswith("less is better (replays of recorded scenes depend on each other: no interval)")
    assert sets.value == "75 %" and "not this" not in sets.note
    generated = contents.run | {"recordings": [{"name": "generated 1"}]}
    assert "not this" in tiles(replace(counted, replayed=True, run=generated))[-1].note
    shares = replace(contents.certified.driven[0], unit="share")
    by_share = replace(contents.certified, driven=(shares, contents.certified.driven[1]))
    sets = tiles(replace(counted, certified=by_share))[-1]
    assert sets.value == "25 %" and sets.label.startswith("of what others do in ")
    unseen = replace(contents, trials=contents.trials.with_columns(vehicles_missed=0, vehicles_seen=0))
    assert tiles(unseen)[-1].value == "–"  # not 0 %, which would be good
    assert len(tiles(replace(contents, trials=None))) == 2


def test_what_recorded_drivers_keep_is_what_was_recorded(tmp_path: Path) -> None:
    """Not what the planner is told to keep, nor what people keep elsewhere, where nobody was recorded."""
    contents, told = make_contents(), MpcPlanner(PlannerSettings(manners=MannersSettings(headway=2.5)))
    fitted = Fitted(**{each.name: getattr(contents, each.name) for each in fields(Fitted)})
    study = Study(fakes(told), tmp_path)
    like = contents.run | {"recorded_place": Place(manners=MannersSettings(headway=1.54)).model_dump(mode="json")}
    for run, said in ((contents.run, ""), (like, "recorded drivers: 1.54 s")):
        found = replace(contents_of(replace(fitted, run=run), study, []), trials=contents.trials)
        assert tiles(found)[1].note == said


def test_replays_are_counted_without_intervals() -> None:
    contents = make_contents()
    trials = contents.trials.with_columns(windows_cut_in=pl.lit(10), misses_cut_in=pl.lit(5))
    replays = replace(contents, trials=trials, replayed=True)
    (missed,) = (fact for name, fact in facts(replays) if name.startswith("missed in drives: ") and "10 of 20" in fact)
    assert missed == "50 % (10 of 20)"
    html = page(replays)
    for part in ("less is better", "the rate as a mark"):
        assert f"{part} (replays of recorded scenes depend on each other: no interval)" in html


def test_trials_that_could_not_start_are_rows_and_counted_apart() -> None:
    contents = make_contents()
    idle = dict.fromkeys(contents.trials.columns) | {"trial": 8, "vehicles": 9, "kind": IDLE, "reason": "no room"}
    more = pl.concat([contents.trials, pl.DataFrame([idle], schema=contents.trials.schema)])
    some = replace(contents, trials=more)
    assert ends(some).startswith("1 of 2 drives (2.4 s, 0.0576 km) ended") and "1 more could not start" in ends(some)
    row = trial_rows(some)[-1]
    assert (row.kind, row.mark, row.remark, row.replay) == (IDLE, "", "no room", False)
    assert {text for _, text in row.numbers[1:]} == {"–"} and all(math.isnan(value) for value, _ in row.numbers[1:])
    text = page(some)
    assert IDLE in text and 'id="figure-collisions"' in text
    none = replace(contents, trials=more.tail(1), traces={})
    assert ends(none).startswith("None of the 1 trials could start")
    text = page(none)
    assert "could start" in verdict(none) and 'id="figure-collisions"' not in text and 'id="player"' not in text


def test_trials_link_to_their_replays(html: str) -> None:
    assert re.findall(r'href="#replay-(\d+)"', html) == ["0", "7"]
    assert re.findall(r'id="replay-data-(\d+)"', html) == ["0", "7"]
    assert '<span class="mark collision">side</span> <small>(at fault: other; ' in html
    assert "unsafe plans" in html
    assert "too few vehicles" in html


def test_missing_parts_name_their_command() -> None:
    told = []
    with heard_by(lambda stage, share: told.append((stage, share))):
        html = page(replace(make_contents({}), trials=None, compared=[]))
    assert "<code>coverdrive calibrations</code>" in html
    assert "<code>coverdrive study</code>" in html
    assert 'id="player"' not in html
    assert told[-1] == ("report", 1.0)


def test_the_heading_says_what_was_run() -> None:
    contents = make_contents()
    run = {**contents.run, "recordings": [{"name": f"generated {k}", "rows": 1, "fingerprint": ""} for k in (1, 2)]}
    assert heading(contents) == "coverdrive on made up, 2 closed-loop trials"
    assert heading(replace(contents, run=run)) == "coverdrive on generated traffic, 2 closed-loop trials"
    three = {"recordings": [{"name": name} for name in "abc"]}
    assert heading(replace(contents, run=three, trials=None)) == "coverdrive on 3 recordings"
    html = page(contents)
    assert "coverdrive on made up, 2 closed-loop trials, traffic “set-sampling”; “results &lt;1&gt;”" in html
    assert html.count("Driven on a road of its own.") == 2  # beside the drives, and in the list of facts


def test_ends_are_counted_by_cause_and_fault() -> None:
    contents = make_contents()
    columns = {"share_unsafe": pl.Series([0.5, 0.2]), "time": pl.Series([20.0, 10.0])}
    assert ends(replace(contents, trials=contents.trials.with_columns(**columns))) == (
        "1 of 2 drives (30.0 s, 0.0576 km) ended in a collision (planning failure: 1, prediction miss: 0, hopeless "
        "start: 0). At fault: ego: 0, other vehicle: 1, nobody: 0. 1 was a near miss. 40 % of all plans were unsafe "
        "(nothing clear of the predicted paths was found)."
    )
    calm = ends(replace(contents, trials=contents.trials.head(1).with_columns(share_unsafe=pl.lit(0.0))))
    assert calm.startswith("None of 1 drives (1.2 s, 0.0288 km) ended in a collision. 1 was a near miss. 0 % of")
    assert ends(replace(contents, trials=None)) == ""


def test_the_table_of_trials_counts_missed_windows_and_vehicles() -> None:
    stray = make_stray(40)
    (row,) = trial_rows(make_contents({0: stray}))
    found = measure(stray, 0, 0)
    texts = {name: text for (name, _, _), (_, text) in zip(COLUMNS, row.numbers, strict=True)}
    assert found["prediction_misses"] > 0
    assert texts["prediction_misses"] == "{prediction_misses} of {windows}".format(**found)
    assert texts["vehicles_missed"] == "1 of 2"


def test_one_unsafe_plan_of_a_drive_is_not_none() -> None:
    """Of 20 s, with a plan every 0.1 s."""
    contents = make_contents()
    (row, _) = trial_rows(replace(contents, trials=contents.trials.with_columns(share_unsafe=1 / 200)))
    assert row.numbers[[name for name, *_ in COLUMNS].index("share_unsafe")] == (0.005, "0.5 %")


def test_a_replay_that_ends_otherwise_is_said_to() -> None:
    contents = make_contents()
    swapped = {0: contents.traces[7], 7: contents.traces[0]}
    assert page(replace(contents, traces=swapped)).count("the replay ends otherwise") == 2
