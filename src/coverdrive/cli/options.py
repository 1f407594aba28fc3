"""What several commands take, and what they make of it."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter
from rich.console import Console

from coverdrive.cli.bars import waiting

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.simulation.replay import Clip

console = Console()

TARGETS = (0.05, 0.1, 0.2)
"""bounds ε on the miss rate at which methods of calibration are compared"""


def usually(value: str) -> Callable[[Any], str]:
    """What the help says of an option whose default is in the settings, which are slow to load."""
    return lambda _: f"{value} unless the settings differ"


Recordings = Annotated[
    list[Path] | None,
    Parameter(
        name="--recording",
        consume_multiple=True,
        help="Files or folders: NGSIM CSV or text, CommonRoad XML, Parquet. Without any, traffic is generated.",
    ),
]
ToReplay = Annotated[
    list[Path] | None,
    Parameter(
        name="--recording",
        consume_multiple=True,
        help="Only with --traffic replay: files or folders to replay. Without any, the generated traffic is replayed.",
    ),
]
Config = Annotated[Path | None, Parameter(help="TOML file with the settings that differ from the defaults.")]
Preset = Annotated[
    Literal["default", "paper"],
    Parameter(
        help="What holds where the TOML file says nothing: our defaults, or the paper's network and certificate."
    ),
]
Seed = Annotated[
    int | None,
    Parameter(
        help="Seed of every random choice; the same seed gives the same result.",
        show_default=usually("0"),
    ),
]
Out = Annotated[Path, Parameter(help="Results folder.")]
Folder = Annotated[Path, Parameter(help="Results folder.")]
Trials = Annotated[
    int | None, Parameter(help="Number of closed-loop trials; the paper has 1000.", show_default=usually("20"))
]
Workers = Annotated[
    int | None, Parameter(help="Number of processes; 0: one for each processor.", show_default=usually("0"))
]
TrafficName = Annotated[
    Literal["set-sampling", "drivers", "aggressive", "mixed", "replay"] | None,
    Parameter(
        name="--traffic",
        help="Uncontrolled vehicles: of the paper (set-sampling), IDM and MOBIL drivers, aggressive ones, a mixture, "
        "or recorded ones that do not react (replay).",
        show_default=usually("set-sampling"),
    ),
]
Studied = Annotated[
    Literal["set-sampling", "drivers", "aggressive", "mixed", "replay"] | None,
    Parameter(name="--traffic", help="Traffic of the study to show; else that of the results folder's settings."),
]
Replayed = Annotated[
    list[Path] | None,
    Parameter(
        name="--recording",
        consume_multiple=True,
        help="Recordings that the study replayed; needed if drives in replayed traffic are not stored yet.",
    ),
]
Vehicles = Annotated[
    list[int] | None,
    Parameter(
        consume_multiple=True,
        help="Numbers of uncontrolled vehicles, taken in turn by the trials.",
        show_default=usually("3 4 5 6 7, as in the paper,"),
    ),
]
Location = Annotated[str | None, Parameter(help="Site to take from an NGSIM file that holds several.")]
Named = Annotated[
    list[int] | None,
    Parameter(name="--trial", consume_multiple=True, help="Trials to replay besides the notable ones."),
]
Trial = Annotated[int | None, Parameter(help="Number of the trial; else the drive in which most happens.")]
Replays = Annotated[int, Parameter(help="Number of drives to replay at most: collisions, near misses, the liveliest.")]


def experiment_of(
    config: Path | None,
    seed: int | None = None,
    location: str | None = None,
    trials: int | None = None,
    workers: int | None = None,
    traffic: str | None = None,
    vehicles: list[int] | None = None,
    preset: Preset = "default",
) -> "Experiment":
    """The settings of a file or the defaults, with what the command line says put over them."""
    with waiting():
        from coverdrive.config import Experiment

    experiment = Experiment.load(config, preset) if config else Experiment.preset(preset)
    study = {"trials": trials, "workers": workers, "vehicles": vehicles}
    return experiment.overridden(seed=seed, location=location, study=study, traffic={"kind": traffic})


def config_of(out: Path, config: Path | None) -> Path | None:
    """The given settings, or those that the results folder was made with."""
    made_with = out / "config.toml"
    return config or (made_with if made_with.exists() else None)


def study_name(experiment: "Experiment", out: Path) -> str:
    """Folder of a study: each traffic has its own, and that of the results folder's settings is called ``study``."""
    from coverdrive.config import Experiment

    made_with = out / "config.toml"
    usual = Experiment.load(made_with) if made_with.exists() else Experiment()
    return "study" if experiment.traffic.kind == usual.traffic.kind else f"study-{experiment.traffic.kind}"


def shown_study(folder: Path, traffic: str | None) -> str:
    """Name of the study to show, in a results folder."""
    return study_name(experiment_of(config_of(folder, None), traffic=traffic), folder)


def clips_reader(
    folder: Path, study: str, recordings: list[Path] | None, progress: Callable[[float], None]
) -> Callable[[], "Sequence[Clip]"]:
    """Reads the scenes that a study replayed when they are needed, and once."""

    @cache
    def read() -> "Sequence[Clip]":
        from coverdrive import workflow
        from coverdrive.results import load_experiment, load_predictor

        experiment, predictor = load_experiment(folder, study), load_predictor(folder)
        return workflow.clips_to_replay(experiment, predictor, folder, recordings or [])

    return read
