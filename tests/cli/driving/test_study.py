"""What ``coverdrive study`` prints of drives."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from simulation_fakes import fakes

from coverdrive.certificates.bounds import rate_limit
from coverdrive.certificates.drives import anytime_limit
from coverdrive.cli.driving.study import study_and_print
from coverdrive.config import StudySettings
from coverdrive.percentages import at_most
from coverdrive.simulation.studies.study import Study


def test_a_study_that_went_on_proves_what_holds_at_any_time(tmp_path: Path) -> None:
    results: Any = SimpleNamespace(certified=SimpleNamespace(planned_against=()), dialled=None)
    for trials, limit in ((3, rate_limit(0.99, 0, 3)), (4, anytime_limit(0, 4, 0.99)), (4, anytime_limit(0, 4, 0.99))):
        told = study_and_print(Study(fakes(), tmp_path), results, StudySettings(trials=trials, workers=1))
        assert f"at most {at_most(limit)} of" in told["proved"]
