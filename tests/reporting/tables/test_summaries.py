"""Summary tables: what they say, and that they fit a terminal of 80 columns."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from report_fakes import make_contents, printed

from coverdrive.prediction.fit import Fit
from coverdrive.recordings.summary import Summary
from coverdrive.reporting.tables.summaries import fit_table, recordings_table, solved_table


def summary(groups: tuple[int, ...], repairs: dict[str, int]) -> Summary:
    notes = {"lanes": "from lane numbers"}
    return Summary("us101_300_vehicles period 1", groups, 235, 15.6, 125_758, 5, 11.8, 29.5, 0.1, repairs, notes)


def test_recordings() -> None:
    text = printed(recordings_table([summary((2, 3, 4), {"duplicated rows": 7}), summary((1, 5), {})]))
    for part in ("us101_300_vehicles period 1", "2–4", "1, 5", "125,758", "11.8/29.5", "7 duplicated rows", "0.1 s"):
        assert part in text
    assert "…" not in text


@pytest.mark.parametrize(
    ("scenes", "said"), [(1, "; 9 vehicles, 1 scene group)"), (2, "; 9 vehicles, 2 scene groups)")]
)
def test_a_fit_counts_its_scene_groups(scenes: int, said: str) -> None:
    contents = make_contents()
    certified, nothing = contents.certified, SimpleNamespace(train=(), calibration=(), test=(), dropped=0)
    more = {"vehicles": 9, "scenes": scenes, "prediction_epsilon": 0.02, "paper_epsilon": 0.03}
    certificates = tuple(replace(each, **more) for each in certified.certificates)
    fit = Mock(
        spec=Fit, evaluation=certified.evaluation, predictor=contents.predictor, split=nothing, seconds={},
        segments=range(98_776),
        certificates=certificates, occupied=certified.occupied, uncovered=certified.uncovered,
    )  # fmt: skip
    text = printed(fit_table(fit), 300)
    assert said in text and "98,776 of 3 s" in text
    assert "though a base covers them" in text  # as a share of all: of those alone it is more


def test_the_gap_of_a_drive_on_which_nobody_was_is_none() -> None:
    row = {"scenario": "ZAM-1", "problem": 7, "solved": True, "reason": "", "checked": True, "time": 4.0}
    text = printed(solved_table([row | {"mean_speed": 21.5, "minimum_gap": float("inf"), "share_unsafe": 0.25}]))
    assert "4.0 21.5 none 25" in " ".join(text.split()) and "inf" not in text
