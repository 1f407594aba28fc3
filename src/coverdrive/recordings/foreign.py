"""Public trajectory data sets that are recognised, but not read, and why."""

from pathlib import Path
from typing import Any, NoReturn

from coverdrive.errors import RecordingError


def refuse_citysim(file: Path, how: Any) -> NoReturn:
    """Refuse CitySim tracks, whose boxes are in pixels and in feet of images that are not rectified alike."""
    problem = "these look like CitySim tracks (pixels and feet), which are not read; the format is described at"
    where = "https://github.com/UCF-SST-Lab/UCF-SST-CitySim1-Dataset"
    raise RecordingError(file, f"{problem} {where}: convert it to own Parquet, as the tutorial 'Your recordings' shows")
