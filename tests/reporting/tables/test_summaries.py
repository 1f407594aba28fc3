"""Summary tables: what they say, and that they fit a terminal of 80 columns."""

from report_fakes import printed

from coverdrive.recordings.summary import Summary
from coverdrive.reporting.tables.summaries import recordings_table


def summary(groups: tuple[int, ...], repairs: dict[str, int]) -> Summary:
    notes = {"lanes": "from lane numbers"}
    return Summary("us101_300_vehicles period 1", groups, 235, 15.6, 125_758, 5, 11.8, 29.5, 0.1, repairs, notes)


def test_recordings() -> None:
    text = printed(recordings_table([summary((2, 3, 4), {"duplicated rows": 7}), summary((1, 5), {})]))
    for part in ("us101_300_vehicles period 1", "2–4", "1, 5", "125758", "11.8/29.5", "7 duplicated rows", "0.1 s"):
        assert part in text
    assert "…" not in text
