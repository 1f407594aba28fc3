"""A browser, and the address of a page with drives of every kind."""

import shutil
from collections.abc import Iterator
from dataclasses import replace

import pytest
from report_fakes import LONG, make_contents, make_crowd, make_dialled, make_lost, make_stray, make_trace

from coverdrive.reporting.page.page import write_page
from coverdrive.simulation.drives.outcome import Kind

ARGUMENTS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="module")
def browser() -> Iterator:
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("needs the browser chromium; install it, as in `apt-get install chromium`")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "report.html"
    drives = {
        0: make_trace(LONG),
        3: make_crowd(steps=LONG),
        7: make_trace(kind=Kind.SIDE),
        9: make_stray(),
        11: make_lost(),
    }
    write_page(replace(make_contents(drives), dialled=make_dialled()), path)
    return path.as_uri()
