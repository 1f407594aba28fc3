"""The picture ``replay.png`` of the documentation: the player of a report at one moment of a drive.

    coverdrive demo --no-open
    python docs/images/replay.py coverdrive-demo/report.html docs/images/replay.png --trial 24 --time 8.1

Needs Chromium, and Playwright of ``pip install '.[test]'``.
"""

import argparse
import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright


def main() -> None:
    """Take the picture that the command line asks for."""
    parser = argparse.ArgumentParser(description="Take a picture of a replay.")
    parser.add_argument("report", type=Path, help="page that holds the drive")
    parser.add_argument("picture", type=Path, help="PNG file to write")
    parser.add_argument("--trial", type=int, required=True)
    parser.add_argument("--time", type=float, default=10.0, help="moment of the drive [s]")
    chosen = parser.parse_args()
    program = shutil.which("chromium")
    if program is None:
        parser.error("needs Chromium; install it, as in `apt-get install chromium`")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1100, "height": 900}, device_scale_factor=1.5)
        page.goto(f"{chosen.report.resolve().as_uri()}#replay-{chosen.trial}")
        page.wait_for_selector(f"#player[data-loaded='{chosen.trial}']")
        page.evaluate(
            """seconds => {
                const bar = document.getElementById("scrub");
                const whole = parseFloat(document.getElementById("clock").textContent.split(" s of ")[1]);
                bar.value = Math.round(seconds / whole * Number(bar.max));
                bar.dispatchEvent(new Event("input"));
                document.activeElement.blur();
            }""",
            chosen.time,
        )
        page.locator("#player").screenshot(path=chosen.picture)
        browser.close()


if __name__ == "__main__":
    main()
