"""Tables 1 and 2 of the paper as curves: bounds and observed misses against N₂, observed against nominal ε."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from coverdrive.certificates.evaluation import Rate
from coverdrive.certificates.paper_tables import TABLE_1, PaperTables
from coverdrive.report import style

_METHODS = (
    ("per_base", "conformal per base", style.BLUE, "o"),
    ("pooled", "conformal pooled", style.GREEN, "s"),
    ("pac_per_base", "PAC per base", style.SKY, "^"),
    ("pac_pooled", "PAC pooled", style.PURPLE, "D"),
)


def paper_figure(tables: PaperTables) -> Figure:
    """Draw both tables of one network."""
    with style.style():
        figure = style.new_figure(11.5, 5.8)
        growth, conformal = figure.subplots(1, 2)
        _draw_growth(growth, tables)
        _draw_conformal(conformal, tables)
    return figure


def _draw_growth(axes: Axes, tables: PaperTables) -> None:
    rows = tables.table_1
    samples = [row.samples for row in rows]
    axes.plot(samples, [100 * row.theorem for row in rows], color=style.BLACK, linestyle="--", label="Theorem 1, 99 %")
    axes.plot(samples, [100 * row.exact for row in rows], color=style.BLUE, label="exact, 99 %")
    axes.plot(samples, [100 * row.family for row in rows], color=style.GREEN, label="family, 99 %")
    _draw_rates(axes, samples, [row.observed for row in rows], style.BLUE, "o", "observed on new vehicles")
    _draw_rates(axes, samples, [row.mixed for row in rows], style.ORANGE, "^", "observed, windows mixed")
    _draw_rates(axes, samples, [row.family_observed for row in rows], style.GREEN, "s", "observed, family")
    printed = [100 * observed for _, _, observed in TABLE_1]
    axes.plot(
        [size for size, _, _ in TABLE_1],
        printed,
        color=style.VERMILION,
        marker="x",
        linestyle=":",
        label="paper, observed",
    )
    axes.set(yscale="log", xlabel="calibration windows N₂", ylabel="missed windows [%]", title="Table 1")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_formatter("{x:,.0f}")
    axes.grid(True)
    axes.legend(fontsize=9, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.14))


def _draw_conformal(axes: Axes, tables: PaperTables) -> None:
    rows = tables.table_2
    nominal = [100 * row.nominal for row in rows]
    axes.plot(nominal, nominal, color=style.GREY, linestyle="--", label="observed = nominal")
    for name, label, colour, marker in _METHODS:
        shown = [(row.nominal, getattr(row, name).observed) for row in rows if getattr(row, name) is not None]
        _draw_rates(axes, [100 * each for each, _ in shown], [rate for _, rate in shown], colour, marker, label)
    printed = [100 * row.printed_observed for row in rows]
    axes.plot(nominal, printed, color=style.VERMILION, marker="x", linestyle=":", label="paper")
    axes.set(xscale="log", yscale="log", xlabel="nominal ε [%]", ylabel="observed ε [%]", title="Table 2")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(True)
    axes.legend(fontsize=9, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.14))


def _draw_rates(
    axes: Axes, places: Sequence[float], rates: Sequence[Rate], colour: str, marker: str, label: str
) -> None:
    """Observed rates with their intervals; rates of zero are left out of a logarithmic axis."""
    shown = [(place, rate) for place, rate in zip(places, rates, strict=True) if rate.count]
    axes.vlines(
        [place for place, _ in shown],
        [100 * rate.low for _, rate in shown],
        [100 * rate.high for _, rate in shown],
        color=colour,
        linewidth=0.8,
        alpha=0.7,
    )
    values = [100 * rate.value for _, rate in shown]
    axes.plot(
        [place for place, _ in shown],
        values,
        color=colour,
        marker=marker,
        markerfacecolor="white",
        linestyle="none",
        label=label if shown else f"{label}: none",
    )
