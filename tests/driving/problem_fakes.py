"""Planning problems of a drawn scenario, as texts."""

import re
from pathlib import Path

import numpy as np
from recordings_fakes import RADIUS, TURN, driving, on_map, scenario, state, three_lanes

TRAFFIC = driving(100, 90.0, -1.75, 14.0, 60) + driving(101, 20.0, -9.0, 10.0, 30)


def problem(*goals: str, at: float = 20.0, left: float = -1.75, speed: float = 14.0) -> str:
    return f'<planningProblem id="7">{state(at, left, speed, 0, "initialState")}{"".join(goals)}</planningProblem>'


def between(name: str, low: float, high: float) -> str:
    return f"<{name}><intervalStart>{low}</intervalStart><intervalEnd>{high}</intervalEnd></{name}>"


def box(at: float, left: float, length: float = 6.0, width: float = 2.0) -> str:
    x, y = on_map(np.array([at]), left)[0]
    return (
        f"<position><rectangle><length>{length}</length><width>{width}</width><orientation>{TURN + at / RADIUS}"
        f"</orientation><center><x>{x}</x><y>{y}</y></center></rectangle></position>"
    )


def goal(*parts: str, first: int = 50, last: int = 60) -> str:
    return f"<goalState>{between('time', first, last)}{''.join(parts)}</goalState>"


def in_sets(vehicle: str, *parts: range, length: float = 6.0, speed: float = 14.0, widens: float = 0.1) -> str:
    """A vehicle, 90 m ahead at first, then in sets that go on at a speed [m/s] and get wider by so much a step [m]."""
    sets = list[str]()
    for moment in (moment for part in parts for moment in part):
        place = box(90.0 + 0.1 * speed * moment, -1.75, length, 2.0 + widens * moment)
        shape = place.replace("position>", "shape>")
        sets.append(f"<occupancy>{shape}<time><exact>{moment}</exact></time></occupancy>")
    return re.sub("<trajectory>.*</trajectory>", f"<occupancySet>{''.join(sets)}</occupancySet>", vehicle)


def written(folder: Path, *goals: str, name: str = "USA_Test-1_1_T-1", traffic: str = TRAFFIC, **start: float) -> Path:
    """A scenario with one planning problem of these goals."""
    path = folder / f"{name}.xml"
    path.write_text(scenario(three_lanes(), traffic + problem(*goals, **start)))
    return path
