"""Make the pictures of `docs/gallery.md`: `python tools/gallery.py`.

What the page says is run from top to bottom in a temporary folder; each picture is then the newest figure of its name,
as wide as a page, in WebP. This takes ten minutes on two cores.
"""

import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

PAGE = Path(__file__).parents[1] / "docs" / "gallery.md"
PICTURES = PAGE.parent / "images" / "gallery"
_STEP = re.compile(
    r"^```(?P<language>python|sh)\n(?P<code>.*?)^```|\(images/gallery/(?P<name>\w+)\.webp\)", re.DOTALL | re.M
)
_WIDTH, _QUALITY = 1100, 78
"""[pixel], and as of Pillow"""


def commands_of(language: str, code: str) -> list[list[str]]:
    """Arguments of Python for the code of a block."""
    return [["-c", code]] if language == "python" else [["-m", *shlex.split(line)] for line in code.splitlines()]


def take(figure: Path, picture: Path) -> None:
    with Image.open(figure) as drawn:
        drawn.thumbnail((_WIDTH, 3 * _WIDTH))
        drawn.convert("RGB").save(picture, quality=_QUALITY, method=6)


def main() -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as folder:
        for step in _STEP.finditer(PAGE.read_text(encoding="utf-8")):
            if step["name"]:
                figures = Path(folder).rglob(f"{step['name']}.png")
                take(max(figures, key=lambda file: file.stat().st_mtime), PICTURES / f"{step['name']}.webp")
                continue
            for arguments in commands_of(step["language"], step["code"]):
                print(*arguments, flush=True)
                subprocess.run([sys.executable, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
