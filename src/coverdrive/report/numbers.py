"""How numbers are written for readers: 10 %, not 10.000%."""

import re

import numpy as np


def percent(share: float, digits: int = 3) -> str:
    """A share as a percentage with so many significant digits at most, as in 10 % or 0.286 %."""
    return f"{_significant(100 * share, digits)} %"


def interval(low: float, high: float) -> str:
    """From one share to another as percentages, as in 0.2–2.8 %."""
    return f"{_significant(100 * low, 2)}–{percent(high, 2)}"


def readable(text: str) -> str:
    """A sentence made elsewhere with its numbers written in this way: 10.000% is 10 %, confidence 0.99 is 99 %."""
    text = re.sub(
        r"\b([Ww]ith) confidence (0\.\d+|1)\b",
        lambda found: f"{found[1]} {percent(float(found[2]), 4)} confidence",
        text,
    )
    return re.sub(r"(\d+(?:\.\d+)?)%", lambda found: f"{float(found[1]):g} %", text)


def _significant(value: float, digits: int) -> str:
    """Without an exponent, and without zeros at the end of a fraction."""
    return np.format_float_positional(value, precision=digits, fractional=False, trim="-")
