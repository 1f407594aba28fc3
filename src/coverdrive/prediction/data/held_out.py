"""What a predictor was made from, and which scenes neither trained nor calibrated it, on which it may be tried.

The tracks of all that trained or calibrated are kept. A recording shows something of them if a vehicle in it moves as
one of them (`coverdrive.recordings.tracks.overlap`), or has the number and the size of one within a site
(`coverdrive.recordings.tracks.numbering`), however it is cut, shifted, numbered or called. Keys of vehicles and numbers
of groups depend on what is read together, and are not asked. A scene is what one recording shows of one group. Those
of the test side that show a vehicle that trained or calibrated, as at a border of the minutes of a long recording, are
left out like those that did.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Int

from coverdrive.certificates.certificate import fingerprint
from coverdrive.errors import DataError
from coverdrive.files import write_stream
from coverdrive.percentages import counted
from coverdrive.prediction.data.segments import Segments
from coverdrive.prediction.data.split import Split
from coverdrive.recordings.read import numbers_of, together
from coverdrive.recordings.recording import IDENTITY, Recording
from coverdrive.recordings.tracks.numbering import Numbers, same_numbers
from coverdrive.recordings.tracks.overlap import shared_vehicles
from coverdrive.recordings.tracks.reading import tracks_of
from coverdrive.recordings.tracks.repair import RawTracks

_TRACK = ("vehicle", "moment", "speed", "length", "width")
_OF_READING = ("group", *IDENTITY)
"""columns that depend on what is read together"""


@dataclass(frozen=True)
class Source:
    """One recording that a predictor was made from."""

    name: str
    rows: int
    fingerprint: str
    """of its scenes"""
    numbers: Numbers
    """what equal vehicle numbers in another recording of its site mean"""
    dt: float
    """[s] between two rows of a track in its file"""
    used: tuple[str, ...]
    """fingerprints of its scenes that trained or calibrated, or show a vehicle that did"""
    held_out: tuple[str, ...]
    """fingerprints of the others: of the test side, or without a segment, as the last second of a recording"""


@dataclass(frozen=True, eq=False)
class Seen:
    """What trained or calibrated a predictor."""

    sources: tuple[Source, ...]
    tracks: pl.DataFrame
    """the rows of their files: number of the recording in ``sources``, vehicle, moment [dt], stated speed [m/s], length
    and width [m]"""

    @staticmethod
    def of(recordings: Sequence[Recording], segments: Segments, split: Split) -> "Seen":
        """What is to be remembered of the recordings that were split."""
        made_of = np.concatenate([split.train, split.calibration])
        used, vehicles = segments.group[made_of], np.unique(segments.vehicle[made_of])
        sources = list[Source]()
        for each in recordings:
            sides = list[str](), list[str]()
            for table, digest in _scenes(each):
                shows = table["group"][0] in used or np.isin(table["identity"].to_numpy(), vehicles).any()
                sides[0 if shows else 1].append(digest)
            own = each.name, len(each.table), digest_of(each), numbers_of(each), each.file_dt
            sources.append(Source(*own, *map(tuple, sides)))
        return Seen(tuple(sources), pl.concat(_tracks(each, used, n) for n, each in enumerate(recordings)))

    def save(self, path: Path) -> None:
        """Write the tracks to a file; `load` gives them back."""
        write_stream(path, self.tracks.write_parquet)

    @staticmethod
    def load(path: Path, sources: tuple[Source, ...]) -> "Seen":
        """What `save` wrote."""
        return Seen(sources, pl.read_parquet(path.read_bytes()))

    def unseen(self, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        """The recordings without all that trained or calibrated.

        One that the predictor was made from is left with its scenes of the test side that show no vehicle that trained
        or calibrated; one that shares no vehicle with what did is left as a whole.

        Raises:
            DataError: one shows vehicles that trained or calibrated, but is not as it was then.
        """
        used = {digest for each in self.sources for digest in each.used}
        held_out = {digest for each in self.sources for digest in each.held_out}
        kept, unknown = list[Recording](), list[Recording]()
        for recording in together(recordings):
            left = [(table, digest) for table, digest in _scenes(recording) if digest not in used]
            if new := [table for table, digest in left if digest not in held_out]:
                unknown.append(replace(recording, table=pl.concat(new)))
            if left:
                kept.append(replace(recording, table=pl.concat(table for table, _ in left).sort("vehicle", "time")))
        if unknown:
            self.refuse(unknown)
        return tuple(kept)

    def from_all(self, recordings: Sequence[Recording]) -> bool:
        """Whether these are the recordings that the predictor was made from, as they were read for it."""
        return [digest_of(each) for each in together(recordings)] == [each.fingerprint for each in self.sources]

    def refuse(self, recordings: Sequence[Recording]) -> None:
        """Raise `DataError`, saying what they share, if recordings show vehicles that trained or calibrated."""
        found = zip(recordings, self.shared_with(recordings), strict=True)
        told = [f"{each.name} shows {shared}" for each, shared in found if shared]
        if told:
            raise DataError(
                f"{'; '.join(told)}, which trained or calibrated the predictor; give the recordings of the fit as they "
                "were read for it, of which only scenes of the test side are used, or entirely new ones"
            )

    def shared_with(self, recordings: Sequence[Recording]) -> list[str]:
        """How many vehicles of each are in which of the recordings seen, in words; empty if none is."""
        parts = self.tracks.partition_by("recording", maintain_order=True)
        sources, known = [self.sources[part["recording"][0]] for part in parts], len(parts)
        names = [each.name for each in (*sources, *recordings)]
        tracks = [*map(_raw, parts), *map(tracks_of, recordings)]
        files = [0] * known + [1] * len(recordings)
        steps = [*(each.dt for each in sources), *(each.file_dt for each in recordings)]
        worth: list[Numbers] = [*(each.numbers for each in sources), *map(numbers_of, recordings)]
        pairs = pl.concat([shared_vehicles(tracks, files, steps, known), same_numbers(tracks, files, names, worth)])
        shared = pairs.partition_by("recording_b", as_dict=True)
        return [_told(shared.get((number,), pairs.clear()), names) for number in range(known, len(names))]


def _told(pairs: pl.DataFrame, names: list[str]) -> str:
    """How many vehicles are shared with which recordings, in words."""
    count, where = pairs["vehicle_b"].n_unique(), [names[number] for number in pairs["recording"].unique().sort()]
    return f"{counted(count, 'vehicle')} of {', '.join(where)}" if count else ""


def _scenes(recording: Recording) -> Iterator[tuple[pl.DataFrame, str]]:
    """The scenes of a recording, and a short hash of all in each that does not depend on what is read with it."""
    for table in recording.table.partition_by("group", maintain_order=True):
        columns = [table[name] for name in table.columns if name not in _OF_READING]
        stated = [each.explode() if each.name == "stated" else each for each in columns]
        yield table, fingerprint(*(each.to_numpy() for each in stated))


def digest_of(recording: Recording) -> str:
    """A short hash of the scenes of a recording."""
    return fingerprint(np.frombuffer("".join(digest for _, digest in _scenes(recording)).encode(), np.uint8))


def _tracks(recording: Recording, groups: Int[np.ndarray, " G"], number: int) -> pl.DataFrame:
    """The rows of all vehicles that some groups of a recording show, as in `Seen.tracks`."""
    raw = tracks_of(recording)
    shown = np.isin(raw.vehicle, raw.vehicle[np.isin(raw.group, groups)])
    table = pl.DataFrame({name: getattr(raw, name) for name in _TRACK}).filter(shown)
    return table.with_columns(pl.col(_TRACK[2:]).cast(pl.Float32), recording=pl.lit(number, pl.Int64))


def _raw(part: pl.DataFrame) -> RawTracks:
    columns = {name: part[name].cast(pl.Float64 if name in _TRACK[2:] else pl.Int64).to_numpy() for name in _TRACK}
    zero = np.zeros(len(part))
    return RawTracks(lon=zero, lat=zero, group=zero.astype(np.int64), **columns)
