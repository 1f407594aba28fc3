"""The traffic models by name."""

from collections.abc import Sequence
from typing import Annotated, Any, get_args

from pydantic import BeforeValidator, Field, TypeAdapter

from coverdrive.errors import DataError, SettingError
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.traffic.driver_traffic import AggressiveTrafficSettings, DriverTraffic, DriverTrafficSettings
from coverdrive.simulation.traffic.mixed import MixedTraffic, MixedTrafficSettings
from coverdrive.simulation.traffic.model import Traffic
from coverdrive.simulation.traffic.reactive_replay import ReactiveReplaySettings, ReactiveReplayTraffic
from coverdrive.simulation.traffic.replay import ReplaySettings, ReplayTraffic, Scenario
from coverdrive.simulation.traffic.set_sampling import SetSamplingSettings, SetSamplingTraffic


def _named(settings: Any) -> Any:
    """A table of settings without a name is of the paper's."""
    if not isinstance(settings, dict):
        return settings
    if not isinstance(settings.get("kind", ""), str):
        raise ValueError(f"kind is the name of a traffic: {', '.join(NAMES)}")
    return {"kind": "set-sampling", **settings}


_AnySettings = (
    SetSamplingSettings
    | DriverTrafficSettings
    | AggressiveTrafficSettings
    | MixedTrafficSettings
    | ReplaySettings
    | ReactiveReplaySettings
)
TrafficSettings = Annotated[Annotated[_AnySettings, Field(discriminator="kind")], BeforeValidator(_named)]
"""settings of one of the models, told apart by ``kind``"""

NAMES: tuple[str, ...] = tuple(each.model_fields["kind"].default for each in get_args(_AnySettings))
"""of all models"""


def usual(kind: str) -> TrafficSettings:
    """The default settings of the traffic of a name; a SettingError if there is none."""
    if kind not in NAMES:
        raise SettingError(f"no traffic is called {kind!r}; choose {', '.join(NAMES[:-1])} or {NAMES[-1]}")
    return TypeAdapter(TrafficSettings).validate_python({"kind": kind})


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
