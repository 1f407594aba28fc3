"""How near does the ego come to others? `python benchmarks/manners.py RESULTS [--drives 100] [--out manners.json]`.

On equal seeds: our planner with every kind of manners, and IDM with MOBIL; beside them recorded drivers, if recordings
are named. Of every distance the 5 % and 50 % quantiles, of the least one of a drive and of all moments in which there
is somebody; of recorded drivers a drive is a track of at least 5 s.
"""

import argparse
import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

import coverdrive
from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.distances import Kept, kept
from coverdrive.league.entrants import Known, Place, Seat, entrant
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.rules.manners import MannersSettings
from coverdrive.results import Results
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.studies.setup import Setup

VEHICLES = {"drivers": (3, 4, 5, 6, 7), "set-sampling": (3, 4, 5, 6, 7), "aggressive": (8, 9, 10, 11, 12)}
_SHORTEST = 5.0


def quantiles(drives: list[Kept]) -> dict[str, Any]:
    """Of every distance, of the least one of a drive and of all moments."""
    found: dict[str, Any] = {}
    for name in Kept._fields:
        values = [getattr(each, name).ravel() for each in drives]
        moments = np.concatenate(values)
        found[name] = {
            "least of a drive": np.quantile([each.min() for each in values], (0.05, 0.5), method="lower").tolist(),
            "all moments": np.quantile(moments[np.isfinite(moments)], (0.05, 0.5)).tolist(),
        }
    close = sum(each.time_to_collision.min() < 1 for each in drives)
    return found | {"drives": len(drives), "within 1 s of collision": close / len(drives)}


def recorded(files: list[Path]) -> dict[str, Any]:
    """Of the tracks of recordings."""
    drives: list[Kept] = []
    for each in coverdrive.read(files):
        frames = each.frames()
        parts = [kept(scene, each.road, np.arange(scene.vehicles)) for scene, _ in frames.every(1)]
        together = Kept(*(np.concatenate(values) for values in zip(*parts, strict=True)))
        for vehicle in np.unique(frames.vehicle[frames.vehicle >= 0]):
            there = frames.vehicle == vehicle
            if there.sum() * each.dt >= _SHORTEST:
                drives.append(Kept(*(values[there] for values in together)))
    return quantiles(drives)


def driven(setup: Setup, drives: int) -> dict[str, Any]:
    """Of the ego in drives."""
    participants, rows, found = setup.participants(), [], []
    for trial in range(drives):
        trace = setup.drive(trial, participants)
        rows.append(measure(trace, setup.seed, trial))
        found.append(kept(trace.scene, trace.road, np.array([EGO])))
    table = pl.DataFrame(rows, infer_schema_length=None)
    collisions = int((table["kind"] != Kind.FINISHED.value).sum())
    means = ("mean_speed", "share_unsafe", "jerk_longitudinal", "jerk_lateral")
    return quantiles(found) | {
        "collisions": collisions,
        "collisions, 95 %": clopper_pearson(collisions, drives),
        **{name: float(table[name].to_numpy().mean()) for name in means},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, help="folder of a fit")
    parser.add_argument("--traffics", nargs="+", choices=VEHICLES, default=["drivers", "aggressive"])
    parser.add_argument("--drives", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--recording", type=Path, nargs="*", default=[])
    parser.add_argument("--out", type=Path, default=Path("manners.json"))
    given = parser.parse_args()
    results = Results(given.results)
    predictor, planner = results.predictor, results.experiment.planner
    table: dict[str, Any] = {"recorded": recorded(given.recording)} if given.recording else {}
    known = Known(predictor, "", "", planner)
    for traffic in given.traffics:
        setup = Setup(predictor, traffic=traffic, vehicles=VEHICLES[traffic], seed=given.seed)
        seats = {
            f"ours, {like}": Seat(predictor, partial(MpcPlanner, planner.model_copy(update={"manners": manners})))
            for like in ("human", "regulation", "paper")
            if (manners := MannersSettings.model_validate(planner.manners.model_dump() | {"like": like}))
        }
        for name, seat in {**seats, "IDM and MOBIL": entrant("idm-mobil")(known, Place(planner))}.items():
            drive = replace(setup, predictor=seat.belief, planner=seat.planner, sampled=predictor)
            table[f"{traffic}: {name}"] = driven(drive, given.drives)
            given.out.write_text(json.dumps(table, indent=2), encoding="utf-8")
            found = table[f"{traffic}: {name}"]
            print(f"{traffic}: {name}: {found['collisions']} collisions, {found['mean_speed']:.1f} m/s, "
                  f"headway {found['headway']['all moments']}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
