"""Positions on the map to a road that bends: `python benchmarks/road_frame.py [--points 1000000] [--out frame.json]`.

The baseline is commonroad-clcs (extra test) on the same curve as a polyline of points 0.5 m apart.
"""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from commonroad_clcs.pycrccosy import CurvilinearCoordinateSystem

from coverdrive.reference_line import ReferenceLine


def timed(action: Callable[[], Any], points: int) -> tuple[Any, float]:
    """What an action gives, and its microseconds a point."""
    begun = time.perf_counter()
    found = action()
    return found, (time.perf_counter() - begun) / points * 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--length", type=float, default=2000.0)
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args()
    way = np.linspace(0.0, chosen.length, round(chosen.length) + 1)
    line = ReferenceLine(np.zeros(2), 0.3, np.sin(way / 60) / 150 + np.sin(way / 23) / 300, chosen.length)
    random = np.random.default_rng(0)
    lon, lat = random.uniform([0, -15], [chosen.length, 15], (chosen.points, 2)).T
    line.to_road(*line.to_map(lon[:1], lat[:1]))  # compiles
    (x, y), to_map = timed(lambda: line.to_map(lon, lat), chosen.points)
    found, to_road = timed(lambda: line.to_road(x, y), chosen.points)

    beyond = np.arange(-60.0, chosen.length + 60.25, 0.5)
    other = CurvilinearCoordinateSystem([*np.stack(line.to_map(beyond, 0 * beyond), axis=-1)], 40.0, 0.01)
    some = [*np.stack([x, y], axis=-1)[:20_000]]
    theirs, clcs = timed(lambda: other.convert_list_of_points_to_curvilinear_coords(some, 1), len(some))
    start = other.convert_to_curvilinear_coords(0.0, 0.0)[0]
    apart = np.abs(np.array(theirs) - [start, 0.0] - np.stack(found, axis=-1)[: len(some)]).max(axis=0)
    result = {
        "microseconds a point": {"to_road": to_road, "to_map": to_map, "commonroad-clcs": clcs},
        "times faster": clcs / to_road,
        "there and back [m]": float(np.abs(np.stack(found) - np.stack([lon, lat])).max()),
        "apart from commonroad-clcs (lon, lat) [m]": apart.tolist(),
    }
    print(json.dumps(result, indent=2))
    if chosen.out is not None:
        chosen.out.write_text(json.dumps(result, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
