"""Planning problems of CommonRoad scenarios: who is where, on which road, and where the drive is to lead."""

from collections.abc import Callable, Collection, Hashable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from shapely import contains_xy, get_coordinates, intersects_xy, prepare
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from coverdrive.driving.goal import Goal, Interval
from coverdrive.driving.obstacles import begins_in, come_near, cut, pieces, shape_of, told_at, tracks_of
from coverdrive.driving.perception import Told
from coverdrive.driving.route import drawn_near, farthest, route, within_reach
from coverdrive.driving.tidy import in_order, refuse_unknown, with_narrow_headings
from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.checks import check_vehicles, wrong_speed_limit
from coverdrive.recordings.files.boundary import naming
from coverdrive.recordings.files.scenario import check_problem, has_sets, open_scenario
from coverdrive.recordings.formats.commonroad import speed_limit
from coverdrive.recordings.roads.border import lanes_along_border
from coverdrive.recordings.roads.drawn_road import TOUCHING, DrawnLane
from coverdrive.recordings.roads.driven_road import roads_of
from coverdrive.recordings.tracks.repair import VERGE
from coverdrive.reference_line import SMALLEST_RADIUS
from coverdrive.road import Road

_SAME_PLACE, _SAME_SPEED = 1.0, 0.5
"""[m], [m/s] an obstacle that is nearer to the start is the recorded ego itself"""
_NO_GAP = 0.05
"""[m] by which lanelets may miss each other, on either side"""
_BEHIND, _AHEAD = 4.0, 25.0
"""[m] where a map may have no gap between lanes if one is to change between them: body, and way to the other lane"""
_OFF_CENTRE = 0.4
"""[m] by which one aims at the inside of a position across the road, and of the road"""
_STEP, _OBLIQUE = 0.5, 1.0
"""[m] between places along a lane at which it is asked whether a goal is there, and by which the ends of one may be
oblique"""
_MOST = 0.5
"""share of a goal that makes a road one that leads there, and of the way along one lane in it that makes others do"""


@dataclass(frozen=True, eq=False)
class PlanningProblem:
    """One planning problem of a scenario, on the road that its start is on."""

    file: Path
    scenario: Any
    """as commonroad-io reads it, without the recorded ego"""
    problem: Any
    """as commonroad-io reads it"""
    road: Road

    @property
    def number(self) -> int:
        """Its number in the file."""
        return int(self.problem.planning_problem_id)

    @property
    def first(self) -> int:
        """Time step of the start."""
        return int(self.problem.initial_state.time_step)

    @property
    def last(self) -> int:
        """Time step after which the goal can no longer be reached."""
        return max(int(_interval(state.time_step)[1]) for state in self.problem.goal.state_list)

    def others(self, moment: int) -> dict[Hashable, Told]:
        """The vehicles on the road at a time step, and the obstacles: state and size by their numbers."""
        seen = dict[Hashable, Told]()
        for obstacle in self.scenario.dynamic_obstacles:
            number, there = int(obstacle.obstacle_id), told_at(obstacle, moment, float(self.scenario.dt))
            if there is not None:
                parts = cut(there) if has_sets(obstacle) else [there]
                seen |= {f"{number}, piece {k + 1}" if k else number: part for k, part in enumerate(parts)}
        there = come_near(seen.values(), self.road) if seen else ()
        return self._standing | {name: seen[name] for name, comes in zip(seen, there, strict=True) if comes}

    @cached_property
    def _standing(self) -> dict[Hashable, Told]:
        """The static obstacles on the road, long ones in several pieces."""
        found = dict[Hashable, Told]()
        for obstacle in self.scenario.static_obstacles:
            parts = pieces(obstacle.initial_state, obstacle.obstacle_shape)
            for k, there in enumerate(come_near(parts, self.road)):
                if there:
                    number = int(obstacle.obstacle_id)
                    found[f"{number}, piece {k + 1}" if len(parts) > 1 else number] = parts[k]
        return found

    def lane_of(self, lon: float, lat: float) -> int:
        """The lane at a place on the road."""
        return int(self.road.lane_at(lon, lat))

    def goal_from(self, lon: float, lat: float) -> Goal:
        """What the planner is asked for at a place on the road: the goal, but no change across a gap in the map."""
        goal, lane = self.goal, self.lane_of(lon, lat)
        wanted = min(goal.any_lane, key=lambda each: abs(each - lane), default=lane)
        if wanted == lane:
            return goal
        beside = lane + int(np.sign(wanted - lane))
        places = np.clip(lon + np.arange(-_BEHIND, _AHEAD), 0.1, float(self.road.length) - 0.1)[:, None]
        edges = self.road.edges_at(places[:, 0])
        centres = (edges[:, [lane, beside]] + edges[:, [lane + 1, beside + 1]]) / 2
        across = centres[:, :1] + np.linspace(0, 1, 30) * (centres[:, 1:] - centres[:, :1])
        on_map = contains_xy(self._surface, *self.road.to_map(*np.broadcast_arrays(places, across)))
        return goal if on_map.all() else replace(goal, lanes=lane, lat=None)

    @cached_property
    def _surface(self) -> BaseGeometry:
        """All lanelets, and between them what no one would call a gap."""
        parts = [part.polygon.shapely_object.buffer(_NO_GAP) for part in self.scenario.lanelet_network.lanelets]
        surface = unary_union(parts)
        prepare(surface)
        return surface

    @cached_property
    def goal(self) -> Goal:
        """Where the drive is to lead: of alternatives within reach that with the nearest lane, and the least turn."""
        start = self.problem.initial_state
        lon, lat = map(float, self.road.to_road(*start.position))
        lane = self.lane_of(lon, lat)

        def rank(goal: Goal) -> tuple[bool, int, float]:
            away = min((abs(lane - each) for each in goal.any_lane), default=0)
            return not within_reach(goal, lon, float(start.velocity)), away, abs(goal.turn)

        return min((goal for _, goal in self.goals), key=rank)

    @cached_property
    def goals(self) -> list[tuple[Any, Goal]]:
        """The states of the goal that can be driven to on this road, as commonroad-io reads them, and as goals.

        Raises:
            RecordingError: there is none.
        """
        found, problems = list[tuple[Any, Goal]](), list[RecordingError]()
        for state in self.problem.goal.state_list:
            try:
                found.append((state, self.goal_of(state)))
            except RecordingError as error:
                problems.append(error)
        if not found:
            raise problems[0]
        return found

    def goal_of(self, state: Any) -> Goal:
        """A goal from one of its states; its time counts from the start."""
        dt = float(self.scenario.dt)
        soonest, latest = (dt * (moment - self.first) for moment in _interval(state.time_step))
        speed = _interval(state.velocity) if state.has_value("velocity") else None
        goal = Goal(speed=speed, time=(soonest, latest))
        if not state.has_value("position"):
            return goal
        shape = shape_of(state.position)
        lon, middle, lat = self._extent(shape)
        if state.has_value("orientation"):
            low, high = _interval(state.orientation)
            turned = float(self.road.heading_to_road(middle, low))
            goal = replace(goal, heading=(turned, turned + high - low))
        centres = self.road.edges_at(middle)
        centres = (centres[:-1] + centres[1:]) / 2
        inside = intersects_xy(shape, *self.road.to_map(np.full(len(centres), middle), centres))
        lanes = tuple(np.flatnonzero(inside & self.road.has_lane(middle)).tolist())
        if len(lanes) > 1 or (lanes and lat[0] + _OFF_CENTRE <= centres[lanes[0]] <= lat[1] - _OFF_CENTRE):
            lanes, position = self._lanes_in(shape, lon, lanes)
            return replace(goal, position=position, lanes=lanes)
        lane = self.lane_of(middle, (lat[0] + lat[1]) / 2)
        aside = min(_OFF_CENTRE, (lat[1] - lat[0]) / 2)
        place = float(np.clip(centres[lane], lat[0] + aside, lat[1] - aside))
        return replace(goal, position=self._met(shape, lon, lane, place), lanes=lane, lat=place)

    def _lanes_in(
        self, shape: BaseGeometry, along: Interval, lanes: Collection[int]
    ) -> tuple[tuple[int, ...], Interval]:
        """Of some lanes the one that is aimed at and those that do as well, and where [m] their middles are in a shape.

        That is the one nearest to the start of those that are in it for long.
        """
        ways = {lane: self._met(shape, along, lane) for lane in lanes}
        own = self.lane_of(*self.road.to_road(*self.problem.initial_state.position))
        least = _MOST * max(last - first for first, last in ways.values())
        aimed, *others = sorted(lanes, key=lambda lane: (ways[lane][1] - ways[lane][0] < least, abs(lane - own)))
        found, (first, last) = [aimed], ways[aimed]
        least = _MOST * (last - first)
        for lane in others:
            begin, end = max(first, ways[lane][0]), min(last, ways[lane][1])
            if end - begin >= least:
                found.append(lane)
                first, last = begin, end
        return tuple(sorted(found)), (first, last)

    def _met(self, shape: BaseGeometry, along: Interval, lane: int, place: float | None = None) -> Interval:
        """Where [m] along the road the middle of a lane, or a place across the road [m], is in a shape."""
        lon = np.linspace(*along, max(2, round((along[1] - along[0]) / _STEP) + 1))
        lat = self.road.edges_at(lon)[:, lane : lane + 2].mean(axis=1) if place is None else np.full(len(lon), place)
        met = lon[intersects_xy(shape, *self.road.to_map(lon, lat))]
        if not len(met):
            return along
        (first, last), (begin, end) = along, met[[0, -1]].tolist()
        return first if begin <= first + _OBLIQUE else begin, last if end >= last - _OBLIQUE else end

    def _extent(self, shape: BaseGeometry) -> tuple[Interval, float, Interval]:
        """Extent of a shape along the road, a place there, and the extent across the road at that place, [m].

        The place is the middle if the shape is there, and else one of the part that comes next after the start.
        """
        along = self._along(shape)
        middle = float(np.mean(along))
        if across := self._across(shape, middle):
            return along, middle, across
        part = self._next_part(shape)
        along, (lon, lat) = self._along(part), map(float, self.road.to_road(*part.representative_point().coords[0]))
        middle = float(np.mean(along))
        if across := self._across(part, middle):
            return along, middle, across
        return along, lon, self._across(part, lon) or (lat, lat)

    def _along(self, shape: BaseGeometry) -> Interval:
        """Extent of a shape along the road [m]."""
        lon, _ = self.road.to_road(*get_coordinates(shape.convex_hull).T)
        first, last = np.clip((lon.min(), lon.max()), 0.0, float(self.road.length))
        return float(first), float(last)

    def _across(self, shape: BaseGeometry, lon: float) -> Interval | None:
        """Extent of a shape across the road at a place [m]; None: it is not there."""
        places = np.linspace(self.road.edges[0] - VERGE, self.road.edges[-1] + VERGE, 400)
        inside = places[intersects_xy(shape, *self.road.to_map(np.full(400, lon), places))]
        return (float(inside.min()), float(inside.max())) if len(inside) else None

    def _next_part(self, shape: BaseGeometry) -> BaseGeometry:
        """Of the parts of a shape on the road the nearest one that is not behind the start, if there is such a one."""
        on_road = shape.intersection(_surface_of(self.road).buffer(-_OFF_CENTRE))
        parts = [part for part in getattr(on_road, "geoms", [on_road]) if part.area > 0]
        if not parts:
            problem = self._why_not_on(shape)
            raise RecordingError(
                self.file, f"planning problem {self.number}: {problem}; choose another planning problem"
            )
        start = float(self.road.to_road(*self.problem.initial_state.position)[0])

        def way(part: BaseGeometry) -> tuple[bool, float]:
            first, last = self._along(part)
            return last < start, max(first - start, start - last)

        return min(parts, key=way)

    def _why_not_on(self, shape: BaseGeometry) -> str:
        """Why a shape is not on the road."""
        start, time = self.problem.initial_state, float(self.scenario.dt) * (self.last - self.first)
        way, most = shape.distance(Point(*start.position)), farthest(float(start.velocity), time)
        left = float(self.road.length - self.road.to_road(*start.position)[0])
        lanelets = self.scenario.lanelet_network.lanelets
        if route(lanelets, start.position, float(start.orientation), [shape]) is not None:
            if way > most:
                far = f"the goal is {way:.0f} m away"
                return f"{far}; from {start.velocity:g} m/s one gets {most:.0f} m in its {time:g} s at most"
            if way > left:
                ends = f"lanes lead to the goal, but a road can be drawn along them for {left:.0f} m only"
                return f"{ends}; expected no curves below {SMALLEST_RADIUS:g} m radius on the way"
        return "the goal is not on the road that the start is on"


class ProblemError(RecordingError):
    """A planning problem of a number that cannot be driven."""

    def __init__(self, error: RecordingError, number: int):
        """For a reason."""
        Exception.__init__(self, str(error))
        self.number = number


def read_problems(file: Path) -> Iterator[PlanningProblem | ProblemError]:
    """The planning problems of a scenario, or why one cannot be driven.

    Raises:
        RecordingError: the file cannot be read, or has no planning problem.
    """
    scenario, problems = open_scenario(file)
    if not problems.planning_problem_dict:
        raise RecordingError(file, "the scenario has no planning problem; choose another file")
    for number, problem in sorted(problems.planning_problem_dict.items()):
        try:
            with naming(file, f"planning problem {number}"):
                yield _problem(file, scenario, problem)
        except RecordingError as error:
            yield ProblemError(error, int(number))


def _problem(file: Path, scenario: Any, problem: Any) -> PlanningProblem:
    try:
        check_problem(problem, float(scenario.dt))
        problem.goal = with_narrow_headings(problem.goal)
        road = _road_of(scenario.lanelet_network, problem, float(scenario.dt))
        scenario = _without_ego(file, problem.initial_state)
        if not (tracks := tracks_of(scenario, road)).is_empty():
            check_vehicles(tracks, float(scenario.dt), road)
        return PlanningProblem(file, scenario, problem, road)
    except DataError as error:
        raise DataError(f"planning problem {problem.planning_problem_id}: {error}") from error


def _without_ego(file: Path, start: Any) -> Any:
    """The scenario without the obstacle that is the recorded ego, if it is among them, and what is a part of it.

    That is what overlaps it where both are first seen: a trailer may be a vehicle of its own.
    """
    scenario = open_scenario(file)[0]
    in_order(scenario)
    dt = float(scenario.dt)
    for ego in scenario.dynamic_obstacles:
        if (there := told_at(ego, start.time_step, dt)) is None:
            continue
        (x, y, speed, _), _ = there
        if abs(speed - start.velocity) < _SAME_SPEED and np.hypot(*((x, y) - start.position)) < _SAME_PLACE:
            scenario.remove_obstacle(
                [each for each in scenario.dynamic_obstacles if each is ego or begins_in(each, ego, dt)]
            )
            break
    refuse_unknown(scenario)
    return scenario


def _road_of(network: Any, problem: Any, dt: float) -> Road:
    """The first carriageway on which the start is, with the goal on it if there is such a one; as far as it matters.

    Lanes between which the map has a gap are beside each other only if the start is on no road else. Where most of the
    goal is not on that carriageway, the road along the border of a lane that ends on the way to it, or begins, is
    taken if there is more of the goal on it.
    """
    start, found, why = problem.initial_state, list[tuple[float, Road]](), list[tuple[float, str]]()
    across = list[str]()
    goals, heading = problem.goal.state_list, float(start.orientation)
    areas = [shape_of(each.position) for each in goals if each.has_value("position")]
    time = dt * (max(_interval(each.time_step)[1] for each in goals) - start.time_step)
    way = route(network.lanelets, start.position, heading, areas)
    through = (way.lanelets, way.goals) if way else ()
    limit = speed_limit(network, through[0] if through else ())
    for wrong in wrong_speed_limit(limit):
        raise DataError(wrong)
    near = partial(drawn_near, start.position, float(start.velocity), time, why=why)
    draws = [near(touching) for touching in (2 * _NO_GAP, TOUCHING)]

    def look_at(roads: Iterator[Road], enough: float) -> None:
        """Find those that the start is on, up to one with enough of the goal."""
        for road in () if found and found[-1][0] > enough else roads:
            lon, lat = road.to_road(*start.position)
            lane, turned = road.lane_at(lon, lat), road.heading_to_road(lon, heading)
            edges = road.edges_at(lon)[lane : lane + 2]
            there = edges[0] <= lat <= edges[1] and 0 <= lon <= road.length
            if there and abs(turned) >= np.pi / 4:
                across.append(f"; it heads {np.degrees(turned):.0f}° from a lane that it is in")
            elif there:
                surface = _surface_of(road)
                share = max((_share(area, surface) for area in areas), default=1.0)
                found.append((share, replace(road, speed_limit=limit)))
                if share > enough:
                    break

    try:
        for draw in draws:
            look_at(roads_of(network.lanelets, [], through, draw), 0.0)
        if way and (lanes := lanes_along_border(network.lanelets, way.starts, way.goals)):
            look_at(_drawn(draws, lanes), _MOST)
    except KeyError as error:
        raise DataError(f"a lanelet refers to {error}, which is not in the file; check the file") from error
    if not found:
        nearest = [problem for _, problem in sorted(why, key=itemgetter(0))[:1]]
        raise DataError("; ".join(["the start is on no road of the map", *nearest]) + "".join(across[:1]))
    return max(found, key=lambda each: each[0])[1]


def _share(area: BaseGeometry, surface: BaseGeometry) -> float:
    """Of an area, how much is on a surface."""
    return area.intersection(surface).area / area.area if area.area else float(surface.covers(area))


def _drawn(draws: Iterable[Callable[[list[DrawnLane]], Road]], lanes: list[DrawnLane]) -> Iterator[Road]:
    """The roads that some functions draw of lanes, but for those that bend too sharply."""
    for draw in draws:
        with suppress(DataError):
            yield draw(lanes)


def _surface_of(road: Road) -> BaseGeometry:
    """All lanes of a road on the map."""
    lon = np.linspace(0.0, float(road.length), max(2, round(float(road.length) / 2)))
    right, left = (np.stack(road.to_map(lon, road.edges_at(lon)[:, side]), axis=-1) for side in (0, -1))
    return Polygon(np.concatenate([right, left[::-1]])).buffer(0)


def _interval(value: Any) -> Interval:
    """The least and the largest value of an interval or a number of commonroad-io."""
    return float(getattr(value, "start", value)), float(getattr(value, "end", value))
