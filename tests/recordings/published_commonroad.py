"""Writes generated traffic as CommonRoad scenarios, 2018b and 2020a, by the formats' descriptions alone."""

from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
import polars as pl
from published_formats import EDGES, LENGTH, MEDIAN, WIDTH, Truth, placed

Version = Literal["2018b", "2020a"]


def write_commonroad(folder: Path, real: Truth, version: Version = "2020a", degrees: float = 30.0) -> Path:
    """``DEU_Generated-1_1_T-1.xml``: as many carriageways as there are, of three lanes of two lanelets each."""
    turn = np.radians(degrees)
    rows = placed(real, degrees).sort("vehicle", "frame")
    lanelets = "".join(_carriageway(turn, number) for number in range(len(real.tables)))
    obstacles = "".join(_obstacle(own, version) for own in rows.partition_by("vehicle", maintain_order=True))
    about = {
        "2018b": ('tags="highway"', ""),
        "2020a": (
            "",
            "<location><geoNameId>1</geoNameId><gpsLatitude>0</gpsLatitude><gpsLongitude>0</gpsLongitude></location>"
            "<scenarioTags><highway/></scenarioTags>",
        ),
    }
    attribute, head = about[version]
    path = folder / "DEU_Generated-1_1_T-1.xml"
    path.write_text(
        f'<?xml version="1.0" encoding="utf-8"?><commonRoad commonRoadVersion="{version}" '
        'benchmarkID="DEU_Generated-1_1_T-1" date="2020-01-01" author="a" affiliation="b" source="c" '
        f'timeStepSize="{real.dt:g}" {attribute}>{head}{lanelets}{obstacles}</commonRoad>'
    )
    return path


def _carriageway(turn: float, number: int) -> str:
    """Its lanes from the right one on; the second carriageway is driven the other way."""
    text, middle = "", LENGTH / 2
    for lane, (right, left) in enumerate(pairwise(EDGES)):
        for part, ends in enumerate(((-10.0, middle), (middle, LENGTH + 10.0))):
            own = 100 * (number + 1) + 10 * lane + part
            bounds = "".join(
                f"<{side}Bound>{_line(turn, number, ends, edge)}</{side}Bound>"
                for side, edge in (("left", left), ("right", right))
            )
            links = f'<predecessor ref="{own - 1}"/>' if part else f'<successor ref="{own + 1}"/>'
            links += f'<adjacentLeft ref="{own + 10}" drivingDir="same"/>' if lane < 2 else ""
            links += f'<adjacentRight ref="{own - 10}" drivingDir="same"/>' if lane > 0 else ""
            text += f'<lanelet id="{own}">{bounds}{links}</lanelet>'
    return text


def _line(turn: float, number: int, ends: tuple[float, float], edge: float) -> str:
    """Points along a lane edge in its direction of travel."""
    along = np.linspace(*ends, 20)
    u, v = (along, edge) if number == 0 else (LENGTH - along, 2 * WIDTH + MEDIAN - edge)
    x, y = u * np.cos(turn) - v * np.sin(turn), u * np.sin(turn) + v * np.cos(turn)
    return "".join(f"<point><x>{a:.4f}</x><y>{b:.4f}</y></point>" for a, b in zip(x, y, strict=True))


def _obstacle(rows: pl.DataFrame, version: Version) -> str:
    first = rows.row(0, named=True)
    kind = f"<type>{'truck' if first['truck'] else 'car'}</type>"
    size = f"<length>{first['length']:.3f}</length><width>{first['width']:.3f}</width>"
    states = [_state(row, "state" if k else "initialState") for k, row in enumerate(rows.iter_rows(named=True))]
    inside = f"{kind}<shape><rectangle>{size}</rectangle></shape>{states[0]}<trajectory>{''.join(states[1:])}"
    inside += "</trajectory>"
    number = 1000 + first["vehicle"]
    if version == "2018b":
        return f'<obstacle id="{number}"><role>dynamic</role>{inside}</obstacle>'
    return f'<dynamicObstacle id="{number}">{inside}</dynamicObstacle>'


def _state(row: dict[str, float], tag: str) -> str:
    return (
        f"<{tag}><position><point><x>{row['x']:.4f}</x><y>{row['y']:.4f}</y></point></position>"
        f"<orientation><exact>{np.arctan2(row['vy'], row['vx']):.4f}</exact></orientation>"
        f"<time><exact>{row['frame'] - 1:.0f}</exact></time>"
        f"<velocity><exact>{row['speed']:.4f}</exact></velocity></{tag}>"
    )
