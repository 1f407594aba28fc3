"""The formats that the package reads, under their names; the last one is asked first whether a file is of its own.

One is recognised, but not read.
"""

from pathlib import Path
from typing import Any, NoReturn

from coverdrive.errors import RecordingError
from coverdrive.recordings.formats.commonroad import read_commonroad
from coverdrive.recordings.formats.highd import HIGHD, LEVELX, read_highd, read_levelx
from coverdrive.recordings.formats.i24 import read_i24
from coverdrive.recordings.formats.interaction import INTERACTION, MONA, read_interaction, read_mona
from coverdrive.recordings.formats.ngsim import read_metric, read_ngsim
from coverdrive.recordings.formats.parquet import read_parquet
from coverdrive.recordings.formats.reader import having, readers, register_reader
from coverdrive.recordings.formats.tgsim import TGSIM, has_centre_lines, read_tgsim

__all__ = ["readers", "register_reader"]


def refuse_citysim(file: Path, how: Any) -> NoReturn:
    """Refuse CitySim tracks, whose boxes are in pixels and in feet of images that are not rectified alike."""
    problem = "these look like CitySim tracks (pixels and feet), which are not read; the format is described at"
    where = "https://github.com/UCF-SST-Lab/UCF-SST-CitySim1-Dataset"
    raise RecordingError(file, f"{problem} {where}: convert it to own Parquet, as the tutorial 'Your recordings' shows")


register_reader(
    "NGSIM",
    read_ngsim,
    lambda head: (
        head.suffix in (".csv", ".txt") and (not head.columns or bool(head.columns & {"vehicle_id", "local_x"}))
    ),
    takes=("location",),
)
register_reader("NGSIM-metric", read_metric, having("vehicle_id local_x_m local_y_m"), numbers="restart", takes=())
register_reader("CitySim", refuse_citysim, having("carcenterx boundingbox1x"), takes=())
register_reader(
    "highD",
    read_highd,
    having(HIGHD),
    having("id framerate locationid", "id initialframe finalframe numframes"),
    "restart",
    (),
)
register_reader(
    "exiD",
    read_levelx,
    having(LEVELX),
    having("recordingid framerate locationid", "recordingid trackid initialframe finalframe"),
    "restart",
    ("map",),
)
register_reader("TGSIM", read_tgsim, having(TGSIM), has_centre_lines, takes=())
register_reader(
    "INTERACTION",
    read_interaction,
    having(INTERACTION),
    lambda head: having("track_id frame_id timestamp_ms agent_type x y vx vy")(head) and "psi_rad" not in head.columns,
    "restart",
    ("map",),
)
register_reader("MONA", read_mona, having(MONA), takes=())
register_reader("I-24", read_i24, having("timestamp x_position y_position direction coarse_vehicle_class"), takes=())
register_reader("CommonRoad", read_commonroad, lambda head: head.suffix == ".xml", takes=())
register_reader("own", lambda file, how: read_parquet(file), lambda head: head.own, numbers="restart", takes=())
