"""The traffic models by name."""

from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import Discriminator, Tag, TypeAdapter, ValidationError

from coverdrive.errors import DataError, SettingError
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.traffic.driver_traffic import AggressiveTrafficSettings, DriverTraffic, DriverTrafficSettings
from coverdrive.simulation.traffic.mixed import MixedTraffic, MixedTrafficSettings
from coverdrive.simulation.traffic.model import Traffic
from coverdrive.simulation.traffic.reactive_replay import ReactiveReplaySettings, ReactiveReplayTraffic
from coverdrive.simulation.traffic.replay import ReplaySettings, ReplayTraffic, Scenario
from coverdrive.simulation.traffic.set_sampling import SetSamplingSettings, SetSamplingTraffic


def _kind(settings: Any) -> Any:
    """The name in a table of settings; without one they are the paper's."""
    kind = settings.get("kind", "set-sampling") if isinstance(settings, dict) else getattr(settings, "kind", None)
    return kind if isinstance(kind, str) else None


TrafficSettings = Annotated[
    Annotated[SetSamplingSettings, Tag("set-sampling")]
    | Annotated[DriverTrafficSettings, Tag("drivers")]
    | Annotated[AggressiveTrafficSettings, Tag("aggressive")]
    | Annotated[MixedTrafficSettings, Tag("mixed")]
    | Annotated[ReplaySettings, Tag("replay")]
    | Annotated[ReactiveReplaySettings, Tag("reactive-replay")],
    Discriminator(_kind),
]
"""settings of one of the models, told apart by ``kind``"""


def usual(kind: str) -> TrafficSettings:
    """The default settings of the traffic of a name; a SettingError if there is none."""
    try:
        return TypeAdapter(TrafficSettings).validate_python({"kind": kind})
    except ValidationError as error:
        names = "set-sampling, drivers, aggressive, mixed, replay or reactive-replay"
        raise SettingError(f"no traffic is called {kind!r}; choose {names}") from error


def make_traffic(settings: TrafficSettings, predictor: Predictor | None, scenarios: Sequence[Scenario] = ()) -> Traffic:
    """The traffic model of these settings; a DataError if it replays ``scenarios`` and there are none.

    Traffic that drives members of predicted sets asks for a predictor, with a SettingError.
    """
    match settings:
        case DriverTrafficSettings():
            return DriverTraffic(settings)
        case ReplaySettings():
            if not scenarios:
                raise DataError("replayed traffic needs recorded scenes, got none; name some with --recording")
            reacting = isinstance(settings, ReactiveReplaySettings)
            return ReactiveReplayTraffic(scenarios, settings) if reacting else ReplayTraffic(scenarios, settings)
        case SetSamplingSettings() | MixedTrafficSettings():
            if predictor is None:
                raise SettingError(f"{settings.kind} traffic drives members of predicted sets; give a predictor")
            sampling = isinstance(settings, SetSamplingSettings)
            return SetSamplingTraffic(predictor, settings) if sampling else MixedTraffic(predictor, settings)
