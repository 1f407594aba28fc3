"""Public trajectory data sets that are not read yet, told by their columns, and where each is described."""

from collections.abc import Iterable
from pathlib import Path

from coverdrive.errors import RecordingError

FORMATS = (
    ("frontsightdistance xvelocity", "highD tracks (25 Hz, y down, x and y of a corner)", "levelxdata.com"),
    ("lanecenteroffset xcenter", "exiD or inD tracks (25 Hz, headings in degrees)", "levelxdata.com"),
    ("xcenter ycenter lonvelocity", "exiD, inD, rounD or uniD tracks (25 Hz, angles in degrees)", "levelxdata.com"),
    ("initialframe finalframe numframes", "the list of tracks of highD, exiD or inD", "levelxdata.com"),
    ("framerate locationid", "the description of a recording of highD, exiD or inD", "levelxdata.com"),
    ("track_id timestamp_ms psi_rad", "INTERACTION tracks (metres, map frame)", "interaction-dataset.com"),
    ("track_id yaw_rate psi_rad", "MONA tracks (metres, UTM)", "commonroad.in.tum.de/datasets"),
    ("xloc_kf yloc_kf", "TGSIM tracks (metres, y down)", "data.transportation.gov"),
    ("carcenterx boundingbox1x", "CitySim tracks (pixels and feet)", "github.com/UCF-SST-Lab/UCF-SST-CitySim1-Dataset"),
    ("x_position y_position coarse_vehicle_class", "I-24 MOTION trajectories (feet)", "i24motion.org"),
)
"""Columns in lower case that are found in one format alone, its name, and where on the web it is described"""


def refuse_foreign(file: Path, columns: Iterable[str]) -> None:
    """Refuse a file whose columns are those of one of `FORMATS`, and say how it can be read."""
    names = {name.strip().lower().replace("-", "_") for name in columns}
    for telling, title, where in FORMATS:
        if names.issuperset(telling.split()):
            problem = f"these look like {title}, which are not read yet; the format is described at https://{where}"
            raise RecordingError(file, f"{problem}: convert it to own Parquet, as the tutorial 'Your recordings' shows")
