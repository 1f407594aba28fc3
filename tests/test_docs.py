"""Every Python example of the documentation runs, in the order of its page, beside results as users have them.

Every command of the documentation exists with its options.
"""

import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest

from coverdrive.cli import app
from coverdrive.cli.learning.basis import save_bases
from coverdrive.config import Experiment
from coverdrive.prediction.cover.basis_study import study_bases
from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.fit import fit
from coverdrive.results import Results
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from documented_keys import documented_keys

ROOT = Path(__file__).parents[1]
COMMAND = re.compile(r"^(?:.*&& )?(?:\S*/)?coverdrive (.+?)(?:\s{2,}.*|\s+#.*)?$", re.MULTILINE)
SHELL = re.compile(r"^```(?:sh|text)\n(.*?)^```", re.DOTALL | re.MULTILINE)
FENCE = re.compile(r"^```python(?: .*?)?\n(.*?)^```", re.DOTALL | re.MULTILINE)
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))
    if FENCE.search(path.read_text(encoding="utf-8"))
)


@pytest.fixture
def beside(once: Callable[[str, Callable[[Path], None]], Path], tmp_path: Path) -> Path:
    """A folder with ``results/``, with bases, and ``us-101.csv``, all of them small."""
    return Path(shutil.copytree(once("documentation", fill), tmp_path / "beside"))


def fill(folder: Path) -> None:
    experiment = Experiment().updated(
        {
            "generated": {"scenes": 6, "duration": 20.0, "vehicles": (10, 12)},
            "prediction": {
                "sets": "bases",
                "basis": {"radius": 1.0},
                "training": {"epochs": 4},
                "certificate": {"confidence": 0.9, "unit": "window"},
            },
        }
    )
    recordings = experiment.recordings([])
    Results(folder / "results").save_fit(experiment, fit(recordings, experiment.prediction, experiment.seed))
    segments = cut_segments(recordings, experiment.prediction.segments)
    save_bases(experiment, study_bases(segments, (0.75,)), folder / "results" / "bases")
    ngsim().write_csv(folder / "us-101.csv")


def ngsim() -> pl.DataFrame:
    """Thirty scenes of calm generated traffic as NGSIM's portal exports them: feet, front bumpers, milliseconds."""
    foot, frames = 0.3048, []
    calm = GeneratedSettings(scenes=30, duration=6.0, lanes=1, vehicles=(10, 12), moody_share=0.0, wander=0.0)
    for number, recording in enumerate(generate(calm)):
        table, road = recording.table, recording.road
        moment = (10 * table["time"].to_numpy()).round().astype(int)
        frames.append(
            pl.DataFrame(
                {
                    "Vehicle_ID": table["vehicle"] + 1,
                    "Frame_ID": moment + 1,
                    "Global_Time": 1118846980000 + 600_000 * number + 100 * moment,
                    "Local_X": (road.edges[-1] - table["lat"].to_numpy()) / foot,
                    "Local_Y": (table["lon"] + table["length"] / 2) / foot,
                    "v_length": table["length"] / foot,
                    "v_Width": table["width"] / foot,
                    "v_Class": 2,
                    "v_Vel": table["speed"] / foot,
                    "Lane_ID": road.lanes - road.lane_of(table["lat"].to_numpy()),
                    "Location": "us-101",
                }
            )
        )
    return pl.concat(frames)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_examples_run(page: str, beside: Path, hardly_trained: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(beside)
    names: dict[str, object] = {"__name__": page}
    for number, example in enumerate(FENCE.findall((ROOT / page).read_text(encoding="utf-8")), start=1):
        example = example.replace("trials=20", "trials=4")  # all are driven alike
        exec(compile(example, f"{page}, example {number}", "exec"), names)


def test_commands_exist_with_their_options() -> None:
    pages = (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))
    texts = [block for page in pages for block in SHELL.findall(page.read_text(encoding="utf-8"))]
    commands = [command for text in texts for command in COMMAND.findall(text)]
    assert len(commands) > 25
    for command in commands:
        app.parse_args(shlex.split(command), exit_on_error=False, print_error=False)


def test_the_keys_of_every_command_are_documented() -> None:
    """Which are those that it prints, wherever a test calls it with ``--json`` (`command.coverdrive`)."""
    assert list(documented_keys()) == [name for name in app if not name.startswith("-")]


def test_pages_with_examples_are_found() -> None:
    assert {"README.md", "docs/basis.md", "docs/tutorials/network.md", "docs/tutorials/planner.md"} <= set(PAGES)


def test_the_reference_lists_every_module() -> None:
    pages = [path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "reference").glob("*.md")]
    listed = re.findall(r"^::: coverdrive\.(\S+)$", "\n".join(pages), re.MULTILINE)
    source = ROOT / "src" / "coverdrive"
    modules = {
        ".".join(path.relative_to(source).with_suffix("").parts)
        for path in source.rglob("[!_]*.py")
        if source / "cli" not in path.parents and path.stem != "progress"
    }
    assert sorted(listed) == sorted(modules)


def test_the_gallery_has_a_picture_of_every_figure() -> None:
    """Those of `python tools/gallery.py`, which runs what the page says."""
    shown = re.findall(r"\(images/gallery/(\w+)\.webp\)", (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8"))
    sizes = {path.stem: path.stat().st_size for path in (ROOT / "docs" / "images" / "gallery").iterdir()}
    assert sorted(shown) == sorted(sizes) and sum(sizes.values()) < 400_000
    source = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "src" / "coverdrive").rglob("*.py"))
    assert len(shown) == len(re.findall(r"^def (?:(?!new_)\w+_figure|snapshots)\(", source, re.MULTILINE))
