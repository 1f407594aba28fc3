"""Scenarios with random damage are driven, or are rows with a reason; nothing else happens, and no problem is lost.

Most are read, and asked who is where; every so many is driven to the end.
"""

import os
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from driving_fakes import PREDICTOR
from mutations import changed
from problem_fakes import TRAFFIC, between, box, goal, in_sets, written
from recordings_fakes import driving

from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.solved import SCHEMA, solve
from coverdrive.errors import CoverdriveError

pytestmark = pytest.mark.usefixtures("unjudged")

MUTATIONS = int(os.environ.get("COVERDRIVE_MUTATIONS", "20000")) // 4
"""In the slow test"""

EVERY = 40
"""One of so many is driven"""

GOALS = (
    goal(between("velocity", 0.0, 60.0), first=3, last=4),
    goal(box(26.0, -1.75, length=12.0), between("orientation", 0.0, 1.5), first=2, last=4),
)

SETS = in_sets(driving(102, 90.0, -1.75, 14.0, 5), range(1, 5))


def looked_at(path: Path) -> int:
    """How many problems of a scenario can be driven."""
    count = 0
    for problem in read_problems(path):
        if isinstance(problem, PlanningProblem):
            count += 1
            told = [told for moment in (0, 5, 60) for told in problem.others(moment).values()]
            assert np.isfinite([(*pose, *size) for pose, size in told]).all()
            assert problem.goal.time is not None and problem.last >= problem.first
    return count


def tried(count: int, folder: Path, seed: int) -> tuple[int, int]:
    """How many of ``count`` damaged scenarios can be driven, and how many are refused."""
    path, driven, refused = written(folder, *GOALS, traffic=TRAFFIC + SETS), 0, 0
    whole = path.read_bytes()
    for number in range(count):
        random = np.random.default_rng([seed, number])
        path.write_bytes(changed(path.name, whole, random))
        try:
            driven += looked_at(path) > 0
            if number % EVERY == 0:
                pl.DataFrame([each.row for each in solve(path, PREDICTOR)], schema=SCHEMA)
        except CoverdriveError as error:
            refused += 1
            assert path.name in str(error) and len(str(error)) < 20_000, (seed, number)
        except BaseException as error:
            error.add_note(f"mutation {number} with the seed {seed}")
            raise
    return driven, refused


def test_damaged_scenarios_are_driven_or_refused(tmp_path: Path):
    driven, refused = tried(40, tmp_path, seed=1)
    assert driven > 0 and refused > 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 6))
def test_many_damaged_scenarios_are_driven_or_refused(seed: int, tmp_path: Path):
    print(f"seed {seed}: {tried(MUTATIONS // 4, tmp_path, seed)} driven and refused")
