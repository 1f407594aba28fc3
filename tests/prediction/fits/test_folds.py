"""Fits with scene groups in every role."""

import numpy as np
import pytest
from prediction_fakes import SETTINGS
from rich.console import Console

from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.data.split import rotations
from coverdrive.prediction.fit import fit
from coverdrive.prediction.fits.folds import fit_folds
from coverdrive.recordings.recording import Recording
from coverdrive.reporting.tables.summaries import folds_table


@pytest.mark.slow
def test_every_fold_is_the_fit_with_its_sides(scenes: tuple[Recording, ...]) -> None:
    found = fit_folds(scenes, SETTINGS, 0, 3, epsilon=0.3)
    assert len(found) == 6 and all(each.certificate and not each.refusal for each in found)
    assert {each.calibration for each in found} == {each.test for each in found}
    segments = cut_segments(scenes, SETTINGS.segments)
    sides = rotations(segments.vehicle, segments.group, 3, 0)[4]
    alone = fit(scenes, SETTINGS, 0, epsilon=0.3, sides=sides)
    assert found[4].evaluation == alone.evaluation
    assert found[4].certificate == alone.predictor.certificate
    assert found[4].calibration == tuple(np.unique(segments.group[sides.calibration]).tolist())
    console = Console(width=120, record=True)
    console.print(folds_table(found))
    text = console.export_text()
    low, high = (end(each.evaluation.mean_set_size for each in found if each.evaluation) for end in (min, max))
    assert f"({low:.1f}–{high:.1f})" in text and "mean (range)" in text


def test_a_claim_that_cannot_be_proved_is_a_fold_without_a_certificate(scenes: tuple[Recording, ...]) -> None:
    found = fit_folds(scenes, SETTINGS, 0, 3, epsilon=0.01, unit="group")
    assert [each.certificate for each in found] == [None] * 6
    assert (
        "calibration scene groups cannot prove ε = 0.01" in found[0].refusal and "groups would do" in found[0].refusal
    )
    console = Console(width=120, record=True)
    console.print(folds_table(found))
    assert "refused" in console.export_text()
