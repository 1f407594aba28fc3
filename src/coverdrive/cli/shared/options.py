"""What several commands take, and what they make of it."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter, Token
from cyclopts.validators import Number

from coverdrive.cli.shared.bars import console as progress_console
from coverdrive.cli.shared.bars import waiting
from coverdrive.cli.shared.terminal import Terminal
from coverdrive.errors import SettingError
from coverdrive.simulation.traffic.kinds import TRAFFICS

if TYPE_CHECKING:
    from coverdrive.config import Experiment, StudySettings
    from coverdrive.results import Results

console = Terminal()

TARGETS = (0.05, 0.1, 0.2)
"""bounds ε on the miss rate at which methods of calibration are compared"""


def usually(value: str) -> Callable[[Any], str]:
    """What the help says of an option whose default is in the settings, which are slow to load."""
    return lambda _: f"{value} unless the settings differ"


def listed(values: Sequence[float]) -> str:
    """Numbers as they are given to an option."""
    return " ".join(f"{value:g}" for value in values)


def between(low: float, high: float) -> Callable[[Any, Any], None]:
    """Refuses numbers that are not within these bounds, themselves excluded, and what is no number."""

    def check(_: Any, values: Any) -> None:
        for value in values if isinstance(values, tuple) else (values,):
            if value is not None and not low < value < high:
                raise ValueError(f"expected a number between {low:g} and {high:g}, got {value:g}")

    return check


def whole(_: Any, tokens: Sequence[Token]) -> int:
    """A whole number; fractions are not rounded."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise ValueError(f"expected a whole number, got {tokens[0].value}") from None


if TYPE_CHECKING:
    Traffics = str
else:
    Traffics = Literal[tuple(TRAFFICS)]

Recordings = Annotated[
    list[Path] | None,
    Parameter(
        consume_multiple=True,
        help="Files or folders of NGSIM, highD, CommonRoad and others, as in `--recording scenarios/ us-101.csv`. "
        "Without any, traffic is generated.",
    ),
]
ToReplay = Annotated[
    list[Path] | None,
    Parameter(
        consume_multiple=True,
        help="Only with --traffic replay or reactive-replay: files or folders to replay, as in `--recording "
        "scenarios/`. Without any, the generated traffic is replayed.",
    ),
]
Config = Annotated[
    Path | None,
    Parameter(
        help="TOML file with the settings that differ from those of the results folder, or without one from the "
        "defaults, as in `--config mine.toml`; the config.toml of any result shows all of them, with units.",
        show_default=False,
    ),
]
Preset = Annotated[
    Literal["default", "paper"],
    Parameter(
        help="What holds where nothing else says it: our defaults, or the paper's sets, certificate, planner and road, "
        "as in `--preset paper`."
    ),
]
Set = Annotated[
    list[str] | None,
    Parameter(
        name="--set",
        consume_multiple=True,
        help="Settings of config.toml by their names, as in `--set planner.manners.like=regulation "
        "episode.duration=10`; they hold over everything else.",
    ),
]
Epsilon = Annotated[
    float | Literal["auto"] | None,
    Parameter(
        help="Bound to prove on the share that is missed, between 0 and 1, or auto: 0.1 if the data can prove it, else "
        "the smallest that they can; as in `--epsilon 0.05`.",
        show_default=usually("auto"),
    ),
]
Confidence = Annotated[
    float | None,
    Parameter(
        help="Probability with which the bound holds, between 0 and 1, as in `--confidence 0.9`.",
        show_default=usually("0.99"),
    ),
]
Unit = Annotated[
    Literal["window", "vehicle", "share", "group"] | None,
    Parameter(
        help="What the bound is about. window: single windows of 3 s, as in the paper; vehicle: whole vehicles, missed "
        "in any window; share: the share of a vehicle's windows; group: vehicles of a new group of scenes; as in "
        "`--unit vehicle`.",
        show_default=usually("share"),
    ),
]
Seed = Annotated[
    int | None,
    Parameter(
        converter=whole,
        help="Seed of every random choice, 0 to 2⁶³ − 1, as in `--seed 7`; the same seed gives the same result.",
        show_default=usually("0"),
    ),
]
Out = Annotated[Path, Parameter(help="Results folder, as in `--out us101`.")]
Folder = Annotated[Path, Parameter(help="Results folder, as in `us101`.")]
Trials = Annotated[
    int | None,
    Parameter(
        converter=whole,
        help="Number of closed-loop trials of 20 s, as in `--trials 100`; the paper has 1000.",
        show_default=usually("20"),
    ),
]
Workers = Annotated[
    int | None,
    Parameter(
        converter=whole,
        help="Number of processes, as in `--workers 4`; 0: one for each processor.",
        show_default=usually("0"),
    ),
]
TrafficName = Annotated[
    Traffics | None,
    Parameter(
        help="Uncontrolled vehicles: of the paper (set-sampling), IDM and MOBIL drivers, aggressive ones, a mixture, "
        "or recorded ones that do not react (replay), or do so while the ego is in their way (reactive-replay); as in "
        "`--traffic drivers`.",
        show_default=usually("set-sampling"),
    ),
]
Roads = Literal["recorded", "paper", "curved"]
RoadName = Annotated[
    Roads | None,
    Parameter(
        help="Road to drive on: like that of the recordings, with its lanes, bends, density and speeds (recorded); "
        "three straight lanes on which the ego wants 40 m/s (paper); or bends of 231 m to 400 m radius and an on-ramp "
        "whose lane ends (curved), on which generated traffic is recorded, too; as in `--road curved`.",
        show_default=lambda _: "recorded, or paper where traffic is generated and for --preset paper",
    ),
]
RoadOfStudy = Annotated[RoadName, Parameter(show_default=lambda _: "that of the results folder")]
Vehicles = Annotated[
    list[Annotated[int, Parameter(converter=whole)]] | None,
    Parameter(
        consume_multiple=True,
        validator=Number(gte=1, lte=100),
        help="Numbers of uncontrolled vehicles, 1 to 100, taken in turn by the trials; as in `--vehicles 5 10`.",
        show_default=usually("3 4 5 6 7, as in the paper,"),
    ),
]


@Parameter(name="*")
@dataclass(frozen=True)
class Files:
    """How recordings are read."""

    location: Annotated[
        str | None, Parameter(help="Site to take from an NGSIM file that holds several, as in `--location us-101`.")
    ] = None
    format: Annotated[
        str | None,
        Parameter(help="Format of the recordings where the files do not show it themselves, as in `--format NGSIM`."),
    ] = None
    map: Annotated[
        str | None,
        Parameter(
            help="Lanelet2 map of the road, for exiD, inD, rounD, uniD and INTERACTION, as in `--map lanelets.osm`; "
            "without it, lanes are estimated from the tracks."
        ),
    ] = None
    dt: Annotated[
        float | None,
        Parameter(
            help="Time step of the recordings in seconds, to which those of another one are resampled; as in "
            "`--dt 0.05`.",
            show_default=usually("0.1"),
        ),
    ] = None

    def settings_for(self, recordings: Sequence[Path]) -> dict[str, Any]:
        """What is said, by the names of settings; a SettingError if anything is and there are no recordings."""
        for name, value in vars(self).items():
            if value is not None and not recordings:
                raise SettingError(
                    f"--{name} says how recordings are read, and there are none; name some, or leave it out for "
                    "generated traffic"
                )
        return vars(self)


AS_USUAL = Files()


def experiment_of(
    config: Path | None = None,
    preset: Preset = "default",
    settings: Sequence[str] | None = None,
    usual: dict[str, Any] | None = None,
    base: "Experiment | None" = None,
    road: dict[str, Any] | None = None,
    **options: Any,
) -> "Experiment":
    """All settings: the usual ones, over them those of a file, then the options, and last what ``--set`` says.

    Args:
        config: TOML file; what ``road`` replaces of it is said on stderr.
        preset: what is usual.
        settings: of ``--set``.
        usual: parts of an experiment that are usual for this command.
        base: the settings of a results folder, which hold where the file says nothing, instead of the usual ones.
        road: parts of an experiment that ``--road`` stands for, if it was given.
        options: parts of an experiment by name; what is None was not asked for.

    Raises:
        SettingError: a setting is unknown, or has a value that makes no sense.
    """
    with waiting():
        from coverdrive.config import Experiment
        from coverdrive.settings import merged
        from coverdrive.sweep import changes_of

    known = base or Experiment.preset(preset).updated(usual or {})
    experiment = Experiment.load(config, known) if config else known
    if config and road:
        _say_replaced(config, experiment, road)
    return experiment.updated(merged(merged(road or {}, options), changes_of(settings or [])))


def _differing(one: "Experiment", other: "Experiment") -> list[str]:
    """The names of settings that differ between two experiments."""
    from coverdrive.simulation.studies.folder import flat

    before, after = (flat(each.model_dump(mode="json")) for each in (one, other))
    return [name for name in before | after if before.get(name) != after.get(name)]


def _say_replaced(config: Path, experiment: "Experiment", road: dict[str, Any]) -> None:
    """Say in a line on stderr which settings of a file the road that was asked for replaces, if it replaces any."""
    from coverdrive.config import named_in
    from coverdrive.simulation.studies.folder import flat

    changed = _differing(experiment, experiment.updated(road))
    if replaced := [name for name in flat(named_in(config)) if name in changed]:
        named = ", ".join(replaced[:3]) + " and others" * (len(replaced) > 3)
        said = f"--road holds over what {config} says of {named}"
        progress_console.print(said, soft_wrap=True, highlight=False)


def experiment_in(
    results: "Results", road: str | None, config: Path | None = None, settings: Sequence[str] | None = None, **said: Any
) -> "Experiment":
    """`experiment_of` the settings of a results folder, for drives on its road or on the one that is asked for.

    Raises:
        SettingError: as of `experiment_of`, or a setting is of what the predictor was made from and with.
    """
    from coverdrive.sweep import PARTS

    parts = results.place(road).parts if road else None
    experiment = experiment_of(config, settings=settings, base=results.experiment, road=parts, **said)
    for name in _differing(results.experiment, experiment):
        if name.partition(".")[0] not in (*PARTS, "study", "seed"):
            raise SettingError(
                f"{name} made the predictor in {results.folder}, and cannot change what drives with it; fit anew, "
                "with another --out, or leave it out"
            )
    return experiment


def processes(study: "StudySettings") -> int:
    """How many to work with."""
    return study.workers or os.cpu_count() or 1
