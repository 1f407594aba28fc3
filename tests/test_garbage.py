"""Garbage is looked for again afterwards, unless it was not before."""

import gc

import pytest

from coverdrive.garbage import not_looking_for_garbage


@pytest.mark.parametrize("before", [True, False])
def test_it_is_looked_for_as_before(before: bool) -> None:
    usual = gc.isenabled()
    try:
        (gc.enable if before else gc.disable)()
        with pytest.raises(ZeroDivisionError), not_looking_for_garbage():
            assert not gc.isenabled()
            raise ZeroDivisionError
        assert gc.isenabled() == before
    finally:
        (gc.enable if usual else gc.disable)()
