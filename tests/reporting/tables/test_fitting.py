"""Tables at any width: everything in them can be read, and no word is broken."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_fakes import printed
from rich.text import Text

from coverdrive.recordings.summary import Summary
from coverdrive.reporting.tables.fitting import FittingTable
from coverdrive.reporting.tables.summaries import recordings_table

CELLS = st.from_regex(r"[0-9a-z.%()–]{0,12}( [0-9a-z.%]{1,8}){0,3}", fullmatch=True)
WIDTHS = (20, 40, 60, 80, 120)


def words(text: str) -> set[str]:
    return set(re.sub(r"[─-╿]", " ", text).split())


def table_of(rows: list[list[str]], no_wrap: bool = False) -> FittingTable:
    table = FittingTable(title="Title")
    for number in range(len(rows[0])):
        table.add_column(f"head{number}", justify="right", no_wrap=no_wrap)
    for row in rows:
        table.add_row(*row)
    return table


@given(
    st.integers(1, 6).flatmap(
        lambda columns: st.lists(st.lists(CELLS, min_size=columns, max_size=columns), min_size=1, max_size=4)
    ),
    st.booleans(),
    st.sampled_from(WIDTHS),
)
def test_every_word_is_there(rows: list[list[str]], no_wrap: bool, width: int) -> None:
    text = printed(table_of(rows, no_wrap), width)
    assert "…" not in text
    assert words(" ".join(" ".join(row) for row in rows)) <= words(text) | words(text.replace(":", ""))
    assert all(len(line.rstrip()) <= width for line in text.splitlines())


def test_a_table_that_fits_is_a_table_and_another_one_a_list() -> None:
    rows = [["3", "1000", "12  (1.2%–2.3%)"], ["4", "1000", "7  (0.3%–1.4%)"]]
    assert "│" in printed(table_of(rows), 60)
    narrow = printed(table_of(rows), 20)
    assert "│" not in narrow and "head1: 1000" in narrow and narrow.splitlines()[0].strip() == "Title"


def test_the_same_table_is_printed_at_several_widths() -> None:
    table = table_of([["3", "1000", "12  (1.2%–2.3%)"]])
    wide = printed(table, 80)
    printed(table, 20)
    assert printed(table, 80) == wide


def test_columns_get_what_they_need() -> None:
    """At 30 columns, 13 of which are the frame, the second cell has to wrap and the first has room for its word."""
    table = table_of([["unbreakable", "a b c d e f g h i j"]])
    assert "unbreakable" in printed(table, 30)


def test_a_cell_that_begins_with_a_space_is_not_cut() -> None:
    assert "…" not in printed(table_of([["", "000000000", ""], ["000000000000 0", "", " 00000000"]]), 40)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", ["[red]a.csv", "a[/b].csv", ":car:.csv", "\udce4.csv", "a" * 100])
def test_names_are_no_markup(name: str, width: int) -> None:
    summary = Summary(name, (1, 2), 27, 0.5, 1000, 5, 11.8, 29.5, 0.1, {"[bold]rows": 7}, {"[red]format": name})
    text = printed(recordings_table([summary]), width)
    assert name in text.replace("\n", "").replace(" ", "") or name in text
    for part in ("27", "1,000", "11.8/29.5"):
        assert part in words(text)
    assert "[bold]rows" in text.replace("\n", "")


def test_texts_keep_their_style() -> None:
    table = FittingTable(show_header=False)
    table.add_column()
    table.add_column()
    table.add_row("what", Text("[dim]", style="red"))
    assert "[dim]" in printed(table, 40) and "[dim]" in printed(table, 8)
