"""Numbers as they are written for readers."""

from coverdrive.numbers import interval, percent


def test_percentages_have_a_space_and_no_needless_zeros() -> None:
    assert [percent(share) for share in (0.1, 0.00286, 1.0, 0.0, 0.13583)] == [
        "10 %", "0.286 %", "100 %", "0 %", "13.6 %",
    ]  # fmt: skip
    assert percent(0.9999, 4) == "99.99 %"
    assert interval(0.0021, 0.028) == "0.21–2.8 %"
    assert interval(0.0, 1.0) == "0–100 %"
