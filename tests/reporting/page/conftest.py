"""A browser, and the address of a page with drives of every kind."""

import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import pytest
from report_fakes import LONG, make_contents, make_crowd, make_dialled, make_lost, make_stray, make_trace

from coverdrive.reporting.page.page import page
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


@pytest.fixture
def opened(browser, address: str) -> Iterator[Callable[..., Any]]:
    """A function that opens the page in a window of a size [pixel] of its own, with all that folds open if told to."""
    contexts: list[Any] = []

    def open_page(size: tuple[int, int], unfolded: bool = False, **settings: Any) -> Any:
        contexts.append(browser.new_context(viewport={"width": size[0], "height": size[1]}, **settings))
        page = contexts[-1].new_page()
        page.goto(address)
        page.wait_for_selector("#player[data-loaded='0']")
        if unfolded:
            page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
        return page

    yield open_page
    for context in contexts:
        context.close()


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
    path.write_text(page(replace(make_contents(drives), dialled=make_dialled())), encoding="utf-8")
    return path.as_uri()
