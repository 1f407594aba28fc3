"""What entrants are made of where nothing of the scenes that they are judged in was seen.

Scenes are left out in a few bundles, so that there are few fits.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from coverdrive.league.entrants import Known
from coverdrive.league.known import box_of
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.prediction.left_out import fit_without, left_out, tested_elsewhere
from coverdrive.recordings.recording import Recording

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
    """What there is for each scenario.

    Args:
        known: where nothing of a scenario is in the recordings.
        scenarios: files.
        paths: of the recordings.
        recordings: the same, as they were read.
        settings: of the fits.
        seed: of the fits.
        folder: where fits are kept.
        boxed: whether constant velocity is to have its box.
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
