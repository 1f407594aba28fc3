"""What the ε of a certificate bounds, in the words of captions, hovers and tables.

Bounds differ in two ways. They hold with a confidence over the draw of the calibration samples, or only on average over
such draws (marginal conformal prediction). And they are about a miss of any kind, or about those who drive one base,
for each by itself.
"""

from collections.abc import Iterator, Sequence

from coverdrive.certificates.certificate import Certificate, Unit
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.dialling.dial import proof_of
from coverdrive.percentages import at_most, percent
from coverdrive.prediction.certifying.occupied import Occupied
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.data.manoeuvres import MANOEUVRES
from coverdrive.simulation.measures.notable import COLLIDED
from coverdrive.simulation.studies.study import Study

ON_AVERAGE, BY_ITSELF = "†", "‡"
"""signs at a bound in a table: it holds on average; it is about every base by itself"""


WHOSE = {"share": "the average vehicle's windows", "group": "the vehicles of a new scene group"}
"""Of what a bound is a share, where that is not called like the unit"""

_MISSED = {"share": "missed of a test vehicle's windows", "group": "missed test vehicles of a scene group"}
"""What a bound on a mean share is to be held against"""


def strength(certificate: Certificate) -> str:
    """How surely the bound holds."""
    if certificate.confidence is None:
        return "on average over calibrations, without confidence"
    return f"with {percent(certificate.confidence, 10)} confidence"


def proved(certificate: Certificate) -> str:
    """What is proved of the sets, in a few words."""
    if certificate.epsilon >= 1:
        return "no bound is proved"
    return f"at most {at_most(certificate.epsilon)} of {whose(certificate)}, {strength(certificate)}"


def whose(certificate: Certificate) -> str:
    """Of which samples the bound says how many are missed."""
    if certificate.groups == 1:
        return WHOSE.get(certificate.unit, f"{certificate.unit}s")
    return f"the {certificate.unit}s that drive a base, for each base by itself"


def signs(certificate: Certificate) -> str:
    """The signs of the bound in a table."""
    return ON_AVERAGE * (certificate.confidence is None) + BY_ITSELF * (certificate.groups > 1)


def legend(compared: Sequence[Compared]) -> str:
    """The name of a method with what sets its bounds apart from those on a miss of any kind with confidence."""
    certificates = [each.certificate for each in compared if each.certificate]
    kinds = ["on average" for each in certificates if each.confidence is None]
    kinds += ["each base" for each in certificates if each.groups > 1]
    named = ", ".join(dict.fromkeys(kinds))
    return compared[0].method.value + (f" ({named})" if named else "")


def proved_by(study: Study) -> str:
    """What the drives of a study prove of others like them, in a sentence."""
    trials = study.trials
    if study.setup.replays:
        touched = f"{trials.select(COLLIDED.sum()).item()} of {trials.height} drives touched anybody"
        return f"{touched}, which proves nothing of scenes other than those replayed"  # which depend on each other
    return proof_of(trials, study.setup.episode.duration, study.files.anytime).sentence


def set_facts(
    basis: Basis | None, evaluation: Evaluation, occupied: Occupied, uncovered: Rate, unit: Unit
) -> Iterator[tuple[str, str]]:
    """How often the sets of a predictor, with the basis if it has one, missed where nothing trained it, and their size.

    What a bound of this unit counts is among it. Beside the area in which the centre of a vehicle may be stands what
    the trivial predictor takes for the same claim.
    """
    yield "missed test windows", str(evaluation.windows)
    for name, rate in evaluation.kinds.items():
        yield f"  {MANOEUVRES[name]}", str(rate)
    if unit in _MISSED:
        yield _MISSED[unit], str(evaluation.missed(unit))
    yield "missed test vehicles", str(evaluation.vehicles)
    if basis is not None:
        yield (
            "  not predicted / outside the tube",
            f"{evaluation.not_predicted} / {evaluation.outside_tube} test windows",
        )
        yield "test windows that no base covers", str(uncovered)
        yield "set size", f"mean {evaluation.sized}, median {evaluation.median_set_size:g}"
    span = f"{occupied.seconds[0]:g} to {occupied.seconds[-1]:g} s"
    yield f"occupied area, {span}", f"{_areas(occupied.areas)} m², mean {occupied.mean:.1f} m²"
    trivial = occupied.baseline_evaluation
    if trivial is not None:
        yield (
            "  constant velocity, one conformal box",
            f"{_areas(occupied.baseline)} m²; the sets take {occupied.ratio:.2f} of it; missed vehicles "
            f"{trivial.vehicles}",
        )


def _areas(areas: Sequence[float]) -> str:
    return " ".join(f"{area:.1f}" for area in areas)
