"""Predictors that have not seen the scene that they are judged in.

Published scenarios are often cut from the same recording. What shares vehicles with one, as
`coverdrive.recordings.tracks.overlap` finds them, is left out, and so is all of its map, which the first part of a
benchmark id names: scenarios whose vehicles were moved by a little are not found otherwise.
"""

import re
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from coverdrive.errors import DataError, RecordingError
from coverdrive.prediction.data.split import SplitSettings
from coverdrive.prediction.fit import PredictionSettings, fit
from coverdrive.prediction.fits.provenance import made_from
from coverdrive.prediction.predictor import AnyPredictor, Predictor
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording

_MAP = re.compile(r"(?:C-)?[A-Z]{3}_[A-Za-z0-9]+-[0-9]+(?=_)")


def left_out(recordings: Sequence[Path], scenarios: Sequence[Path]) -> list[frozenset[str]]:
    """The names of the recordings, in files or folders, that show something of each scenario.

    Scenarios that cannot be read as recordings are known by their map alone.
    """
    parts = [len(_recordings_in(scenario)) for scenario in scenarios]
    found = read([*recordings, *(scenario for scenario, count in zip(scenarios, parts, strict=True) if count)])
    training, shown = found[: len(found) - sum(parts)], iter(found[len(found) - sum(parts) :])
    groups = [set[int]().union(*map(_groups, islice(shown, count))) for count in parts]
    result = list[frozenset[str]]()
    for scenario, own in zip(scenarios, groups, strict=True):
        place = _MAP.match(scenario.stem)
        same = [each for each in training if place and each.name.startswith(f"{place[0]}_")]
        out = own.union(*map(_groups, same))
        result.append(frozenset(each.name for each in training if _groups(each) & out))
    return result


def fit_without(
    names: frozenset[str], recordings: Sequence[Recording], settings: PredictionSettings, seed: int, folder: Path
) -> AnyPredictor:
    """The predictor of all recordings but those of some names, `tested_elsewhere`.

    It is fitted once, and kept in a folder by the content of what it was made from.
    """
    kept, settings = [each for each in recordings if each.name not in names], tested_elsewhere(settings)
    path = folder / f"{made_from(kept, settings, seed)}.safetensors"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        fit(kept, settings, seed).predictor.save(path)
    return Predictor.load(path)


def tested_elsewhere(settings: PredictionSettings) -> PredictionSettings:
    """The same where what is left out is the test: of the rest, hardly anything is kept from a fit."""
    return settings.model_copy(update={"split": SplitSettings(train=0.6, calibration=0.35)})


def legible(scenario: Path) -> bool:
    """Whether a scenario can be read as a recording."""
    return bool(_recordings_in(scenario))


def _groups(recording: Recording) -> set[int]:
    return set(recording.table["group"].unique())


def _recordings_in(scenario: Path) -> Sequence[Recording]:
    """One for each carriageway of a scenario; none if it cannot be read as a recording."""
    try:
        return read(scenario)
    except (DataError, RecordingError):
        return ()
