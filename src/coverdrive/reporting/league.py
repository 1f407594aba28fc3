"""The league as a person looks at it: the figure of risk against progress, and a page that needs no network."""

from pathlib import Path

import polars as pl

from coverdrive.files import write_atomically
from coverdrive.reporting.figures.league import league_figure
from coverdrive.reporting.page.page import rendered
from coverdrive.reporting.plotting.drawing import save
from coverdrive.reporting.tables.league import league_of


def write_league(table: pl.DataFrame, folder: Path) -> None:
    """Write ``league.html`` and the figure, as PNG and PDF, of a table of `coverdrive.league.table` into a folder."""
    figure = league_figure(table)
    if figure:
        save(figure, folder / "league")
    figures = {"league": figure} if figure else {}
    text = rendered("league-page", figures, league=league_of(table))
    write_atomically(folder / "league.html", lambda file: file.write_text(text, encoding="utf-8"))
