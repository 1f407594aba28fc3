"""The axis of miss rates, cut where it would squeeze all other methods for the sake of a single one."""

from collections.abc import Sequence

from coverdrive.certificates.comparison import Compared
from coverdrive.numbers import percent

_BEYOND = 1.5
"""times the largest ε that was asked for, to which the axis reaches"""

_MARGIN = 1.06
"""from the largest bound to the end of an axis that is not cut"""


def risk_limit(compared: Sequence[Compared]) -> float:
    """End of the axis [%].

    Args:
        compared: methods at their targets, of which one at least did not refuse.
    """
    bounds = [100 * each.certificate.epsilon for each in compared if each.certificate]
    observed = [100 * each.missed.value for each in compared if each.missed]
    targets = [100 * each.target for each in compared if each.target is not None]
    largest = _MARGIN * max([*bounds, *observed])
    return min(largest, _BEYOND * max(targets)) if targets else largest


def beyond(each: Compared, limit: float) -> str:
    """What of a method is beyond the end of the axis [%], in words; empty if nothing is."""
    values = {
        "bound": each.certificate and each.certificate.epsilon,
        "observed": each.missed and each.missed.value,
    }
    return ", ".join(f"{name} {percent(value, 2)}" for name, value in values.items() if value and 100 * value > limit)
