"""What the CommonRoad drivability checker says of a drive: collisions, the road, the vehicle model, start and goal.

The checker is the extra ``commonroad``. It judges the road by a triangulation where the package ``triangle`` is
installed, as the CommonRoad server does; without it, and where it comes to no end, by rectangles.
"""

import atexit
import os
import pickle
import subprocess
import sys
from copy import deepcopy
from importlib.util import find_spec
from typing import Any

import numpy as np

from coverdrive.driving.solving import Drive

FARTHEST = 1e5
"""[m] from the origin of the map from which on a drive is judged where it is at the origin: the triangulation knows too
few digits"""

_CALL = [sys.executable, "-m", "coverdrive.driving.judge"]
_judges = dict[int, subprocess.Popen[bytes]]()
"""of each process that has one"""


def refusal(drive: Drive) -> str | None:
    """Why the drivability checker refuses a drive; empty if it accepts it, None if it is not installed, or cannot say.

    Raises:
        RuntimeError: what the checker has raised.
    """
    if find_spec("commonroad_dc") is None:
        return None
    scenario, problem, solved = drive.problem.scenario, drive.problem.problem, drive.solution()
    if np.abs(problem.initial_state.position).max() > FARTHEST:
        back = -problem.initial_state.position
        scenario, problem = deepcopy((scenario, problem))
        for part in (scenario, problem, solved.trajectory):
            part.translate_rotate(back, 0.0)
    for triangulated in (True, False) if find_spec("triangle") else (False,):
        try:
            answer = _asked(scenario, problem, solved, triangulated)
        except (EOFError, BrokenPipeError):  # it has ended the judge
            continue
        if isinstance(answer, RuntimeError):
            raise answer
        return str(answer)
    return None


def _asked(*question: Any) -> Any:
    """The answer of this process's judge, which is called if there is none."""
    judge = _judges.get(os.getpid())
    if judge is None or judge.poll() is not None:
        judge = _judges[os.getpid()] = subprocess.Popen(
            _CALL, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
        atexit.register(_dismiss, judge)
    assert judge.stdin is not None and judge.stdout is not None
    try:
        pickle.dump(question, judge.stdin)
        judge.stdin.flush()
        return pickle.load(judge.stdout)
    except BaseException:  # it has ended, or is asked by nobody any more
        _dismiss(judge)
        raise


def _dismiss(judge: subprocess.Popen[bytes]) -> None:
    judge.kill()
    judge.communicate()
