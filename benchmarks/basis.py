"""Time of the greedy cover against plain NumPy: `python benchmarks/basis.py [--out basis.json]`.

The baseline is the textbook: the dense matrix of all distances, and the gain of every candidate recounted in every
step. It chooses among all segments; `coverdrive` is timed with all of them as candidates, which gives the same gains,
and with its default of 4096. Segments are made up: an acceleration, a change of it, and a move across the road.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.greedy import greedy_cover

EPSILON = 0.75
FULL = 160_000


def scaled_segments(count: int, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    elapsed = 0.5 * np.arange(7)
    acceleration, jerk, move = random.normal(0, [[1.0], [0.3], [0.7]], (3, count))[..., None]
    lon = acceleration * elapsed**2 / 2 + jerk * elapsed**3 / 6
    lat = move * (1 - np.cos(np.pi * elapsed / 3))
    points = np.stack([lon, lat], axis=-1)
    return Basis(points, radius=EPSILON, aspect=4.0, growth=1.0, step=0.5).scaled(points)


def dense_numpy_greedy(scaled: np.ndarray, epsilon: float) -> list[int]:
    near = np.array([(((scaled - one) ** 2).sum(-1) <= epsilon**2).all(-1) for one in scaled])
    uncovered = np.ones(len(scaled), dtype=bool)
    chosen = []
    while uncovered.any():
        chosen.append(int(near[:, uncovered].sum(1).argmax()))
        uncovered &= ~near[chosen[-1]]
    for base in chosen[::-1]:
        others = [other for other in chosen if other != base]
        if near[others].any(0).all():
            chosen = others
    return chosen


def timed(work, *arguments) -> dict[str, float]:
    start = time.perf_counter()
    bases = len(work(*arguments))
    return {"seconds": time.perf_counter() - start, "bases": bases}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--segments", type=int, default=20_000)
    parser.add_argument("--full", type=int, default=FULL)
    parser.add_argument("--out", type=Path, default=Path("basis.json"))
    arguments = parser.parse_args()
    scaled, full = scaled_segments(arguments.segments), scaled_segments(arguments.full)
    result = {
        "epsilon": EPSILON,
        "segments": len(scaled),
        "dense NumPy greedy": timed(dense_numpy_greedy, scaled, EPSILON),
        "coverdrive, all candidates": timed(greedy_cover, scaled, EPSILON, len(scaled)),
        "coverdrive": timed(greedy_cover, scaled, EPSILON),
        "full segments": len(full),
        "coverdrive, full": timed(greedy_cover, full, EPSILON),
    }
    baseline = result["dense NumPy greedy"]["seconds"]
    for name in ("coverdrive, all candidates", "coverdrive"):
        result[name]["times faster"] = baseline / result[name]["seconds"]
    text = json.dumps(result, indent=2)
    arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
