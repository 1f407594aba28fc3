"""Tables for terminals of any width: words and numbers are never cut, and never broken in two.

Every column is at least as wide as its longest word. Where not all of them have room, a table becomes a list: one line
for each value, with the head of its column before it.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.padding import Padding
from rich.segment import Segment
from rich.table import Column, Table
from rich.text import Text

_WIDE = 10_000
"""more than any table needs"""

_FOLDED = 16
"""least width of a column whose words may be broken, such as paths"""


class FittingTable(Table):
    """A table of texts that becomes a list where it does not fit; the first column names the row."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType | Segment]:
        """The table, or the list."""
        for column in self.columns:
            column.width = None
        ranges = [_range(console, column) for column in self.columns]
        wide = Measurement.get(console, console.options.update(width=_WIDE), self)
        room = options.max_width - (wide.maximum - sum(each.maximum for each in ranges))
        if room >= sum(each.minimum for each in ranges):
            for column, width in zip(self.columns, _widths(ranges, room), strict=True):
                column.width = width
            yield from super().__rich_console__(console, options)
        else:
            yield from self._as_list(console)

    def _as_list(self, console: Console) -> Iterator[RenderableType]:
        if self.title:
            yield _text(console, self.title, "table.title")
        rows = zip(*(list(column.cells) for column in self.columns), strict=True)
        for first, *others in rows:
            name = _text(console, first, "bold")
            if name.plain:
                yield name
            for column, cell in zip(self.columns[1:], others, strict=True):
                value = _text(console, cell)
                if value.plain:
                    head = _text(console, column.header, "dim") if self.show_header else Text()
                    yield Padding(Text(": " if head.plain else "").join([head, value]), (0, 0, 0, 2))
        if self.caption:
            yield _text(console, self.caption, "table.caption")


def facts_table(title: str, facts: Iterable[tuple[str, str]]) -> FittingTable:
    """A fact in each row, with its name before it."""
    table = FittingTable("", "", title=title, show_header=False)
    table.columns[0].style = "dim"
    for name, fact in facts:
        table.add_row(name, fact)
    return table


def columns_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str | Text]],
    caption: str | None = None,
    *,
    first: Mapping[str, Any] | None = None,
    no_wrap: bool = False,
    **look: Any,
) -> FittingTable:
    """A table of numbers, at the right of their columns; ``first`` has the options of a column of names before them."""
    look = {"box": SIMPLE_HEAD, "padding": (0, 1, 0, 0), "show_edge": False} | look
    table = FittingTable(title=title, caption=caption, **look)
    numbers = {"justify": "right", "no_wrap": no_wrap}
    for place, column in enumerate(columns):
        table.add_column(column, **(numbers if place or first is None else first))  # pyright: ignore[reportArgumentType]
    for row in rows:
        table.add_row(*row)
    return table


def or_none(value: float, form: str) -> str:
    """A number with its unit, such as a least gap, or "none" where it is infinite, as nobody was near."""
    return form.format(value) if math.isfinite(value) else "none"


def _range(console: Console, column: Column) -> Measurement:
    """The longest word, and the longest line, of a column."""
    texts = [_text(console, cell) for cell in (column.header, *column.cells)]
    ranges = [text.__rich_measure__(console, console.options) for text in texts]
    indents = [len(text.plain) - len(text.plain.lstrip()) for text in texts]  # which Rich keeps with the first word
    longest = max(each.maximum for each in ranges)
    word = min(longest, max(each.minimum + indent for each, indent in zip(ranges, indents, strict=True)))
    if column.overflow == "fold":
        word = min(word, _FOLDED)
    return Measurement(longest if column.no_wrap else word, longest)


def _widths(ranges: list[Measurement], room: int) -> list[int]:
    """What each column gets: its longest word, and of what is left as much as it needs, in equal shares."""
    widths = [each.minimum for each in ranges]
    left = room - sum(widths)
    needy = sorted(range(len(ranges)), key=lambda column: ranges[column].span)
    for number, column in enumerate(needy):
        more = min(ranges[column].span, left // (len(needy) - number))
        widths[column] += more
        left -= more
    return widths


def _text(console: Console, cell: RenderableType, style: str = "") -> Text:
    text = cell if isinstance(cell, Text) else console.render_str(str(cell))
    if style:
        text = text.copy()
        text.stylize_before(style)
    return text
