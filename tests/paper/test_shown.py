"""Tables and figure of the paper's experiments."""

import io

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.paper.shown import (
    bounds_table,
    conformal_frame,
    conformal_table,
    growth_frame,
    growth_table,
    paper_figure,
)
from coverdrive.paper.tables import PaperTables, make_tables, table_1_bounds
from coverdrive.reporting.plotting.drawing import save


def drawn(count: int, seed: int, first: int) -> ScoredSamples:
    random = np.random.default_rng(seed)
    return ScoredSamples(
        random.random((count, 3)), random.integers(0, 3, count), np.zeros(count), first + np.arange(count)
    )


@pytest.fixture(scope="module")
def tables() -> PaperTables:
    return make_tables(drawn(500, 0, 0), drawn(800, 1, 1000), drawn(2000, 2, 5000), 0.5)


def printed(table: Table) -> str:
    stream = io.StringIO()
    Console(file=stream, width=80).print(table)
    return stream.getvalue()


def test_erratum_and_bounds_are_printed() -> None:
    text = printed(bounds_table(table_1_bounds()))
    assert "Erratum" in text and "0.1278" in text and "0.1035" in text and "0.103 " in text


def test_tables_fit_a_terminal_of_80_columns(tables: PaperTables) -> None:
    for text in (printed(growth_table(tables, "generated traffic")), printed(conformal_table(tables, "recordings"))):
        assert "…" not in text
    assert f"{100 * tables.table_1[-1].exact:.3f}" in printed(growth_table(tables, "anything"))
    assert "–" in printed(conformal_table(tables, "anything"))


def test_frames_hold_all_numbers(tables: PaperTables) -> None:
    growth = growth_frame(tables)
    assert growth.height == len(table_1_bounds()) == 7
    assert growth["paper_samples"].to_list()[0] == 15946
    assert growth["observed"].to_list() == [row.observed.value for row in tables.table_1]
    conformal = conformal_frame(tables)
    kept = [row for row in tables.table_2 if row.pac_pooled is not None]
    assert conformal["method"].to_list().count("pac_pooled") == len(kept) < 7
    assert conformal["method"].to_list().count("paper") == 7


def test_figure_draws_both_tables(tables: PaperTables, tmp_path) -> None:
    figure = paper_figure(tables)
    growth, conformal = figure.panels
    marks = {mark.name: mark for mark in growth.marks}
    assert set(marks) >= {"exact, 99 %", "paper, observed", "family, 99 %"}
    assert list(marks["exact, 99 %"].y) == pytest.approx([100 * row.exact for row in tables.table_1])
    assert conformal.x.label == "nominal ε [%]"
    png, pdf = save(figure, tmp_path / "tables")
    assert png.stat().st_size > 10_000 and pdf.read_bytes().startswith(b"%PDF")
