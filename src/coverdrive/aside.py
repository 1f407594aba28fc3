"""What a results folder no longer stands for: what shows other sets goes, and what drove with them is set aside.

Folders of drives that are set aside lie beside the others, by the scale of their sets: ``study@0.5``. They have their
names again where a predictor with these sets drives again.
"""

from collections.abc import Iterator
from contextlib import suppress
from itertools import chain, count, product
from pathlib import Path

from coverdrive.errors import DataError
from coverdrive.simulation.roads.places import PLACES
from coverdrive.simulation.studies.folder import ASIDE, StudyFolder
from coverdrive.simulation.traffic.registry import NAMES

_DRAWN = (".png", ".pdf", ".mp4", ".gif")
"""endings of figures and videos"""


def current(folder: Path, kind: str) -> list[Path]:
    """The folders in a results folder whose names begin so, and that are not set aside."""
    return [each for each in sorted(folder.glob(f"{kind}*")) if each.is_dir() and ASIDE not in each.name]


def set_aside(folder: Path, scale: str, *kinds: str) -> None:
    """Rename what drove, by the scale of its sets, with a number where others have that name."""
    for each in [each for kind in kinds for each in current(folder, kind)]:
        named = each.with_name(f"{each.name}{ASIDE}{scale}")
        numbered = (each.with_name(f"{named.name}-{number}") for number in count(2))
        each.replace(next(free for free in chain([named], numbered) if not free.exists()))


def bring_back(folder: Path, fingerprint: str, scale: float) -> None:
    """Give what drove with the sets of a predictor its name again, where that is free."""
    for each in folder.glob(f"*{ASIDE}{scale:.3g}"):
        named = each.with_name(each.name.partition(ASIDE)[0])
        with suppress(DataError):  # of another version
            if StudyFolder(each).description().get("predictor") == fingerprint and not named.exists():
                each.replace(named)


def remove_pages(folder: Path) -> None:
    """Remove pages, figures and videos of a results folder."""
    for page in _names("report"):
        (folder / f"{page}.html").unlink(missing_ok=True)
    for figures in _names("figures"):
        remove_drawn(folder / figures)
        with suppress(OSError):  # there is none, or it holds something else
            (folder / figures).rmdir()


def remove_drawn(folder: Path, name: str = "*") -> None:
    """Remove figures and videos from a folder, all of them or those of a name."""
    for file in folder.glob(f"{name}.*"):
        if file.suffix in _DRAWN:
            file.unlink()


def _names(kind: str) -> Iterator[str]:
    """What the pages or the folders of figures of studies are called, by their traffic and road."""
    for traffic, road in product(("", *NAMES), ("", "recorded", *PLACES)):
        yield "-".join(filter(None, (kind, traffic, road)))
