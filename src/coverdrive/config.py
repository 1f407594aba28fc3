"""One experiment: one frozen model, one TOML file.

Every table of the file belongs to one part of the package, which documents its keys. A file names only what differs
from the defaults; unknown keys are errors.
"""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from coverdrive.errors import SettingError
from coverdrive.files import write_text
from coverdrive.planning.planner import PlannerSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.progress import stage
from coverdrive.recordings.checks import TIME_STEPS
from coverdrive.recordings.read import choices_for, read
from coverdrive.recordings.recording import Recording
from coverdrive.recordings.tracks.resampling import STEP
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.settings import Settings, checked, merged, to_toml
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.traffic.registry import TrafficSettings
from coverdrive.simulation.traffic.set_sampling import SetSamplingSettings

Preset = Literal["default", "paper"]


_HEAD = """# All settings of an experiment, as `coverdrive --config FILE` takes them; it may leave out what is as usual.
# All in SI units.

"""


class StudySettings(Settings):
    """Size of the closed-loop study."""

    trials: int = Field(default=20, ge=1, le=10_000_000)
    """number of trials; the paper has 1000"""
    vehicles: tuple[Annotated[int, Field(ge=1, le=100)], ...] = Field(
        default=(3, 4, 5, 6, 7), min_length=1, max_length=1000
    )
    """numbers of uncontrolled vehicles, taken in turn by the trials (paper §5)"""
    workers: int = Field(default=0, ge=0, le=1024)
    """processes; 0: one for each processor"""
    until_width: float | None = Field(default=None, gt=0, lt=1)
    """stop early, after a whole batch, once both 95 % intervals of the collision rates are at most this wide"""
    batch: int = Field(default=50, ge=1, le=10_000_000)
    """number of trials after which an early stop is considered"""


class Experiment(Settings):
    """Everything that a result depends on, recordings apart."""

    seed: int = Field(default=0, ge=0, le=2**63 - 1)
    """seed of every random choice"""
    location: str | None = None
    """site to take from an NGSIM file that holds several"""
    format: str | None = None
    """name of the recordings' format, where the files do not show it themselves"""
    map: str | None = None
    """Lanelet2 map of the recordings' road, where their format says where on it they are"""
    dt: float = Field(default=STEP, ge=TIME_STEPS[0], le=TIME_STEPS[1])
    """[s] time step of recordings; those of another one are resampled"""
    smoothing: SmoothingSettings = SmoothingSettings()
    """how recorded positions are smoothed"""
    generated: GeneratedSettings = GeneratedSettings()
    """traffic that is made up when no recording is given"""
    prediction: PredictionSettings = PredictionSettings()
    """segments, basis, network and certificate"""
    planner: PlannerSettings = PlannerSettings()
    """ego, horizon and weights"""
    episode: EpisodeSettings = EpisodeSettings()
    """length and start of a trial"""
    traffic: TrafficSettings = SetSamplingSettings()
    """behaviour of the uncontrolled vehicles; ``kind`` says which: ``set-sampling`` (paper §5), ``drivers``,
    ``aggressive``, ``mixed``, ``replay`` or ``reactive-replay``"""
    study: StudySettings = StudySettings()
    """number of trials"""

    @model_validator(mode="after")
    def _has_one_ego(self) -> "Experiment":
        start, car = self.episode.initial, self.planner.problem.vehicle
        if (start.length, start.width) != (car.length, car.width):
            raise ValueError(
                f"the ego is {start.length} m × {start.width} m in episode.initial, but {car.length} m × "
                f"{car.width} m in planner.problem.vehicle; change both alike"
            )
        return self

    @staticmethod
    def preset(name: Preset) -> "Experiment":
        """The experiment of a name: the defaults, or the paper's labels, network, loss, certificate and planner."""
        if name != "paper":
            return Experiment()
        free = {"max_steering": 1.57, "max_steering_rate": 1e4, "max_power": 1e4}  # a Dubins car turns at once
        cost = {"speed": 0.05, "heading": 20.0, "acceleration_change": 0.6}
        problem = {"branches": {"fail_safe": False}, "cost": cost, "vehicle": free}
        alone = {"deceleration": 0.0, "foresight": 0.0}
        single = {"planner": {"problem": problem, "leaders": alone, "manners": {"like": "paper"}}}
        return Experiment(prediction=PredictionSettings.paper()).updated(single)

    @staticmethod
    def load(path: Path, usual: "Experiment | None" = None) -> "Experiment":
        """Read an experiment from a TOML file; ``usual``, or the defaults, hold where it says nothing.

        Raises:
            SettingError: the file is missing, is not TOML, or holds an unknown key or a bad value.
        """
        changes = named_in(path)
        try:
            return (usual or Experiment()).updated(changes)
        except SettingError as error:
            raise SettingError(f"{path}: {error}; the config.toml of any result shows all keys") from error

    def updated(self, changes: dict[str, Any]) -> "Experiment":
        """The same experiment with other values; nested dicts name settings of a part, None leaves a value as it is.

        Raises:
            SettingError: a value is not allowed.
        """
        return checked(Experiment, merged(self.model_dump(), changes))

    def recordings(self, paths: Sequence[Path], stored: bool = False) -> tuple[Recording, ...]:
        """The recordings in some files and folders, or generated traffic where none is given.

        Settings that are ``stored`` with results may be of other recordings: a location and a map that none of these
        takes are left out, instead of refused.
        """
        with stage("recordings"):
            if paths:
                given: dict[str, str | None] = {"location": self.location, "map": self.map}
                if stored and any(given.values()):
                    given = {name: given[name] for name in choices_for(paths, self.format)}
                return read(paths, smoothing=self.smoothing, format=self.format, dt=self.dt, **given)
            return generate(self.generated, self.seed)

    def save(self, path: Path) -> None:
        """Write all settings, defaults included, to a TOML file that says what each means."""
        write_text(path, _HEAD + to_toml(self))


def named_in(path: Path) -> dict[str, Any]:
    """What a TOML file says, as nested tables; a SettingError if it is missing or is not TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))  # some editors put a mark of bytes first
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise SettingError(f"{path}: not a readable TOML file ({error})") from error
