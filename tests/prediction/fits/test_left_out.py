"""What a scenario shares with recordings is left out of the fit that it is judged with."""

from pathlib import Path

import pytest
from recordings_fakes import driving, scenario, three_lanes

from coverdrive.prediction.fits.left_out import left_out


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    speeds = {"USA_US101-1_1_T-1": 12.0, "USA_US101-2_1_T-1": 14.0, "USA_US101-21_1_T-1": 15.0}
    for name, speed in speeds.items():
        (tmp_path / f"{name}.xml").write_text(scenario(three_lanes(), driving(100, 20.0, -1.75, speed, 40)))
    return tmp_path


def test_a_scenario_leaves_out_its_map_whatever_its_vehicles_do(folder: Path) -> None:
    changed, elsewhere = folder / "judged" / "USA_US101-2_7_T-1.xml", folder / "judged" / "DEU_A9-2_1_T-1.xml"
    changed.parent.mkdir()
    for path in (changed, elsewhere):
        path.write_text(scenario(three_lanes(), driving(100, 30.0, -5.25, 9.0, 40)))
    illegible = changed.with_name("USA_US101-1_2_T-1.xml")
    illegible.write_text(scenario(three_lanes(), ""))
    assert left_out([folder], [changed, elsewhere, illegible]) == [
        {"USA_US101-2_1_T-1"}, set(), {"USA_US101-1_1_T-1"},
    ]  # fmt: skip
