"""All methods of calibration side by side, on the scores of one predictor."""

from collections.abc import Iterable, Sequence
from typing import Protocol, runtime_checkable

from coverdrive.arguments import finite, of_kind
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.comparison import Compared, compare
from coverdrive.certificates.methods import Method
from coverdrive.certificates.rule import Rule
from coverdrive.prediction.certifying.calibrate import held_back
from coverdrive.prediction.certifying.scored import ScoredSides
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.prediction.predictor import AnyPredictor
from coverdrive.progress import stage

TARGETS = (0.05, 0.1, 0.2)
"""bounds ε on the miss rate that are asked for"""


@runtime_checkable
class Fitted(Protocol):
    """A `Fit`, or what was stored of one."""

    @property
    def predictor(self) -> AnyPredictor:
        """Whose network gave the scores."""
        ...

    @property
    def scored(self) -> ScoredSides:
        """Scores of the split that made it."""
        ...

    @property
    def settings(self) -> PredictionSettings:
        """That it was made with."""
        ...

    @property
    def seed(self) -> int:
        """That it was made with."""
        ...


def certify(
    fitted: Fitted,
    targets: float | Sequence[float] = TARGETS,
    unit: Unit | None = None,
    confidence: float | None = None,
) -> list[Compared]:
    """Calibrate by every method for every bound ε on the miss rate in ``targets``, and test on the test split.

    What the bounds count and their confidence are those of the settings, unless given. Where what calibrates also
    tests, each method is tested as the fit is (`held_back`).

    Raises:
        SettingError: this is no fit, or a target no number.
        CertificateError: a target or the confidence is no share between 0 and 1, or there is no such unit.
    """
    of_kind("fitted", fitted, Fitted, "what `fit` gives, or a folder of results that was opened")
    targets = [finite("targets", each) for each in (targets if isinstance(targets, Iterable) else [targets])]
    predictor, scored, settings = fitted.predictor, fitted.scored, fitted.settings.certificate
    wanted = Claim(confidence=settings.confidence if confidence is None else confidence)
    tube, unit = predictor.tube, unit or settings.unit
    calibration = Calibration.of(scored.calibration, tube, predictor.trained_on, unit, fitted.seed, scored.train)

    def test_of(method: Method, claim: Claim, rule: Rule) -> ScoredSamples:
        if not scored.crossed:
            return scored.test
        asked = {"method": method, "epsilon": claim.epsilon or "auto", "confidence": claim.sure, "unit": unit}
        return held_back(rule, tube, scored.train, scored.calibration, settings.model_copy(update=asked), fitted.seed)

    with stage("methods"):
        return compare(calibration, wanted, test_of, targets)
