"""Roads that bend, with ramps and merges: `python benchmarks/roads.py FOLDER --predictor us101.safetensors`.

Every CommonRoad scenario in the folder is read, predicted with a predictor of boxes that was fitted elsewhere, and
driven in replay, each time in the place of another vehicle. Without a predictor they are only read. `--save roads`
keeps the table, which is that of docs/real-roads.md.
"""

import argparse
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from coverdrive.certificates.evaluation import evaluate
from coverdrive.errors import DataError, RecordingError
from coverdrive.planning.planner import MpcPlanner
from coverdrive.prediction.boxes.boxes import scored_by
from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.learning.samples import make_features
from coverdrive.prediction.predictor import Predictor
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.drives.outcome import Fault, Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.traffic.replay import ReplaySettings, ReplayTraffic, cut_scenarios
from results import save

READ = ("scenario", "lanes", "length", "bend", "radius", "limit", "vehicles", "rows left out")
TRIED = ("predicted", "missed", "driven", "contacts")
COLUMNS = (*READ, *TRIED)


def read_cells(file: Path) -> tuple[tuple[str, ...], Recording | None]:
    """What is read of a file, in the columns `READ`, and the recording; of one that is refused its name and why."""
    try:
        recording = read(file)[0]
    except RecordingError as error:
        return (file.stem, f"refused: {str(error).removeprefix(f'{file}: ')}"), None
    road, line = recording.road, recording.road.line
    assert line is not None
    shares = road.has_lane(np.linspace(0, road.length, 500)).mean(axis=0)
    radius = 1 / max(np.abs(line.curvature).max(), 1e-9)
    cells = (
        file.stem,
        " ".join("1" if share > 0.99 else f"{share:.2f}" for share in shares),
        f"{road.length:.0f}",
        f"{np.degrees(line.bend):.0f}",
        f"{radius:.0f}" if radius < 10_000 else "–",
        "–" if road.speed_limit is None else f"{road.speed_limit:.1f}",
        recording.table["vehicle"].n_unique(),
        recording.repairs.get("rows off the road", 0),
    )
    return tuple(map(str, cells)), recording


def predicted(recording: Recording, predictor: BoxPredictor) -> int:
    """How many boxes are predicted in all, once a second; all of them are finite and hold the body that is there."""
    time, boxes = recording.table["time"].to_numpy(), 0
    for moment in np.arange(time.min(), time.max() + 1e-6, 1.0):
        scene = recording.scene_at(float(moment))
        paths = predictor.predict(scene, recording.road)
        assert np.isfinite(paths.points).all() and np.isfinite(paths.half_sizes).all()
        assert (paths.half_sizes[:, 0] >= scene.half_sizes[paths.vehicle] - 1e-6).all()
        boxes += paths.points[:, 1:, 0].size
    return boxes


def missed(recording: Recording, predictor: BoxPredictor) -> tuple[int, int]:
    """Windows of 3 s in which a body left its boxes, and all windows."""
    try:
        segments = cut_segments([recording])
    except DataError:  # nobody is there for so long
        return 0, 0
    scored = scored_by(predictor.network.boxes_of(make_features([recording], segments)), segments, [recording])
    rate = evaluate(predictor.rule, scored).windows
    return rate.count, rate.total


def drives(recording: Recording, predictor: BoxPredictor, count: int, duration: float) -> list[Trace]:
    """Drives to the end of the recording, in the places of vehicles that stay for 3 s, or for all of it."""
    (scenario,) = cut_scenarios([recording])
    shortest = min(3.0, (len(scenario.states) - 2) * scenario.dt)
    traffic = ReplayTraffic([scenario], ReplaySettings(place="replace", shortest=shortest))
    settings, planner = EpisodeSettings(duration=duration), MpcPlanner()
    return [run_episode(predictor, planner, traffic, settings, 0, seed) for seed in range(count)]


def tried_cells(recording: Recording, predictor: BoxPredictor, count: int, duration: float) -> tuple[str, ...]:
    """What comes of predicting and driving, in the columns `TRIED`."""
    left, windows = missed(recording, predictor)
    outcomes = [trace.outcome for trace in drives(recording, predictor, count, duration)]
    hit = [outcome for outcome in outcomes if outcome.kind is not Kind.FINISHED]
    own = sum(outcome.at_fault is Fault.EGO for outcome in hit)
    return (
        str(predicted(recording, predictor)),
        f"{left} of {windows}" if windows else "–",
        f"{sum(outcome.time for outcome in outcomes):.0f} s",
        f"{len(hit)} ({own} own)" if hit else "0",
    )


def table(rows: Iterable[Sequence[str]]) -> str:
    """Lines of a table in Markdown."""
    lines = [COLUMNS, ["---"] * len(COLUMNS), *rows]
    return "\n".join(f"| {' | '.join([*row, *[''] * (len(COLUMNS) - len(row))])} |" for row in lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--predictor", type=Path)
    parser.add_argument("--drives", type=int, default=4)
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    chosen = parser.parse_args()
    predictor = Predictor.load(chosen.predictor) if chosen.predictor else None
    if predictor is not None and not isinstance(predictor, BoxPredictor):
        raise SystemExit(f"{chosen.predictor} has base trajectories; give a predictor of boxes")
    rows: list[tuple[str, ...]] = []
    for file in sorted(chosen.folder.glob("*.xml")):
        cells, recording = read_cells(file)
        if predictor is not None and recording is not None:
            cells = (*cells, *tried_cells(recording, predictor, chosen.drives, chosen.duration))
        rows.append(cells)
    print(table(rows))
    if chosen.out is not None:
        chosen.out.write_text(json.dumps([dict(zip(COLUMNS, row, strict=False)) for row in rows], indent=2), "utf-8")
    if chosen.save:
        save(chosen.save, {"rows": rows})


if __name__ == "__main__":
    main()
