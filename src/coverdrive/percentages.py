"""How shares and numbers are written for readers: 10 %, not 10.000%; 1 vehicle, not 1 vehicles."""

import math

import numpy as np

_ROUNDING = 1e-9
"""share of the last digit by which a number may be above it only because it was computed"""
_LEAST = 1e-9
"""share below which an interval begins at 0"""


def percent(share: float, digits: int = 3) -> str:
    """A share as a percentage with so many significant digits at most, as in 10 % or 0.286 %; less than all is never
    100 %, but 99.98 %, say.
    """
    said = _significant(100 * share, digits)
    if share < 1 and float(said) >= 100:
        said = f"{100 * share:.{math.ceil(-math.log10(100 * (1 - share)))}f}"
    return f"{said} %"


def counted(number: int, noun: str) -> str:
    """So many of what a noun names, as in 1 vehicle or 1,200 vehicles."""
    return f"{number:,} {noun}{'s' * (number != 1)}"


def change(difference: float) -> str:
    """A difference of two shares as a percentage with its sign, to a tenth, as in +1.5 % or -40 %."""
    return f"{round(100 * difference, 1) + 0.0:+g} %"  # never -0


def at_most(bound: float, digits: int = 4) -> str:
    """A bound from above as a percentage, rounded up to so many significant digits."""
    if not 0 < bound < math.inf:
        return percent(bound, digits)
    return percent(_rounded_up(bound, digits), digits)


def interval(low: float, high: float) -> str:
    """From one share to another as percentages of two digits, rounded outwards, as in 0.2–2.8 %."""
    ends = 100 * low if low > _LEAST else 0.0, 100 * high
    down, up = (sign * _rounded_up(sign * end, 2) for sign, end in zip((-1, 1), ends, strict=True))
    return f"{_significant(down, 2)}–{_significant(up, 2)} %"


def _rounded_up(value: float, digits: int) -> float:
    """To so many significant digits."""
    if not 0 < abs(value) < math.inf:
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return math.ceil(value / unit - _ROUNDING) * unit


def _significant(value: float, digits: int) -> str:
    """Without an exponent, and without zeros at the end of a fraction."""
    return np.format_float_positional(value, precision=digits, fractional=False, trim="-")
