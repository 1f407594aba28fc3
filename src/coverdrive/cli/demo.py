"""``coverdrive demo``: a certified predictor and a drive that come with the package, on a page, at once."""

import webbrowser
import zipfile
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import console
from coverdrive.errors import SettingError
from coverdrive.files import write_atomically

STORED = Path(__file__).with_name("demo.zip")
"""a results folder, made by ``tools/demo_results.py``"""


def demo(
    *,
    out: Annotated[Path, Parameter(help="Folder to unpack to, as in `--out there`.")] = Path("coverdrive-demo"),
    drive: Annotated[
        bool,
        Parameter(help="Drive the drive now instead of showing the stored one; compiling takes minutes once."),
    ] = False,
    browser: Annotated[
        bool, Parameter(name="--open", negative="--no-open", help="Open the page in the browser, if there is one.")
    ] = True,
) -> dict[str, Any]:
    """Show a stored drive on a page, within seconds: nothing is learned or driven, unless you ask for it.

    The predictor, its certificate and a study of 40 drives come with the package, made from generated traffic. Drives,
    leagues, figures and reports work in this folder as in any other; `calibrations`, `dial` and replays of recordings
    need a fit of your own.

    For example:

    - the same drive, driven now: `coverdrive demo --drive`
    - to another folder, without a browser: `coverdrive demo --out there --no-open`

    Go on with the other commands: report for another drive of the study, study for other traffic.
    """
    with waiting():
        from coverdrive.reporting.claim import proved_by
        from coverdrive.reporting.report import report
        from coverdrive.results import Results
        from coverdrive.simulation.measures.notable import liveliest
        from coverdrive.simulation.studies.driven_on import driven_on
    _unpack(out)
    results = Results(out)
    study = results.driven_study()
    trial = liveliest(study.trials)
    if drive:
        for stored in (study.folder / "traces").glob("*.npz"):
            stored.unlink()
    with stages():
        page = report(results.fitted, study, trials=[trial], replays=0)
    trials, proved = study.trials, proved_by(study)
    sentences = [each.sentence for each in results.certified.planned_against]
    row = trials.filter(trial=trial).row(0, named=True)
    console.print(driven_on(study.setup))
    for sentence in (*sentences, proved):
        console.print(f"• {sentence}")
    console.print(
        f"• Trial {trial} of {trials.height}, the liveliest: {{kind}} at {{time:.1f}} s, {{mean_speed:.1f}} m/s on "
        "average, {lane_changes} lane changes, {overtakes} overtakes".format(**row)
    )
    console.print(
        "• It was driven just now"
        if drive
        else "• It was driven when the package was made, and rounded to a centimetre; `coverdrive demo --drive` drives "
        "it now"
    )
    console.print(f"The page is {page}", soft_wrap=True)
    if browser:
        webbrowser.open(page.resolve().as_uri())
    return {"demo": str(out), "report": str(page), "driven": drive, "sentences": sentences, "proved": proved, **row}


def _unpack(folder: Path) -> None:
    """Unpack the stored results to a folder that is empty, or holds them already; else a SettingError."""
    with zipfile.ZipFile(STORED) as stored:
        manifest = folder / "manifest.json"
        same = manifest.is_file() and manifest.read_bytes() == stored.read(manifest.name)
        if not same and folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise SettingError(f"{folder} holds something else; name another folder, as in `--out there`")
        for name in sorted(stored.namelist(), key=lambda each: each != manifest.name):  # it tells them if room ends
            write_atomically(folder / name, lambda file, name=name: file.write_bytes(stored.read(name)))
