"""How numbers are written for readers: 10 %, not 10.000%."""

import numpy as np


def percent(share: float, digits: int = 3) -> str:
    """A share as a percentage with so many significant digits at most, as in 10 % or 0.286 %."""
    return f"{_significant(100 * share, digits)} %"


def interval(low: float, high: float) -> str:
    """From one share to another as percentages, as in 0.2–2.8 %."""
    return f"{_significant(100 * low, 2)}–{percent(high, 2)}"


def _significant(value: float, digits: int) -> str:
    """Without an exponent, and without zeros at the end of a fraction."""
    return np.format_float_positional(value, precision=digits, fractional=False, trim="-")
