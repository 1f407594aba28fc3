"""What a scenario shares with recordings is left out of the fit that it is judged with."""

from pathlib import Path

import pytest
from published_commonroad import write_commonroad
from published_formats import truth
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


@pytest.mark.slow
def test_who_is_shared_is_found_in_scenarios_of_several_carriageways(tmp_path: Path) -> None:
    """Of each of these two recordings are made."""
    files, seeds = dict[str, Path](), {"USA_Here-1_1_T-1": 5, "USA_There-2_1_T-1": 5, "DEU_Other-1_1_T-1": 3}
    for name, seed in seeds.items():
        files[name] = tmp_path / f"{name}.xml"
        write_commonroad(tmp_path, truth(0.1, seconds=5.0, seed=seed)).rename(files[name])
    here, there, other = files.values()
    both, shared = ({name, f"{name} carriageway 2"} for name in ("DEU_Other-1_1_T-1", "USA_Here-1_1_T-1"))
    assert left_out([other, here], [other, there]) == [both, shared]
