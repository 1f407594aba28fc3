"""Every control of the page obeys: mouse and keyboard on a desktop, touch and keyboard on a phone."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest

pytestmark = pytest.mark.slow

DEVICES: dict[str, dict[str, Any]] = {
    "desktop": {"viewport": {"width": 1440, "height": 900}},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True},
}
WAYS = [("desktop", "mouse"), ("desktop", "keyboard"), ("phone", "touch"), ("phone", "keyboard")]
MOMENT, PRESSED = "document.getElementById('scrub').value", "control.getAttribute('aria-pressed')"


class Control(NamedTuple):
    """What a person can press, and what then changes."""

    selector: str
    seen: str
    """JavaScript of what changes, of the control; a moment of the drive is 50 before"""
    keys: tuple[str, ...] = ("Enter", " ")
    """each of which does it, too"""
    before: str = ""
    """key of the player that is pressed first"""


CONTROLS = (
    Control("#theme", "document.documentElement.dataset.theme"),
    Control("nav a[href='#calibration']", "location.hash", ("Enter",)),
    Control("a.brand", "location.hash", ("Enter",)),
    Control("a.tile", "location.hash", ("Enter",)),
    Control("#worst", MOMENT),
    Control("#back", MOMENT),
    Control("#forward", MOMENT),
    Control("#play", "control.getAttribute('aria-label')"),
    Control("#marks button[data-kind='gap']", MOMENT),
    Control("#marks button[data-kind='lane']", MOMENT),
    Control("#deciding", PRESSED, before="a"),
    Control("#all", PRESSED),
    Control("#release", "control.hidden", before="v"),
    Control("#scrub", MOMENT, ("ArrowRight", "PageUp", "Home")),
    Control("#ahead", "control.value", ("ArrowRight", "End")),
    Control("#trial", "document.getElementById('player').dataset.loaded", ("ArrowDown", "End")),
    Control("#rate", "control.value", ("ArrowDown", "Home")),
    Control("summary", "control.parentElement.open"),
    Control(".key button", PRESSED),
    Control("#trials th:nth-child(2) button", "control.closest('th').getAttribute('aria-sort')"),
    Control(".filters button[data-show='near']", PRESSED),
    Control("#trials a[data-trial='7']", "document.getElementById('player').dataset.loaded", ("Enter",)),
)
POINTED = ("#road", "#course", "#ticks")
"""pictures that are pointed at: with a finger below, with the mouse in `test_browser`; keys and sliders do the same"""
SCROLLED = ("#player", "[role='region']")
"""what has the focus for the sake of keys that play or scroll"""
ALIKE = ("nav a", "#marks button", "summary", ".key button", "#trials th button", ".filters button", "#trials a")
"""of each, one or two are among `CONTROLS`"""
FOCUSED = """() => {
    const all = [...document.querySelectorAll(
        "a[href], button, input, select, summary, #player > canvas, #course, #ticks, [tabindex]",
    )];
    return all.filter((each) => each.getClientRects().length && getComputedStyle(each).visibility !== "hidden");
}"""


PUT_BACK = """() => {
    history.replaceState(null, "", location.pathname);
    document.querySelectorAll("details").forEach((each) => { each.open = true; });
    document.querySelector(".filters button").click();
    document.getElementById("rate").value = "1";
    const trial = document.getElementById("trial");
    trial.value = "0";
    trial.dispatchEvent(new Event("change"));
}"""
"""as it was opened, but for what every press changes: the theme, the order of the table, marks of figures"""


@pytest.fixture(scope="module")
def opened(browser, address: str) -> Iterator[Callable[..., Any]]:
    """A function that shows the page of a device at moment 50 with all that folds open, put back unless told not to."""
    contexts = {name: browser.new_context(**settings) for name, settings in DEVICES.items()}
    pages = {name: context.new_page() for name, context in contexts.items()}
    for page in pages.values():
        page.goto(address)
        page.wait_for_selector("#player[data-loaded='0']")
        page.evaluate(PUT_BACK)
        page.evaluate("figures.forEach((view) => view.draw())")

    def open_on(name: str, anew: bool = True) -> Any:
        page = pages[name]
        if anew:
            page.evaluate(PUT_BACK)
        page.evaluate("scrub.value = 50; scrub.dispatchEvent(new Event('input'))")
        return page

    yield open_on
    for context in contexts.values():
        context.close()


def changed(page, control: Control, act: Callable[[Any], None]) -> bool:
    """Whether an act on a control changes what is seen of it, within a second."""
    if control.before:
        page.focus("#player")
        page.keyboard.press(control.before)
    locator = page.locator(control.selector).first
    locator.scroll_into_view_if_needed()
    seen = f"control => String({control.seen})"
    before = locator.evaluate(seen)
    act(locator)
    for _ in range(20):
        if locator.evaluate(seen) != before:
            return True
        page.wait_for_timeout(50)
    return False


def by_pointer(way: str) -> Callable[[Any], None]:
    """A press with the mouse or a finger: in the last fifth of a slider, and of a list the last choice."""

    def act(locator: Any) -> None:
        if locator.evaluate("control => control.tagName") == "SELECT":
            locator.select_option(index=3)  # the list that then opens is the system's
            return
        box = locator.bounding_box()
        ranged = locator.evaluate("control => control.type === 'range'")
        where = {"x": box["width"] * (0.8 if ranged else 0.5), "y": box["height"] / 2}
        (locator.tap if way == "touch" else locator.click)(position=where)

    return act


@pytest.mark.parametrize("control", CONTROLS, ids=lambda control: control.selector)
@pytest.mark.parametrize(("device", "way"), WAYS)
def test_a_control_obeys(opened: Callable[..., Any], device: str, way: str, control: Control) -> None:
    if way != "keyboard":
        assert changed(opened(device), control, by_pointer(way))
        return
    for number, key in enumerate(control.keys):  # what is pressed stays pressed
        page = opened(device, anew=number == 0 or control.seen == PRESSED)
        assert changed(page, control, lambda locator, key=key: locator.press(key)), key


def test_pictures_are_touched(opened: Callable[..., Any]) -> None:
    page = opened("phone")
    for name in ("#course", "#ticks"):
        box, before = page.locator(name).bounding_box(), page.evaluate(MOMENT)
        page.tap(name, position={"x": box["width"] * 0.45, "y": box["height"] / 2})
        assert page.evaluate(MOMENT) != before, name
    page.evaluate("""() => {
        const show = RoadView.prototype.show;
        RoadView.prototype.show = function (...what) {
            RoadView.prototype.show = show;
            show.apply(this, what);
            window.places = this.now.map((vehicle) => vehicle && this.place(vehicle.lon, vehicle.lat));
        };
    }""")
    page.keyboard.press("Home")
    x, y = page.evaluate("window.places[1]")
    page.tap("#road", position={"x": x, "y": y})
    assert page.inner_text("#release") == "vehicle 1 alone ✕"


@pytest.mark.parametrize("device", DEVICES)
def test_no_control_is_left_out(opened: Callable[..., Any], device: str) -> None:
    known = ", ".join([*(each.selector for each in CONTROLS), *ALIKE, *POINTED, *SCROLLED])
    left = f"known => ({FOCUSED})().filter((each) => !each.matches(known)).map((each) => each.outerHTML)"
    assert opened(device).evaluate(left, known) == []


@pytest.mark.parametrize("device", DEVICES)
def test_the_tab_key_comes_to_every_control(opened: Callable[..., Any], device: str) -> None:
    page = opened(device)
    page.evaluate(f"window.missing = new Set(({FOCUSED})().filter((each) => each.tabIndex >= 0))")
    count = page.evaluate("window.missing.size")
    assert count > 40
    page.evaluate("document.activeElement.blur()")
    for _ in range(count + 5):
        page.keyboard.press("Tab")
        page.evaluate("window.missing.delete(document.activeElement)")
    assert page.evaluate("[...window.missing].map((each) => each.outerHTML)") == []
