"""What a predictor was made from, and which scenes neither trained nor calibrated it, on which it may be tried."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from coverdrive.certificates.certificate import fingerprint
from coverdrive.errors import DataError
from coverdrive.prediction.predictor import AnyPredictor
from coverdrive.prediction.segments import Segments
from coverdrive.prediction.split import Split
from coverdrive.recordings.read import together
from coverdrive.recordings.recording import Recording


@dataclass(frozen=True)
class Source:
    """One recording that a predictor was made from."""

    name: str
    rows: int
    fingerprint: str
    """of its table, like the rows"""
    held_out: tuple[int, ...]
    """its groups of scenes that are on the test side only"""


def recording_fingerprint(recording: Recording) -> str:
    """A short hash of the whole table of a recording."""
    return fingerprint(*(recording.table[name].to_numpy() for name in recording.table.columns))


def sources_of(recordings: Sequence[Recording], segments: Segments, split: Split) -> tuple[Source, ...]:
    """What is worth remembering of the recordings that were split."""
    used = segments.group[np.concatenate([split.train, split.calibration])]
    free = np.setdiff1d(segments.group[split.test], used)
    return tuple(
        Source(
            name=recording.name,
            rows=len(recording.table),
            fingerprint=recording_fingerprint(recording),
            held_out=tuple(np.intersect1d(recording.table["group"].to_numpy(), free).tolist()),
        )
        for recording in recordings
    )


def held_out(
    source: Sequence[Source], predictor: AnyPredictor, recordings: Sequence[Recording]
) -> tuple[Recording, ...]:
    """The recordings without all groups of scenes that the predictor was made from.

    One that it was made from is left with its groups of the test side; one that shares no vehicle with those that
    trained it is left as a whole.

    Raises:
        DataError: a recording is not as it was when the predictor was made from it.
    """
    known = {each.fingerprint: each for each in source}
    names = {each.name for each in source}
    kept: list[Recording] = []
    for recording in together(recordings):
        found = known.get(recording_fingerprint(recording))
        if found is not None:
            table = recording.table.filter(pl.col("group").is_in(found.held_out))
            kept += [replace(recording, table=table)] if len(table) else []
            continue
        if recording.name in names or recording.table["identity"].is_in(predictor.trained_on.tolist()).any():
            raise DataError(
                f"{recording.name} shares vehicles with what the predictor was made from, but is not as it was then, "
                "so that no scene of it is known to be new; give it as it was read for the fit, with the same "
                "smoothing, or entirely new recordings"
            )
        kept.append(recording)
    return tuple(kept)
