"""The traffic models by name."""

from collections.abc import Sequence
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING, Annotated, Any, Protocol, Union

from pydantic import BeforeValidator, Field, TypeAdapter

from coverdrive.errors import DataError, SettingError
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.traffic.kinds import TRAFFICS
from coverdrive.simulation.traffic.model import Traffic
from coverdrive.simulation.traffic.replay import Scenario

NAMES = tuple(TRAFFICS)
"""of all models"""

_LOADED: dict[str, list[Any]] = {
    kind: [getattr(import_module(f"coverdrive.simulation.traffic.{file}"), each) for each in names]
    for kind, (file, *names) in TRAFFICS.items()
}


def _named(settings: Any) -> Any:
    """A table of settings without a name is of the paper's."""
    if not isinstance(settings, dict):
        return settings
    if not isinstance(settings.get("kind", ""), str):
        raise ValueError(f"kind is the name of a traffic: {', '.join(NAMES)}")
    return {"kind": "set-sampling", **settings}


if TYPE_CHECKING:

    class TrafficSettings(Protocol):
        """Settings of one of the models, told apart by ``kind``."""

        @property
        def kind(self) -> str:
            """Name of the traffic."""
            ...
else:
    _AnySettings = Union[tuple(settings for settings, _ in _LOADED.values())]  # noqa: UP007
    TrafficSettings = Annotated[Annotated[_AnySettings, Field(discriminator="kind")], BeforeValidator(_named)]


def usual(kind: str) -> TrafficSettings:
    """The default settings of the traffic of a name; a SettingError if there is none."""
    if kind not in NAMES:
        raise SettingError(f"no traffic is called {kind!r}; choose {', '.join(NAMES[:-1])} or {NAMES[-1]}")
    return TypeAdapter(TrafficSettings).validate_python({"kind": kind})


def make_traffic(settings: TrafficSettings, predictor: Predictor | None, scenarios: Sequence[Scenario] = ()) -> Traffic:
    """The traffic model of these settings; a DataError if it replays ``scenarios`` and there are none.

    Traffic that drives members of predicted sets asks for a predictor, with a SettingError.
    """
    model = _LOADED[settings.kind][1]
    given = {"settings": settings, "predictor": predictor, "scenarios": scenarios}
    taken = {name: given[name] for name in signature(model).parameters}
    if not taken.get("scenarios", True):
        raise DataError(
            "replayed traffic needs recorded scenes, got none; give recordings, or name some with --recording"
        )
    if taken.get("predictor", True) is None:
        raise SettingError(f"{settings.kind} traffic drives members of predicted sets; give a predictor")
    return model(**taken)
