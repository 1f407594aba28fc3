"""Numbers as they are written for readers."""

import re
from pathlib import Path

import coverdrive
from coverdrive.percentages import at_most, change, counted, interval, percent


def test_percentages_have_a_space_and_no_needless_zeros() -> None:
    assert [percent(share) for share in (0.1, 0.00286, 1.0, 0.0, 0.13583)] == [
        "10 %", "0.286 %", "100 %", "0 %", "13.6 %",
    ]  # fmt: skip
    assert percent(0.9999, 4) == "99.99 %" and percent(0.9998326) == "99.98 %"
    assert interval(0.0021, 0.028) == "0.21–2.8 %"
    assert interval(0.0, 1.0) == interval(7e-173, 1.0) == "0–100 %"
    assert interval(0.00219, 0.0362169) == "0.21–3.7 %"
    assert interval(2e-8, 1e-6) == "0.000002–0.0001 %"


def test_differences_have_a_sign_and_one_decimal_at_most() -> None:
    shares = (0.015, -0.4, 0.00449, 1.0, 0.0, -1e-17)
    assert [change(share) for share in shares] == ["+1.5 %", "-40 %", "+0.4 %", "+100 %", "+0 %", "+0 %"]


def test_bounds_from_above_are_rounded_up() -> None:
    assert [at_most(bound) for bound in (0.1, 0.144, 0.13583, 0.135831, 0.0012341, 0.002, 0.0, 1.0)] == [
        "10 %", "14.4 %", "13.59 %", "13.59 %", "0.1235 %", "0.2 %", "0 %", "100 %",
    ]  # fmt: skip
    assert at_most(0.07230000000000001, 3) == "7.23 %" and at_most(0.0723001, 3) == "7.24 %"


def test_one_is_no_plural_and_thousands_are_separated() -> None:
    assert [counted(number, "scene group") for number in (0, 1, 2, 1200)] == [
        "0 scene groups", "1 scene group", "2 scene groups", "1,200 scene groups",
    ]  # fmt: skip
    files = Path(coverdrive.__file__).parent.rglob("*.py")
    assert [each.name for each in files if re.search(r"[\"']s[\"'] \*", each.read_text("utf-8"))] == ["percentages.py"]


def test_nothing_writes_percentages_in_another_way() -> None:
    """As formats of Python do, without the space and with needless zeros."""
    files = Path(coverdrive.__file__).parent.rglob("*.py")
    assert [file.name for file in files if re.search(r":[+.\d]*%\}", file.read_text(encoding="utf-8"))] == []
