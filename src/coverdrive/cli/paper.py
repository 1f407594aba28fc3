"""``coverdrive paper``: Tables 1 and 2 of the paper, recomputed and repeated."""

from pathlib import Path
from typing import Any

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import AS_USUAL, Config, Files, Out, Recordings, Seed, console, experiment_of


def paper(
    *,
    recording: Recordings = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    files: Files = AS_USUAL,
) -> dict[str, Any]:
    """Repeat Tables 1 and 2 of the paper, and print ours beside them.

    Table 1: how often a vehicle does what post-bloating does not predict, with the bound, for growing calibration sets.
    The bounds are recomputed, with the erratum: six of the seven printed ones hold with 90 % confidence, not 99 %.
    Table 2: the same for conformal regression, by nominal ε.

    Both are repeated on generated traffic with more segments than the paper has, and on the recordings, if any are
    given. All numbers are written to `paper/` in the results folder as CSV, the curves as PNG and PDF.

    For example:

    - on generated traffic: `coverdrive paper`
    - on recordings, too: `coverdrive paper --recording scenarios/ --out us101`
    """
    with waiting():
        from polars import DataFrame

        from coverdrive.files import write_stream
        from coverdrive.paper import shown as paper_tables
        from coverdrive.paper.shown import paper_figure
        from coverdrive.paper.tables import make_tables, paper_settings, table_1_bounds
        from coverdrive.prediction.fit import fit
        from coverdrive.reporting.plotting.drawing import save
    experiment = experiment_of(config, seed=seed, **files.settings_for(recording or []))
    experiment = experiment.model_copy(update={"prediction": paper_settings()})
    sources = {"generated": [], **({"recordings": recording} if recording else {})}
    titles = {"generated": "generated traffic", "recordings": "the recordings"}
    bounds = table_1_bounds()
    console.print(paper_tables.bounds_table(bounds))
    folder = out / "paper"
    frames = {"table_1_bounds": DataFrame(bounds)}
    figures = {}
    for name, paths in sources.items():
        with stages():
            result = fit(experiment.recordings(paths), experiment.prediction, experiment.seed)
            scored, tube = result.scored, result.predictor.tube
            tables = make_tables(scored.train, *scored.apart(experiment.seed), tube, experiment.seed)
        console.print(paper_tables.growth_table(tables, titles[name]))
        console.print(paper_tables.conformal_table(tables, titles[name]))
        frames |= {
            f"table_1_{name}": paper_tables.growth_frame(tables),
            f"table_2_{name}": paper_tables.conformal_frame(tables),
        }
        figures[name] = paper_figure(tables)
    experiment.save(folder / "config.toml")
    for name, frame in frames.items():
        write_stream(folder / f"{name}.csv", frame.write_csv)
    with waiting("drawing"):
        for name, figure in figures.items():
            save(figure, folder / f"tables_{name}")
    console.print(f"The tables are in {folder}")
    return {"results": str(folder), "tables": {name: frame.to_dicts() for name, frame in frames.items()}}
