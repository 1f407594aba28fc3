"""The traffic models by name."""

from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import Discriminator, Tag

from coverdrive.errors import DataError
from coverdrive.simulation.driver_traffic import AggressiveTrafficSettings, DriverTraffic, DriverTrafficSettings
from coverdrive.simulation.mixed import MixedTraffic, MixedTrafficSettings
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.replay import ReplaySettings, ReplayTraffic, Scenario
from coverdrive.simulation.set_sampling import SetSamplingSettings, SetSamplingTraffic
from coverdrive.simulation.traffic import Traffic


def _kind(settings: Any) -> Any:
    """The name in a table of settings; without one they are the paper's."""
    kind = settings.get("kind", "set-sampling") if isinstance(settings, dict) else getattr(settings, "kind", None)
    return kind if isinstance(kind, str) else None


TrafficSettings = Annotated[
    Annotated[SetSamplingSettings, Tag("set-sampling")]
    | Annotated[DriverTrafficSettings, Tag("drivers")]
    | Annotated[AggressiveTrafficSettings, Tag("aggressive")]
    | Annotated[MixedTrafficSettings, Tag("mixed")]
    | Annotated[ReplaySettings, Tag("replay")],
    Discriminator(_kind),
]
"""settings of one of the models, told apart by ``kind``"""


def make_traffic(settings: TrafficSettings, predictor: Predictor, scenarios: Sequence[Scenario] = ()) -> Traffic:
    """The traffic model of these settings; a DataError if it replays ``scenarios`` and there are none."""
    match settings:
        case SetSamplingSettings():
            return SetSamplingTraffic(predictor, settings)
        case DriverTrafficSettings():
            return DriverTraffic(settings)
        case MixedTrafficSettings():
            return MixedTraffic(predictor, settings)
        case ReplaySettings():
            if not scenarios:
                raise DataError("replayed traffic needs recorded scenes, got none; name some with --recording")
            return ReplayTraffic(scenarios, settings)
