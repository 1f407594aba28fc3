"""Public trajectory data sets that are not read yet, told by their columns, and where each is described."""

from collections.abc import Iterable
from pathlib import Path

from coverdrive.errors import RecordingError

LEVEL_X = "https://levelxdata.com"

FORMATS: dict[tuple[str, ...], tuple[str, str]] = {
    ("frontsightdistance", "xvelocity"): ("highD tracks (25 Hz, y down, x and y of a corner)", LEVEL_X),
    ("lanecenteroffset", "xcenter"): ("exiD or inD tracks (25 Hz, headings in degrees)", LEVEL_X),
    ("xcenter", "ycenter", "lonvelocity"): ("exiD, inD, rounD or uniD tracks (25 Hz, headings in degrees)", LEVEL_X),
    ("initialframe", "finalframe", "numframes"): ("the list of tracks of highD, exiD or inD", LEVEL_X),
    ("framerate", "locationid"): ("the description of a recording of highD, exiD or inD", LEVEL_X),
    ("track_id", "timestamp_ms", "psi_rad"): (
        "INTERACTION tracks (metres, map frame)",
        "https://interaction-dataset.com",
    ),
    ("track_id", "yaw_rate", "psi_rad"): ("MONA tracks (metres, UTM)", "https://commonroad.in.tum.de/datasets"),
    ("xloc_kf", "yloc_kf"): ("TGSIM tracks (metres, y down)", "https://data.transportation.gov"),
    ("carcenterx", "boundingbox1x"): (
        "CitySim tracks (pixels and feet)",
        "https://github.com/UCF-SST-Lab/UCF-SST-CitySim1-Dataset",
    ),
    ("x_position", "y_position", "coarse_vehicle_class"): ("I-24 MOTION trajectories (feet)", "https://i24motion.org"),
}
"""Columns in lower case that are found in one format alone, its name, and where it is described"""


def refuse_foreign(file: Path, columns: Iterable[str]) -> None:
    """Refuse a file of a known format that is not read, and say how it can be.

    Args:
        file: named in the error.
        columns: names of its columns.

    Raises:
        RecordingError: when they are those of one of `FORMATS`.

    """
    names = {name.strip().lower().replace("-", "_") for name in columns}
    for telling, (title, where) in FORMATS.items():
        if names.issuperset(telling):
            raise RecordingError(
                file,
                f"these look like {title}, which are not read yet; the format is described at {where}: convert it to "
                "own Parquet, as the tutorial 'Your recordings' shows",
            )


def refuse_json(file: Path) -> None:
    """Refuse a JSON file of a known format by the names in its first 100,000 bytes."""
    with file.open("rb") as stream:
        refuse_foreign(file, stream.read(100_000).decode("utf-8", errors="replace").split('"'))
