"""What entrants are made of, from a fit and the recordings that it was made from.

Where they are judged in scenes of these recordings, it is made anew without what shows them. Scenes are left out in a
few bundles, so that there are few fits.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Int

from coverdrive.certificates.certificate import Certificate
from coverdrive.errors import CertificateError, DataError
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.league.entrants import Known
from coverdrive.planning.planner import PlannerSettings
from coverdrive.prediction.certifying.occupied import trivial_box
from coverdrive.prediction.fit import PredictionSettings, cut_and_split
from coverdrive.prediction.fits.left_out import fit_without, left_out, tested_elsewhere
from coverdrive.prediction.predictor import AnyPredictor
from coverdrive.recordings.recording import Recording

_NAMELESS = "it needs the recordings that the fit was made from; name them with --recording"


def known_of(
    predictor: AnyPredictor,
    settings: PredictionSettings,
    seed: int,
    recordings: Sequence[Recording],
    paper: AnyPredictor | None,
    planner: PlannerSettings,
) -> Known:
    """What there is for all entrants: the predictor of the default, how it was made, and the paper's, if there is one.

    Without the recordings that it was made from, constant velocity has no box.

    Raises:
        DataError: the predictors were not trained on the same vehicles, those of the recordings.
    """
    box: ConstantVelocity | str = _NAMELESS
    trained_on = predictor.trained_on
    if recordings:
        box, trained_on = box_of(recordings, settings, predictor.certificate, seed)
    for each, whose in ((predictor, "that of the fit"), (paper, "that of the paper's preset")):
        if each is not None and not np.array_equal(each.trained_on, trained_on):
            raise DataError(f"the predictor, {whose}, was trained on other vehicles; name the recordings of the fit")
    return Known(predictor, paper or _NAMELESS + ", or its fit with --paper", box, planner)


def box_of(
    recordings: Sequence[Recording], settings: PredictionSettings, certificate: Certificate, seed: int
) -> tuple[ConstantVelocity | str, Int[np.ndarray, " n"]]:
    """Constant velocity in one box for a certificate's claim, or why there is none; and who is trained on."""
    segments, sides = cut_and_split(recordings, settings, seed)
    trained_on = np.unique(segments.vehicle[sides.train])
    try:
        half_sizes, claim, _ = trivial_box(recordings, segments, sides, settings.certificate, certificate, seed)
    except CertificateError as error:
        return f"its box cannot be proved: {error}", trained_on
    return ConstantVelocity(half_sizes[1:], segments.step, half_sizes[0], claim), trained_on


def paper_settings_like(settings: PredictionSettings) -> PredictionSettings:
    """The paper's preset on the windows and sides of other settings."""
    return PredictionSettings.paper().model_copy(update={"segments": settings.segments, "split": settings.split})


_FITS = 4
_SEEN = "its fit has seen these scenes"


def unseen_of(
    known: Known,
    scenarios: Sequence[Path],
    paths: Sequence[Path],
    recordings: Sequence[Recording],
    settings: PredictionSettings,
    seed: int,
    folder: Path,
    *,
    boxed: bool,
) -> tuple[Known, ...]:
    """What there is for each scenario: ``known`` where nothing of it is in the recordings, read from ``paths``.

    Fits are kept in the folder; constant velocity has its box only if it is to be ``boxed``.
    """
    files = list(dict.fromkeys(scenarios))
    out = dict(zip(files, left_out(paths, files), strict=True))
    rows = {each.name: len(each.table) for each in recordings}
    made = dict[frozenset[str], Known]()
    for names in _bundled(set(out.values()) - {frozenset()}, rows):
        predictor, box = fit_without(names, recordings, settings, seed, folder), _SEEN
        if boxed:
            kept = [each for each in recordings if each.name not in names]
            box = box_of(kept, tested_elsewhere(settings), predictor.certificate, seed)[0]
        made[names] = replace(known, predictor=predictor, paper=_SEEN, box=box)
    return tuple(
        next((each for names, each in made.items() if out[file] and out[file] <= names), known) for file in scenarios
    )


def _bundled(sets: Collection[frozenset[str]], rows: Mapping[str, int]) -> list[frozenset[str]]:
    """A few unions of sets of recordings, of about as many rows each, the largest first."""
    bundles = [frozenset[str]() for _ in range(_FITS)]
    for each in sorted(sets, key=lambda names: (-sum(map(rows.__getitem__, names)), sorted(names))):
        smallest = min(range(_FITS), key=lambda i: sum(map(rows.__getitem__, bundles[i])))
        bundles[smallest] |= each
    return [each for each in bundles if each]
