"""The traffics by name."""

import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

from coverdrive.cli.shared.options import TrafficName
from coverdrive.errors import SettingError
from coverdrive.simulation.traffic.registry import NAMES, usual


def test_the_command_knows_every_traffic() -> None:
    (choices, *_), *_ = (get_args(each) for each in get_args(TrafficName)[:1])
    assert set(get_args(choices)) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_gives_its_settings(name: str) -> None:
    assert usual(name).kind == name


def test_an_unknown_name_is_answered_with_all_others() -> None:
    with pytest.raises(
        SettingError, match=r"no traffic is called 'bicycles'; choose set-sampling, .* or reactive-replay"
    ):
        usual("bicycles")


FILE = """
from typing import Literal

from coverdrive.settings import Settings
from coverdrive.simulation.traffic.model import TrafficStep


class StandingSettings(Settings):
    kind: Literal["standing"] = "standing"
    seen: float = 1.0


class StandingTraffic:
    def __init__(self, settings: StandingSettings):
        self.settings = settings

    def reset(self, scene, road, rng):
        pass

    def step(self, scene, dt):
        return TrafficStep.without_bases(scene)
"""
LINE = 'TRAFFICS["standing"] = ("standing", "StandingSettings", "StandingTraffic")'
USED = """
from coverdrive.config import Experiment
from coverdrive.league.league import check_names
from coverdrive.simulation.studies.setup import traffic_of

settings = Experiment().updated({"traffic": {"kind": "standing", "seen": 2.0}}).traffic
assert traffic_of(settings, None).settings.seen == 2.0 and traffic_of("standing", None).settings.seen == 1.0
check_names([], ["standing"])

from coverdrive import cli
cli.main(["study", "nowhere", "--traffic", "standing"])
"""


def test_a_new_traffic_is_one_file_and_one_line(tmp_path: Path) -> None:
    (tmp_path / "standing.py").write_text(FILE)
    beside = f"import coverdrive.simulation.traffic as room\nroom.__path__.append({str(tmp_path)!r})"
    code = "\n".join((beside, "from coverdrive.simulation.traffic.kinds import TRAFFICS", LINE, USED))
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert found.returncode == 2 and "there are no results in nowhere" in found.stderr.replace("\n", " "), found.stderr
