"""Numbers as they are written for readers."""

import pytest

from coverdrive.report.numbers import interval, percent, readable


def test_percentages_have_a_space_and_no_needless_zeros() -> None:
    assert [percent(share) for share in (0.1, 0.00286, 1.0, 0.0, 0.13583)] == [
        "10 %", "0.286 %", "100 %", "0 %", "13.6 %",
    ]  # fmt: skip
    assert percent(0.9999, 4) == "99.99 %"
    assert interval(0.0021, 0.028) == "0.21–2.8 %"
    assert interval(0.0, 1.0) == "0–100 %"


@pytest.mark.parametrize(
    ("made", "written"),
    [
        ("With confidence 0.99, at most 10.000% (post-bloating)", "With 99 % confidence, at most 10 % (post-bloating)"),
        ("0.500% (5 of 1000; 95 % 0.163%–1.163%)", "0.5 % (5 of 1000; 95 % 0.163 %–1.163 %)"),
        ("without confidence: 3 bases", "without confidence: 3 bases"),
    ],
)
def test_sentences_made_elsewhere_are_written_alike(made: str, written: str) -> None:
    assert readable(made) == written
