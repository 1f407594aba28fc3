"""The tests check types and shapes of every call, of functions as well as of data."""

from dataclasses import replace

import numpy as np
import pytest

from coverdrive.geometry import axis_gap, turned_half_extents
from coverdrive.scene import beside


@pytest.mark.parametrize("half_sizes", [np.ones(3), np.ones((2, 3)), [2.4, 0.9]])
def test_a_wrong_shape_or_type_fails(half_sizes) -> None:
    with pytest.raises(TypeError):
        turned_half_extents(half_sizes, np.array(0.0))


def test_sizes_of_two_arguments_must_agree() -> None:
    with pytest.raises(TypeError):
        axis_gap(np.ones(2), np.ones(3), 1.0, 1.0)
    assert axis_gap(np.ones(3), np.ones(3), 1.0, 1.0).shape == (3,)
    assert axis_gap(np.ones(2), np.ones(2), 1.0, 1.0).shape == (2,)


def test_sizes_within_data_must_agree(straight_paths) -> None:
    paths = straight_paths((24, 5.4, 12), (0, 1.8, 20))
    with pytest.raises(TypeError):
        replace(paths, vehicle=np.zeros(5, dtype=int))


def test_a_result_is_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("coverdrive.geometry.beside", lambda lon, lat: np.append(beside(lon, lat), 0.0))
    with pytest.raises(TypeError, match="return"):
        turned_half_extents(np.ones(2), np.array(0.0))


def test_a_result_of_another_size_is_checked_though_the_arguments_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    angle = np.array(0.0)
    assert turned_half_extents(np.ones(2), angle).shape == turned_half_extents(np.ones(2), angle).shape == (2,)
    monkeypatch.setattr("coverdrive.geometry.beside", lambda lon, lat: np.append(beside(lon, lat), 0.0))
    with pytest.raises(TypeError, match="return"):
        turned_half_extents(np.ones(2), angle)
    monkeypatch.undo()
    with pytest.raises(TypeError):
        turned_half_extents([1.0, 1.0], angle)
