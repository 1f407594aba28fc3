"""The traffics by name."""

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
