"""One experiment: one frozen model, one TOML file.

Every table of the file belongs to one part of the package, which documents its keys. A file names only what differs
from the defaults; unknown keys are errors.
"""

import tomllib
from pathlib import Path
from typing import Any, Literal, cast

import tomli_w
from pydantic import Field, PositiveInt, ValidationError, model_validator

from coverdrive.errors import SettingError
from coverdrive.files import write_atomically
from coverdrive.planning.planner import PlannerSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.settings import Settings
from coverdrive.simulation.episode import EpisodeSettings
from coverdrive.simulation.generated import GeneratedSettings
from coverdrive.simulation.set_sampling import SetSamplingSettings
from coverdrive.simulation.traffics import TrafficSettings

Preset = Literal["default", "paper"]


class StudySettings(Settings):
    """Size of the closed-loop study."""

    trials: PositiveInt = 20
    """number of trials; the paper has 1000"""
    vehicles: tuple[PositiveInt, ...] = (3, 4, 5, 6, 7)
    """numbers of uncontrolled vehicles, taken in turn by the trials (paper §5)"""
    workers: int = Field(default=0, ge=0)
    """processes; 0: one for each processor"""
    until_width: float | None = Field(default=None, gt=0, lt=1)
    """stop early, after a whole batch, once both 95 % intervals of the collision rates are at most this wide"""
    batch: PositiveInt = 50
    """number of trials after which an early stop is considered"""


class Experiment(Settings):
    """Everything that a result depends on, recordings apart."""

    seed: int = Field(default=0, ge=0)
    """of every random choice"""
    location: str | None = None
    """site to take from an NGSIM file that holds several"""
    smoothing: SmoothingSettings = SmoothingSettings()
    """of recorded positions"""
    generated: GeneratedSettings = GeneratedSettings()
    """traffic that is made up when no recording is given"""
    prediction: PredictionSettings = PredictionSettings()
    """segments, basis, network and certificate"""
    planner: PlannerSettings = PlannerSettings()
    """own car, horizon and weights"""
    episode: EpisodeSettings = EpisodeSettings()
    """length and start of a trial"""
    traffic: TrafficSettings = SetSamplingSettings()
    """behaviour of the uncontrolled vehicles; ``kind`` says which: ``set-sampling`` (paper §5), ``drivers``,
    ``aggressive``, ``mixed`` or ``replay``"""
    study: StudySettings = StudySettings()
    """number of trials"""

    @model_validator(mode="after")
    def _has_one_own_car(self) -> "Experiment":
        start, car = self.episode.initial, self.planner.problem.vehicle
        if (start.length, start.width) != (car.length, car.width):
            raise ValueError(
                f"the own car is {start.length} m × {start.width} m in episode.initial, but {car.length} m × "
                f"{car.width} m in planner.problem.vehicle; change both alike"
            )
        return self

    @staticmethod
    def preset(name: Preset) -> "Experiment":
        """The experiment of a name: the defaults, or the paper's labels, network, loss and certificate."""
        return Experiment(prediction=PredictionSettings.paper()) if name == "paper" else Experiment()

    @staticmethod
    def load(path: Path, preset: Preset = "default") -> "Experiment":
        """Read an experiment from a TOML file.

        Args:
            path: of the file.
            preset: what holds where the file says nothing.

        Raises:
            SettingError: the file is missing, is not TOML, or holds an unknown key or a bad value.
        """
        try:
            changes = tomllib.loads(path.read_text(encoding="utf-8"))
            return Experiment.model_validate(_merged(Experiment.preset(preset).model_dump(), changes))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise SettingError(f"{path}: not a readable TOML file ({error})") from error
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"])) or "the file as a whole"
            raise SettingError(
                f"{path}: {place}: {first['msg']}, got {first['input']!r} ({error.error_count()} problems in all); "
                "the resolved config.toml of any result shows all keys"
            ) from error

    def overridden(self, **changes: Any) -> "Experiment":
        """The same experiment with other values; nested dicts name settings of a part, None leaves a value as it is.

        Raises:
            SettingError: a value is not allowed.
        """
        try:
            return Experiment.model_validate(_merged(self.model_dump(), changes))
        except ValidationError as error:
            first = error.errors()[0]
            raise SettingError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}, got {first['input']!r}") from error

    def save(self, path: Path) -> None:
        """Write all settings, defaults included, to a TOML file."""
        text = tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))
        write_atomically(path, lambda file: file.write_text(text, encoding="utf-8"))


def _merged(values: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(values)
    for name, change in changes.items():
        if isinstance(change, dict):
            part, new = values.get(name), cast(dict[str, Any], change)
            if not isinstance(part, dict) or new.get("kind") not in (None, part.get("kind")):
                part = {}  # settings of another kind
            merged[name] = _merged(cast(dict[str, Any], part), new)
        elif change is not None:
            merged[name] = change
    return merged
