"""A large raw CSV of the NGSIM portal to a certified predictor: `python benchmarks/portal.py [--rows 4800000]`.

Generated traffic, about 200 vehicles at a time on six lanes in three recording periods, is written as the portal has
it: 25 columns, feet, front centres, rows in no order, positions measured with noise of 0.1 m. The file is kept
(`--file`) for the next run. Then follows what `coverdrive fit --recording FILE` does; every stage has its wall time,
processor time and largest resident memory (Linux).
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import polars as pl

FOOT = 0.3048
NOISE, PERIODS = 0.1, 3
BLOCK, STRETCH, STRETCHES, ROAD_WIDTH = 60.0, 3000.0, 4, 10.8
"""[s] that a platoon is seen for, [m] of road for it, number of such stretches, and [m] width of what it uses"""
ROWS_OF_SCENE = 13_000
"""at least; most have 15,000"""
START = 1_118_846_980_200
"""[ms] POSIX time of the first frame"""
PAUSE = 300.0
"""[s] between two periods"""
COLUMNS = [
    *("Vehicle_ID", "Frame_ID", "Total_Frames", "Global_Time", "Local_X", "Local_Y", "Global_X", "Global_Y"),
    *("v_length", "v_Width", "v_Class", "v_Vel", "v_Acc", "Lane_ID", "O_Zone", "D_Zone", "Int_ID", "Section_ID"),
    *("Direction", "Movement", "Preceding", "Following", "Space_Headway", "Time_Headway", "Location"),
]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=4_800_000)
    parser.add_argument("--file", type=Path, default=Path(tempfile.gettempdir()) / "portal.csv")
    parser.add_argument("--steps", type=int, help="of training, at the most")
    parser.add_argument("--only-write", action="store_true", help="make the file and fit nothing")
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args()
    if chosen.only_write:
        write_portal_csv(chosen.file, chosen.rows)
        return
    if not chosen.file.exists():  # in a process of its own, whose memory does not count
        sizes = ("--rows", str(chosen.rows), "--file", str(chosen.file))
        subprocess.run([sys.executable, __file__, *sizes, "--only-write"], check=True)
    result = fitted(chosen.file, chosen.steps)
    print(f"{'stage':20} {'wall':>10} {'processor':>10} {'peak':>11}")
    for name, row in result["stages"].items():
        print(f"{name:20} {row['wall s']:8.1f} s {row['processor s']:8.1f} s {row['peak GB']:8.2f} GB")
    print({name: value for name, value in result.items() if name != "stages"})
    if chosen.out is not None:
        chosen.out.write_text(json.dumps(result, indent=2), encoding="utf-8")


def write_portal_csv(path: Path, rows: int) -> None:
    """Platoons side by side and behind one another, and again and again, until there are enough rows."""
    from coverdrive.simulation.drivers.generated import GeneratedSettings, generate

    settings = GeneratedSettings(scenes=math.ceil(rows / ROWS_OF_SCENE), duration=BLOCK)
    places = 2 * STRETCHES  # of platoons at a time
    blocks = math.ceil(settings.scenes / places)
    passed = list[pl.DataFrame]()
    for number, recording in enumerate(generate(settings)):
        block, stretch, side = number // places, number % places // 2, number % 2
        period = block * PERIODS // blocks
        clock = pl.col("time") + block * BLOCK + stretch * BLOCK / STRETCHES + period * PAUSE
        lon, lat = pl.col("lon") + stretch * STRETCH, pl.col("lat") + side * ROAD_WIDTH
        passed.append(recording.table.with_columns(lon=lon, lat=lat, period=pl.lit(period), clock=clock))
    seen = pl.concat(passed)[:rows].sample(fraction=1.0, shuffle=True, seed=0)
    random = np.random.default_rng(0)
    lon, lat = (seen[name].to_numpy() + NOISE * random.standard_normal(rows) for name in ("lon", "lat"))
    feet = {"v_length": pl.col("length"), "v_Width": pl.col("width"), "v_Vel": pl.col("speed")}
    feet |= {
        "Local_X": pl.lit(pl.Series(2 * ROAD_WIDTH - lat)),
        "Local_Y": pl.lit(pl.Series(lon)) + pl.col("length") / 2,
    }
    in_period = pl.col("vehicle") - pl.col("vehicle").min().over("period") + 1
    table = seen.select(
        Vehicle_ID=in_period,
        Frame_ID=((pl.col("clock") - pl.col("clock").min().over("period")) * 10).round().cast(pl.Int64) + 1,
        Total_Frames=pl.len().over("vehicle"),
        Global_Time=START + (pl.col("clock") * 10).round().cast(pl.Int64) * 100,
        Global_X=pl.lit(6451137.641),
        Global_Y=pl.lit(1873344.962),
        **{name: (metres / FOOT).round(3) for name, metres in feet.items()},
        v_Class=pl.when(pl.col("length") > 8).then(3).otherwise(2),
        Lane_ID=6 - (pl.col("lat") / 3.6).floor().cast(pl.Int64).clip(0, 5),
        **{name: pl.lit(0) for name in ("v_Acc", "Preceding", "Following", "Space_Headway", "Time_Headway")},
        Location=pl.lit("us-101"),
    )
    empty = {name: pl.lit(None, pl.Int64) for name in COLUMNS if name not in table.columns}
    table.with_columns(**empty).select(COLUMNS).write_csv(path)


def fitted(path: Path, steps: int | None) -> dict[str, object]:
    """What `coverdrive fit` does, stage by stage."""
    begun = time.perf_counter()
    from coverdrive.config import Experiment
    from coverdrive.prediction.fit import fit
    from coverdrive.progress import heard_by
    from coverdrive.results import Results
    from coverdrive.simulation.roads.places import recorded_place

    stages = Stages(begun)
    with heard_by(lambda name, _: stages.enter(name)), tempfile.TemporaryDirectory() as folder:
        experiment = Experiment().updated({"prediction": {"boxes": {"most_steps": steps}}})
        recordings = experiment.recordings([path])
        stages.enter("place")
        like = recorded_place(recordings)
        found = fit(recordings, experiment.prediction, experiment.seed)
        stages.enter("saving")
        Results(folder).save_fit(experiment, found, "recorded", like)
        stages.enter("")
    certificate, missed = found.predictor.calibrated, found.evaluation.missed(found.predictor.calibrated.unit)
    return {
        "stages": stages.rows,
        "wall s": sum(row["wall s"] for row in stages.rows.values()),
        "processor s": sum(row["processor s"] for row in stages.rows.values()),
        "peak GB": max(row["peak GB"] for row in stages.rows.values()),
        "rows": sum(len(recording.table) for recording in recordings),
        "windows": len(found.segments),
        "vehicles": len(np.unique(found.segments.vehicle)),
        "area m2": found.occupied.mean,
        "of constant velocity": found.occupied.ratio,
        "missed": [missed.value, missed.low, missed.high],
        "certificate": certificate.sentence,
    }


class Stages:
    """Wall time, processor time and largest memory of every stage, the first from the start of the process on."""

    def __init__(self, begun: float):
        self.rows: dict[str, dict[str, float]] = {}
        self._name, self._begun = "imports", (begun, 0.0)

    def enter(self, name: str) -> None:
        """End a stage and begin another one, if it is another one."""
        if name == self._name:
            return
        now = time.perf_counter(), time.process_time()
        status = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines())
        wall, processor = (end - start for start, end in zip(self._begun, now, strict=True))
        row = {"wall s": wall, "processor s": processor, "peak GB": int(status["VmHWM"].split()[0]) * 1024 / 1e9}
        self.rows[self._name] = row
        Path("/proc/self/clear_refs").write_text("5")  # the largest memory counts from here on
        self._name, self._begun = name, now


if __name__ == "__main__":
    main()
