"""A car's life: drives one after another, in which an adaptive belief remembers (`coverdrive.prediction.adaptive`)."""

import numpy as np
import polars as pl

from coverdrive.errors import SettingError, StartError, during
from coverdrive.prediction.adaptive import Adaptive, near
from coverdrive.progress import done, heard_by, stage
from coverdrive.simulation.drives.episode import run_episode
from coverdrive.simulation.measures.misses import find_windows
from coverdrive.simulation.measures.trial import SCHEMA, Row, measure
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.studies.setup import Setup


def life(setup: Setup, drives: int, first: int = 0) -> pl.DataFrame:
    """Drive trials of a setup one after another in this process; what its belief learns in one it knows in the next.

    The belief of the setup itself learns, so that another life with it, in other traffic, goes on from there. Any
    belief may be given, to compare. The same belief and setup give the same life.

    Args:
        setup: of the drives.
        drives: their number.
        first: number of the first trial.

    Returns:
        One row for each drive that could start: those of `coverdrive.simulation.measures.trial.COLUMNS`, and

        - ``near``: windows of vehicles near the ego that were seen to the end of the horizon
        - ``near_missed``: those of them that were missed, as told from the trace afterwards
        - ``scale``: λ after the drive; of a belief without one null
        - ``bound``: of the average loss of an adaptive belief until then, if no window of the largest λ was lost

    Raises:
        SettingError: there is no drive, or an adaptive belief has another period than the simulation.
    """
    belief, planner, traffic = setup.participants()
    if drives < 1:
        raise SettingError(f"a life has at least one drive, got {drives}")
    rows = list[Row]()
    with stage(f"drives of a life ({drives})"):
        for trial in range(first, first + drives):
            seed = np.random.SeedSequence(setup.seed, spawn_key=(trial,))
            try:
                with heard_by(None), during(f"in trial {trial} of seed {setup.seed}"):
                    trace = run_episode(belief, planner, traffic, setup.episode, setup.vehicles_of(trial), seed)
            except StartError:
                continue
            windows, beside = find_windows(trace), near(trace.scene, trace.road, EGO)[:-1]
            rows.append(
                measure(trace, setup.seed, trial)
                | {
                    "near": int((windows.seen & beside).sum()),
                    "near_missed": int((windows.missed & beside).sum()),
                    "scale": getattr(belief, "scale", None),
                    "bound": belief.run.bound if isinstance(belief, Adaptive) else None,
                }
            )
            done(trial - first + 1, drives)
    more = {"near": pl.Int64(), "near_missed": pl.Int64(), "scale": pl.Float64(), "bound": pl.Float64()}
    return pl.DataFrame(rows, schema=SCHEMA | more)
