"""Where one drives: a road, the traffic on it at the start, and the speed that the ego wants there.

The roads of a name, and one like that of recordings: "what you recorded is what you drive".
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
from pydantic import Field

from coverdrive.distances import FREE, Kept, kept
from coverdrive.errors import SettingError
from coverdrive.planning.rules.manners import MannersSettings
from coverdrive.progress import done
from coverdrive.recordings.recording import Recording
from coverdrive.recordings.summary import following
from coverdrive.road import Road
from coverdrive.settings import Settings
from coverdrive.simulation.roads.initial import VEHICLES, InitialSettings
from coverdrive.simulation.roads.settings import CURVED, UNLIMITED, RoadSettings

_STRETCH = (-60.0, 100.0)
"""[m] of traffic behind and ahead of an ego among vehicles like recorded ones"""

_FEW = 0.02
"""share of such moments below which all others count, too"""

_LONGEST = 30.0
"""[s] that a trial may last before the ego, as fast as it wants, is beyond the road"""

_EVERY = 25.0
"""[m] over which the curvature of a recorded road is averaged"""

_STRAIGHT = 1e-4
"""[1/m] a road that bends less, with a radius of 10 km, is straight"""

_CROWDED = 3.0
"""the mean spacing is at least as many times the smallest one at the start, so that all find room"""

_SIZES = 20
"""number of recorded vehicles that stand for the sizes of all"""


class Place(Settings):
    """A road, the traffic on it at the start of a trial, and the speed that the ego wants."""

    initial: InitialSettings = InitialSettings()
    vehicles: tuple[int, ...] = VEHICLES
    """numbers of uncontrolled vehicles, taken in turn by the trials"""
    wanted_speed: float = Field(default=40.0, gt=0, le=120)
    """[m/s] of the ego"""
    manners: MannersSettings | None = None
    """of recorded drivers"""

    @property
    def parts(self) -> dict[str, Any]:
        """The same as parts of an experiment, whose ego keeps its size."""
        manners = {"manners": self.manners.model_dump(exclude={"like"})} if self.manners else {}
        return {
            "episode": {"initial": self.initial.model_dump(exclude={"length", "width"})},
            "planner": {"problem": {"cost": {"reference_speed": self.wanted_speed}}, **manners},
            "study": {"vehicles": self.vehicles},
        }

    @property
    def road(self) -> dict[str, Any]:
        """The settings of the road alone."""
        return self.initial.model_dump(include=set(RoadSettings.model_fields))


PLACES = {
    "paper": Place(),
    "curved": Place(
        initial=InitialSettings(**CURVED.model_dump(), position=400.0, road_length=2000.0),
        wanted_speed=CURVED.speed_limit,
    ),
}
"""by name: that of the paper (§5), and a road that bends and has an on-ramp (`CURVED`)"""


def place_of(road: str | None, like: Place | None) -> tuple[str, Place]:
    """The name of a road, and the place: what was recorded is what is driven, if no other road is named.

    ``like`` is a place like that of the recordings, if there are any. A SettingError if there is no such road.
    """
    places = {**PLACES, "recorded": like}
    name = road or ("recorded" if like else "paper")
    if name not in places:
        raise SettingError(f"there is no road {name!r}; choose one of {', '.join(places)}")
    if (place := places[name]) is None:
        raise SettingError("a road like the recorded one needs recordings; name some, or choose another road")
    return name, place


def is_replayed_on(road: str | None, made_on: str) -> bool:
    """Whether a road that is asked for, if any is, is that on which was recorded."""
    return road in (None, "recorded", made_on)


def check_replayed_road(road: str | None, made_on: str = "recorded") -> None:
    """Refuse, with a SettingError, to replay on a road of another name than that on which was recorded."""
    if not is_replayed_on(road, made_on):
        raise SettingError(
            f"replayed traffic drives on the road on which it was recorded, got the road {road!r}; leave the road out, "
            "or choose another traffic; another wanted speed is planner.problem.cost.reference_speed"
        )


def recorded_place(recordings: Sequence[Recording]) -> Place:
    """A place like that of recordings.

    Lanes are those of most rows, of the median width; bends and limit those of the recorded road with most rows, which
    goes on after its end as it came. The traffic starts at the median speed and mean density; ego and drivers want the
    95 % quantile of the speeds of vehicles that nobody keeps from driving faster (time gaps of more than 3 s). Sizes
    are those of 20 vehicles from the shortest to the longest, as many long ones as were recorded.
    """
    counts = [_lanes_that_go_on(each.road) for each in recordings]
    lanes = int(np.bincount(counts, weights=[len(each.table) for each in recordings]).argmax())
    widths = np.concatenate([np.repeat(np.diff(each.road.edges), len(each.table)) for each in recordings])
    alike = [each for each, count in zip(recordings, counts, strict=True) if count == lanes]
    road = max(alike, key=lambda each: len(each.table)).road
    speeds = np.concatenate([each.table["speed"].to_numpy() for each in recordings])
    pairs = pl.concat([following(each) for each in recordings])
    speed, gap, spacing = (pairs[name].to_numpy() for name in ("speed", "gap", "spacing"))
    free = speed[gap > FREE * speed]
    median = max(1.0, _rounded(np.median(speeds), 1))
    wanted = max(_rounded(np.quantile(free if len(free) > _FEW * len(speed) else speeds, 0.95), 1), median)
    number = (_STRETCH[1] - _STRETCH[0]) * lanes / spacing.mean() if len(spacing) else 0.0
    room = spacing.mean() / _CROWDED - (spacing - gap).mean() if len(gap) else 0.0
    start = -_STRETCH[0] + 40.0
    length = start + _STRETCH[1] + _LONGEST * wanted
    initial = InitialSettings(
        lanes=lanes,
        lane_width=_rounded(np.median(widths), 2),
        curvature=_curvature(road, length),
        speed_limit=road.speed_limit or UNLIMITED,
        road_length=float(np.ceil(length)),
        position=start,
        ego_speed=median,
        traffic_speed=median,
        desired_speed=wanted,
        behind=_STRETCH[0],
        ahead=_STRETCH[1],
        gap=_rounded(np.clip(np.quantile(gap, 0.05), 2.0, max(2.0, room)), 1) if len(gap) else 2.0,
        sizes=_sizes(recordings),
    )
    usual = np.array(VEHICLES) / np.mean(VEHICLES)
    numbers = np.clip(np.rint(number * usual), 1, 100).astype(int)
    vehicles = tuple(dict.fromkeys(numbers.tolist()))
    return Place(initial=initial, vehicles=vehicles, wanted_speed=wanted, manners=_manners(recordings))


def _manners(recordings: Sequence[Recording]) -> MannersSettings:
    """What people keep in nine of ten moments in which there is somebody, of one moment a second, or lane changes."""
    moments = list[Kept]()
    for number, each in enumerate(recordings, start=1):
        scenes = each.frames().every(max(1, round(1 / each.dt)))
        moments += [kept(scene, each.road, np.arange(scene.vehicles)) for scene, _ in scenes]
        done(number, len(recordings))
    sideways = [
        float(np.abs(track["speed"] * track["heading"].sin()).max())  # pyright: ignore[reportArgumentType]
        for each in recordings
        for track in each.table.partition_by("vehicle", "group")
        if len(np.unique(each.road.lane_at(track["lon"].to_numpy(), track["lat"].to_numpy()))) > 1
    ]
    usual = {"sideways": _rounded(min(max(np.quantile(sideways, 0.9), 0.1), 10.0), 2)} if sideways else {}
    for name in ("headway", "beside", "time_to_collision"):
        distances = np.concatenate([getattr(each, name).ravel() for each in moments])
        there = distances[np.isfinite(distances)]
        if len(there):
            usual[name] = _rounded(min(np.quantile(there, 0.1), 10.0), 2)
    return MannersSettings.model_validate(usual)


def _lanes_that_go_on(road: Road) -> int:
    """How many are there along half of the road at least."""
    return int((road.has_lane(np.linspace(0.0, float(road.length), 200)).mean(0) >= 0.5).sum())


def _curvature(road: Road, length: float) -> tuple[tuple[float, float], ...]:
    """The curvature of a recorded road, averaged, and to and fro until the road is long enough."""
    if road.line is None:
        return ()
    spots = np.arange(0.0, length + _EVERY, _EVERY)
    there = float(road.length) - np.abs(spots % (2 * float(road.length)) - float(road.length))
    around = np.clip(there[:, None] + np.linspace(-_EVERY / 2, _EVERY / 2, 11), 0.0, float(road.length))
    curvature = road.curvature(around).mean(1)
    if np.abs(curvature).max() < _STRAIGHT:
        return ()
    return tuple((float(spot), _rounded(value, 6)) for spot, value in zip(spots, curvature, strict=True))


def _sizes(recordings: Sequence[Recording]) -> tuple[tuple[float, float], ...]:
    """Length and width [m] of some of the vehicles, evenly from the shortest to the longest."""
    each = pl.concat([recording.table.select("identity", "length", "width") for recording in recordings])
    sizes = each.group_by("identity").median().sort("length", "width").select("length", "width").to_numpy()
    chosen = np.rint((np.arange(_SIZES) + 0.5) / _SIZES * len(sizes) - 0.5).astype(int)
    return tuple((_rounded(length, 2), _rounded(width, 2)) for length, width in sizes[chosen])


def _rounded(value: float | np.floating, digits: int) -> float:
    return round(float(value), digits)
