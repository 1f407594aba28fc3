"""What the ε of a certificate bounds, in the words of captions, hovers and tables.

Bounds differ in two ways. They hold with a confidence over the draw of the calibration samples, or only on average over
such draws (marginal conformal prediction). And they are about a miss of any kind, or about those who drive one base, or
one of a group of bases, for each by itself.
"""

from collections.abc import Sequence

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.numbers import percent

ON_AVERAGE, BY_ITSELF = "†", "‡"
"""signs at a bound in a table: it holds on average; it is about every base or group of bases by itself"""


WHOSE = {"share": "the average vehicle's windows", "group": "the vehicles of a new scene group"}
"""Of what a bound is a share, where that is not called like the unit"""


def strength(certificate: Certificate) -> str:
    """How surely the bound holds."""
    if certificate.confidence is None:
        return "on average over calibrations, without confidence"
    return f"with {percent(certificate.confidence, 4)} confidence"


def whose(certificate: Certificate) -> str:
    """Of which samples the bound says how many are missed."""
    if certificate.groups == 1:
        return WHOSE.get(certificate.unit, f"{certificate.unit}s")
    return f"the {certificate.unit}s that drive a {certificate.group}, for each {certificate.group} by itself"


def signs(certificate: Certificate) -> str:
    """The signs of the bound in a table."""
    return ON_AVERAGE * (certificate.confidence is None) + BY_ITSELF * (certificate.groups > 1)


def legend(compared: Sequence[Compared]) -> str:
    """The name of a method with what sets its bounds apart from those on a miss of any kind with confidence."""
    certificates = [each.certificate for each in compared if each.certificate]
    kinds = ["on average" for each in certificates if each.confidence is None]
    kinds += [f"each {each.group.split()[0]}" for each in certificates if each.groups > 1]
    named = ", ".join(dict.fromkeys(kinds))
    return compared[0].method.value + (f" ({named})" if named else "")
