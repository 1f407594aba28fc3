"""What several commands take, and what they make of it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Console

if TYPE_CHECKING:
    from coverdrive.config import Experiment

console = Console()

Recordings = Annotated[
    list[Path] | None,
    Parameter(
        name="--recording",
        consume_multiple=True,
        help="Files or folders: NGSIM CSV or text, CommonRoad XML, Parquet. Without any, traffic is generated.",
    ),
]
Config = Annotated[Path | None, Parameter(help="TOML file with the settings that differ from the defaults.")]
Seed = Annotated[int | None, Parameter(help="Seed of every random choice; the same seed gives the same result.")]
Out = Annotated[Path, Parameter(help="Results folder.")]
Folder = Annotated[Path, Parameter(help="Results folder.")]
Trials = Annotated[int | None, Parameter(help="Number of closed-loop trials; the paper has 1000.")]
Workers = Annotated[int | None, Parameter(help="Number of processes; 0: one for each processor.")]
Location = Annotated[str | None, Parameter(help="Site to take from an NGSIM file that holds several.")]
Named = Annotated[
    list[int] | None,
    Parameter(name="--trial", consume_multiple=True, help="Trials to replay besides the notable ones."),
]
Trial = Annotated[int | None, Parameter(help="Number of the trial; else the drive in which most happens.")]
Replays = Annotated[int, Parameter(help="Number of drives to replay at most: the liveliest, collisions, near misses.")]


def experiment_of(
    config: Path | None,
    seed: int | None = None,
    location: str | None = None,
    trials: int | None = None,
    workers: int | None = None,
) -> "Experiment":
    """The settings of a file or the defaults, with what the command line says put over them."""
    from coverdrive.config import Experiment

    experiment = Experiment.load(config) if config else Experiment()
    return experiment.overridden(seed=seed, location=location, study={"trials": trials, "workers": workers})


def config_of(out: Path, config: Path | None) -> Path | None:
    """The given settings, or those that the results folder was made with."""
    made_with = out / "config.toml"
    return config or (made_with if made_with.exists() else None)
