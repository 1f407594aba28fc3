"""Wholes and their parts: what is borrowed from Python, and what compiling leaves as it was."""

import gc
import sys
from typing import NamedTuple

import numpy as np
import pytest

from coverdrive.wholes import Whole, lent


class Inner(NamedTuple):
    values: np.ndarray


@lent
class Outer(NamedTuple):
    inner: Inner
    more: np.ndarray
    number: float


class Own(NamedTuple):
    values: np.ndarray
    number: float


@Whole
def added(given, i):
    return given.inner.values[i] + given.more[i] + given.number


@Whole
def total(given):
    inner, result = given.inner, 0.0
    for i in range(len(inner.values)):
        other = given.inner.values if i % 2 else inner.values
        result += added(given, i) + 0 * other[i]
    return result


@Whole
def kept(given):
    own = Own(np.sqrt(given.inner.values), given.number)
    return own.values, given.inner.values


@Whole
def remade(given):
    return Inner(given.inner.values * 2).values


@Whole
def returned(given):
    return given.inner


@Whole
def same(values):
    return values


@Whole
def larger(values, other, times):
    for _ in range(times):
        values, other = other, values + other
    return same(values)


@Whole
def handed_on(values, times):
    first = same(values)
    second = larger(first, same(np.ones(len(values))), times)
    filling = np.full(len(values), np.nan)  # where what was freed too early would have been
    return first, second, larger(values, filling, 0)


def outer() -> Outer:
    return Outer(Inner(np.arange(4.0)), np.ones(4), 0.5)


def test_no_reference_to_what_is_borrowed_is_lost_or_left() -> None:
    given = outer()
    before = sys.getrefcount(given.inner.values), sys.getrefcount(given.more)
    assert [total(given) for _ in range(3)] == [12.0] * 3
    assert (sys.getrefcount(given.inner.values), sys.getrefcount(given.more)) == before


def test_arrays_out_of_it_and_own_ones_outlive_it() -> None:
    given = outer()
    own, borrowed = kept(given)
    del given
    gc.collect()
    filling = [np.full(4, np.nan) for _ in range(100)]
    assert own.tolist() == np.sqrt(np.arange(4.0)).tolist() and borrowed.tolist() == [0, 1, 2, 3] and filling


def test_parts_give_back_their_arguments_exchange_them_and_lose_none() -> None:
    given, before = np.arange(4.0), None
    for times in range(5):
        first, second, third = handed_on(given, times)
        fibonacci = [0, 1, 1, 2, 3, 5][times], [1, 0, 1, 1, 2, 3][times]
        assert second.tolist() == (fibonacci[0] * np.ones(4) + fibonacci[1] * given).tolist()
        assert first.tolist() == third.tolist() == given.tolist()
        del first, second, third
        assert sys.getrefcount(given) == (before := before or sys.getrefcount(given))


@pytest.mark.parametrize("function", [remade, returned])
def test_what_python_hands_over_no_compiled_function_makes_or_gives_back(function: Whole) -> None:
    with pytest.raises(TypeError, match=f"{function.py_func.__name__} makes a Inner or returns one"):
        function(outer())


def test_the_collector_looks_again_after_compiling() -> None:
    @Whole
    def negative(value):
        return -value

    assert gc.isenabled() and negative(2) == -2 and gc.isenabled()
    gc.disable()
    try:
        assert negative(2.0) == -2.0 and not gc.isenabled()
    finally:
        gc.enable()
