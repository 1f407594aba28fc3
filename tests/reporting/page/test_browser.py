"""The page in a real browser: no errors, plots with data, and a replay that obeys mouse and keyboard."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlparse
from urllib.request import url2pathname

import pytest
from report_fakes import COMES, LEAVES, LONG, LOST, STEPS, make_lost, make_trace

from coverdrive.reporting.drives.worst_moment import Worst, worst_moment
from coverdrive.reporting.page.replay import replay_data
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.metrics import distances, gaps
from coverdrive.simulation.measures.misses import find_windows

pytestmark = pytest.mark.slow

Opened = Callable[..., Any]

DOCUMENTATION = Path(__file__).parents[3] / "docs"

MOST_OPERATIONS = 2500
"""of the canvas in one frame of a drive among 12 vehicles of 6 paths each.

Chromium without a GPU, on a machine with more work than processors, took 1.4 µs for each operation, painting included
(median of 350 frames of 1,940 operations: 2.8 ms; with twice as many pixels a side 6.2 ms). So a frame takes a quarter
of the 16.7 ms between two frames of a screen. The number does not depend on what else the machine does.
"""


@pytest.fixture(scope="module")
def tab(browser) -> Iterator:
    """One page of the browser, and what it says and asks for."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.said, page.asked = [], []
    page.on("console", lambda message: page.said.append(message.text))
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    yield page
    context.close()


@pytest.fixture
def page(tab, address: str) -> Iterator:
    """The page, loaded anew; anything on the console, and any request but for the page itself, fails the test."""
    tab.said.clear()
    tab.asked.clear()
    tab.goto("about:blank")
    tab.goto(address)
    tab.wait_for_selector("#player[data-loaded='0']")
    tab.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    yield tab
    assert tab.said == []
    assert {url for url in tab.asked if not url.startswith(("data:", "blob:", "about:"))} == {address}
    tab.emulate_media(color_scheme="light")


def worst_of(trace: Trace) -> Worst:
    return worst_moment(trace, find_windows(trace))


def moment(page) -> int:
    return int(page.input_value("#scrub"))


def choose(page, trial: int) -> None:
    page.select_option("#trial", str(trial))
    page.wait_for_selector(f"#player[data-loaded='{trial}']")


def press(page, *keys: str) -> None:
    """Press keys in the player."""
    page.focus("#player")
    for key in keys:
        page.keyboard.press(key)


def pixels(page, name: str) -> str:
    return page.evaluate(f"document.getElementById('{name}').toDataURL()")


EMPTY = """() => {
    const empty = new Set();
    for (const [name, view] of figures) {
        view.draw();
        if (!view.panels.length) empty.add(name);
        for (const { place, data } of view.panels) {
            if (!data.marks.length) empty.add(name);
            data.marks.forEach((mark, number) => {
                const drawn = place.querySelector(`g[data-mark="${number}"]`);
                const words = drawn && [...drawn.querySelectorAll("text")].some((text) => text.textContent);
                const bounds = drawn && drawn.getBBox();
                if (!words && !(drawn && (bounds.width > 0 || bounds.height > 0))) empty.add(name);
            });
        }
    }
    return [...empty];
}"""
"""the figures of which a mark is not on the screen"""

EMPTIED = """(name) => {
    const { marks } = figures.get(name).panels[0].data;
    marks[0] = (CHANGE)(marks[0]);
}"""


def test_every_mark_of_every_figure_is_drawn(page) -> None:
    assert page.evaluate(EMPTY) == []
    names = set(page.evaluate("[...figures.keys()]"))
    learned = {"areas", "basis", "methods", "scores", "set_sizes", "losses"}
    assert names == learned | {"dial", "collisions", "drives", "planning"}


@pytest.mark.parametrize(
    "change", ["(mark) => ({ ...mark, x: [], y: [] })", "(mark) => ({ ...mark, x: [], text: [] })"]
)
def test_an_empty_mark_would_be_seen(page, change: str) -> None:
    """Where the first mark has points of its own."""
    names = ["losses", "planning", "set_sizes", "scores"]
    for name in names:
        page.evaluate(EMPTIED.replace("CHANGE", change), name)
    assert set(page.evaluate(EMPTY)) == set(names)


def test_figures_are_drawn_when_they_come_near(page) -> None:
    drawn = "(name) => figures.get(name).panels[0].place.querySelectorAll('path').length > 0"
    assert not page.evaluate(drawn, "basis")
    page.evaluate("document.getElementById('figure-basis').scrollIntoView({ behavior: 'instant' })")
    page.wait_for_function(f"({drawn})('basis')")


def test_a_pointer_tells_the_values_and_a_click_on_a_name_hides_its_marks(page) -> None:
    figure = page.locator("#figure-losses")
    figure.scroll_into_view_if_needed()
    page.wait_for_function("figures.get('losses').panels[0].targets.length > 0")
    x, y = page.evaluate("figures.get('losses').panels[0].targets[0].point")
    figure.locator(".panel").hover(position={"x": x + 2, "y": y + 2})
    assert page.inner_text(".tip") == "epoch 1: 9"
    page.mouse.move(5, 5)
    assert not page.locator(".tip").is_visible()
    collisions = page.locator("#figure-collisions")
    collisions.scroll_into_view_if_needed()
    marks = "() => document.querySelectorAll('#figure-collisions g[data-mark]').length"
    page.wait_for_function(f"({marks})() > 0")
    before, button = page.evaluate(marks), collisions.locator(".key button", has_text="paper, rear-end")
    button.click()
    assert page.evaluate(marks) == before - 1 and button.get_attribute("aria-pressed") == "false"
    button.click()
    assert page.evaluate(marks) == before


def test_what_a_pointer_is_told_is_text(page) -> None:
    page.evaluate("Tip.show('<img src=x onerror=alert(1)>', { clientX: 9, clientY: 9 })")
    assert page.inner_text(".tip").startswith("<img") and page.locator(".tip img").count() == 0


@pytest.mark.parametrize("size", [(1440, 900), (390, 844)])
def test_the_first_screen_has_the_verdict_and_the_road_at_its_worst_moment(opened: Opened, size) -> None:
    page = opened(size)
    for place in ("h1", ".tiles", "#read-worst", "#road", "#legend li >> nth=0"):
        box = page.locator(place).bounding_box()
        assert box["y"] + box["height"] <= size[1], place
    legend = page.locator("#legend").bounding_box()
    assert legend["y"] + legend["height"] <= size[1] or size[0] < 400
    assert legend["y"] == sum(page.locator("#road").bounding_box()[each] for each in ("y", "height"))
    assert page.locator("#road").bounding_box()["height"] >= size[1] / 3
    worst = worst_of(make_trace(LONG))
    assert moment(page) == worst.moment > 0
    assert page.inner_text("#worst") == f"worst moment {worst.moment / 10:.1f} s"
    assert page.inner_text("#read-worst") == worst.text


def test_it_is_small_and_ready_soon(page, address: str) -> None:
    """By the processor time of the page, which takes half a second; other work on the machine does not count."""
    assert Path(url2pathname(urlparse(address).path)).stat().st_size < 1.5e6
    browser = page.context.new_cdp_session(page)
    browser.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.reload()
    page.wait_for_selector("#player[data-loaded='0']")
    measured = {each["name"]: each["value"] for each in browser.send("Performance.getMetrics")["metrics"]}
    assert 0 < measured["TaskDuration"] < 5


def test_space_plays_and_pauses(page) -> None:
    press(page, "Home", "Space")
    page.wait_for_function("Number(document.getElementById('scrub').value) >= 3")
    page.keyboard.press("Space")
    stopped = moment(page)
    page.wait_for_timeout(300)
    assert moment(page) == stopped < LONG


COUNT = """() => {
    window.frames_drawn = [];
    let operations = 0;
    for (const name of ["clearRect", "drawImage", "fill", "fillRect", "fillText", "stroke", "strokeRect"]) {
        const draw = CanvasRenderingContext2D.prototype[name];
        CanvasRenderingContext2D.prototype[name] = function (...what) {
            operations++;
            return draw.apply(this, what);
        };
    }
    const show = CourseView.prototype.show;
    CourseView.prototype.show = function (moment) {
        show.call(this, moment);
        window.frames_drawn.push(operations);
        operations = 0;
    };
}"""
"""keeps how many operations of the canvas every frame takes"""


@pytest.fixture
def crowd(browser, address: str) -> Iterator:
    """The drive among many vehicles, on a clock that runs only when the test lets it."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.clock.install(time=0)
    page.goto(f"{address}#replay-3")
    page.wait_for_selector("#player[data-loaded='3']")
    page.keyboard.press("Home")
    page.clock.pause_at(60_000)
    yield page
    context.close()


@pytest.mark.parametrize(("rate", "moment"), [("1", 20), ("4", 80), ("0.25", 5)])
def test_it_plays_in_real_time_with_light_frames(crowd, rate: str, moment: float) -> None:
    crowd.select_option("#rate", rate)
    crowd.click("#all")  # the most that there is to draw
    crowd.evaluate(COUNT)
    crowd.click("#play")
    crowd.clock.run_for(2000)
    assert abs(int(crowd.input_value("#scrub")) - moment) <= 1
    frames = crowd.evaluate("window.frames_drawn")
    assert len(frames) >= 120  # 60 a second
    assert 1500 < max(frames) <= MOST_OPERATIONS


def test_readings_and_courses_tell_of_the_same_moment_while_it_plays(crowd) -> None:
    crowd.evaluate(
        """() => {
            const read = reading;
            window.told = [];
            reading = (drive, step) => { told.push(step); return read(drive, step); };
        }"""
    )
    crowd.click("#play")
    for _ in range(6):
        crowd.clock.run_for(70)
        assert crowd.evaluate("told.at(-1)") == int(crowd.input_value("#scrub"))


def test_time_before_the_click_is_not_played(crowd) -> None:
    """The first frame may have begun before the click, if the page was busy."""
    crowd.evaluate("const now = performance.now(); performance.now = () => now + 2000")
    crowd.click("#play")
    crowd.clock.run_for(3000)
    assert abs(int(crowd.input_value("#scrub")) - 10) <= 1


def test_arrows_step(page) -> None:
    press(page, "Home", "ArrowRight", "ArrowRight", "ArrowRight", "ArrowLeft")
    assert moment(page) == 2
    assert page.inner_text("#clock").startswith("0.2 s")
    page.keyboard.press("Shift+ArrowRight")
    assert moment(page) == 12
    page.keyboard.press("End")
    assert moment(page) == LONG
    assert page.inner_text("#read-end") == "finished, near miss"
    assert page.inner_text("#read-status") == "invalid input"  # of the last plan
    page.keyboard.press("Home")
    assert moment(page) == 0


DRAWN = """() => {
    window.drawn = {};
    for (const name of ["body", "frame", "sets", "plan"]) {
        const draw = RoadView.prototype[name];
        RoadView.prototype[name] = function (...what) {
            (window.drawn[name] ??= []).push(what);
            return draw.apply(this, what);
        };
    }
}"""
"""keeps what is drawn"""


def drawn_at(page, key: str, times: int) -> dict[str, list]:
    """What the last of so many strokes of a key draws."""
    for _ in range(times):
        page.evaluate("window.drawn = {}")
        page.keyboard.press(key)
    return page.evaluate("window.drawn")


def test_vehicles_come_and_those_that_left_their_sets_are_framed(page) -> None:
    choose(page, 9)
    page.evaluate(DRAWN)
    press(page, "Home")
    before = drawn_at(page, "ArrowRight", COMES - 1)
    assert len(before["body"]) == 2
    there = drawn_at(page, "ArrowRight", LEAVES - COMES)
    assert len(there["body"]) == 3 and [colour for _, colour, _ in there.get("frame", [])] in ([], ["bad"])
    assert page.inner_text("#read-left") == "0"
    left = drawn_at(page, "ArrowRight", 1)
    assert [vehicle["lat"] for vehicle, colour, _ in left["frame"] if colour == "ink"] == [pytest.approx(6.0)]
    assert page.inner_text("#read-left") == "1"


def test_the_last_moment_shows_the_sets_and_the_plan_of_the_step_before(page) -> None:
    page.evaluate(DRAWN)
    page.focus("#player")
    last = drawn_at(page, "End", 1)
    assert [step for _, step, *_ in last["sets"]] == [step for _, step, *_ in last["plan"]] == [LONG - 1]


PENS = """() => {
    const pens = { road: new Set(), legend: new Set() };
    for (const draw of ["fill", "fillRect", "stroke", "strokeRect"]) {
        const plain = CanvasRenderingContext2D.prototype[draw];
        CanvasRenderingContext2D.prototype[draw] = function (...what) {
            const line = [this.strokeStyle, this.lineWidth, this.getLineDash()];
            const pen = draw.startsWith("fill") ? this.fillStyle : line.join(" ");
            pens[this.canvas.closest("#legend") ? "legend" : this.canvas.id]?.add(pen);
            return plain.apply(this, what);
        };
    }
    const show = RoadView.prototype.show;
    let drive = null;
    RoadView.prototype.show = function (given, ...what) {
        drive = given;
        return show.call(this, given, ...what);
    };
    const anew = () => document.getElementById("theme").click();
    anew();
    for (const values of ["active", "left"]) drive[values].fill(2);
    drive.met.fill(0);
    drive.metAt.fill(1);
    pens.road.clear();
    pens.legend.clear();
    anew();
    const view = new RoadView(document.getElementById("road"));
    for (const within of ["deciding", "all", 1]) {
        for (const moment of [drive.worst.moment, drive.steps]) view.show(drive, moment, { within, slot: null });
    }
    return [...pens.legend].filter((pen) => !pens.road.has(pen));
}"""
"""the pens of the legend that do not draw the road when there is everything on it"""


def test_the_legend_is_drawn_as_the_road_is(page) -> None:
    choose(page, 7)
    assert page.evaluate(PENS) == []
    labels = page.locator("#legend li").all_inner_texts()
    assert labels == page.evaluate("LEGEND.map(([label]) => label)") and "touches the ego" in labels
    empty = "[...document.querySelectorAll('#legend canvas')].filter((each) => !new Uint32Array(each.getContext('2d')"
    assert page.evaluate(f"{empty}.getImageData(0, 0, each.width, each.height).data.buffer).some(Boolean)).length") == 0


def test_the_legend_has_what_is_in_the_drive(page) -> None:
    assert "touches the ego" not in page.locator("#legend li").all_inner_texts()
    assert page.locator("#legend li").count() >= 8


def test_a_drive_that_ended_in_contact_opens_where_it_went_wrong(page) -> None:
    choose(page, 11)
    worst = worst_of(make_lost())
    assert moment(page) == worst.moment == LOST < STEPS
    assert page.inner_text("#worst") == f"clear plan lost {LOST / 10:.1f} s"
    assert page.inner_text("#read-worst") == worst.text
    page.locator("#marks button[data-kind='contact']").click()
    assert moment(page) == STEPS


RECTANGLES = """() => {
    window.rectangles = [];
    const draw = RoadView.prototype.sets, fill = CanvasRenderingContext2D.prototype.fillRect;
    RoadView.prototype.sets = function (...what) {
        window.rectangles = [];
        CanvasRenderingContext2D.prototype.fillRect = function (...box) {
            window.rectangles.push([this.fillStyle, ...box]);
        };
        draw.apply(this, what);
        CanvasRenderingContext2D.prototype.fillRect = fill;
    };
}"""
"""keeps the colours and places of the boxes that are drawn"""


def test_sets_are_drawn_at_all_times_or_at_one_where_the_boxes_are_then(page) -> None:
    page.evaluate(RECTANGLES)
    press(page, "Home", "ArrowRight", "a")
    everything = page.evaluate("window.rectangles")
    assert len(everything) == 6 * 9 and len({colour for colour, *_ in everything}) == 9  # every half step has its hue
    assert page.inner_text("#read-ahead") == "0 … 2 s" and page.get_attribute("#all", "aria-pressed") == "true"
    assert page.get_attribute("#deciding", "aria-pressed") == "false"
    page.focus("#ahead")
    page.keyboard.press("End")
    last = page.evaluate("window.rectangles")
    assert last == everything[:6] and page.inner_text("#read-ahead") == "+2.00 s"
    page.evaluate(
        "const bar = document.getElementById('ahead'); bar.value = 1.75; bar.dispatchEvent(new Event('input'))"
    )
    between = page.evaluate("window.rectangles")
    assert len({colour for colour, *_ in between}) == 1 and [box[1:] for box in between] == [
        pytest.approx(box[1:]) for box in everything[6:12]
    ]
    page.focus("#player")
    for key, said in ((",", "+1.25 s"), (".", "+1.75 s"), ("a", "0 … 2 s"), (".", "+0.00 s")):
        page.keyboard.press(key)
        assert page.inner_text("#read-ahead") == said
    assert moment(page) == 1


def test_at_rest_the_sets_that_bind_are_drawn_with_the_ego_at_their_time(page) -> None:
    """All are pale at that time but those of one vehicle; nothing binds in this drive, so it is what is nearest."""
    page.evaluate(RECTANGLES)
    press(page, "Home")
    rectangles = page.evaluate("window.rectangles")
    pale, shown = rectangles[:6], rectangles[6:]
    assert len({colour for colour, *_ in pale}) == 1 and len(shown) == 3 and len({colour for colour, *_ in shown}) == 1
    assert pale[0][0] != shown[0][0] and all(box[1:] in [each[1:] for each in pale] for box in shown)
    page.keyboard.press("a")
    where = [box[1:] for box in page.evaluate("window.rectangles")]
    assert all(box[1:] in where for box in shown)


BOUND = """() => {
    const drive = {
        planPoints: 5, planDt: 0.5, own: 0, sizes: [[5, 2]], first: [0, 3], total: 3, vehicle: [1, 1, 2], met: [-1],
        metAt: [0], active: [0b11100, 0b01000, 0], held: new Float64Array(15), paths: new Float64Array(30).fill(99),
        boxes: new Float64Array(30),
    };
    const pairs = (changed) => [...binding({ ...drive, ...changed }, 0)], none = [0, 0, 0];
    const near = Float64Array.from(drive.paths);
    near[2 * 2 * 3 + 2] = 4;      // of path 2 at point 2, along and across
    near[(2 * 2 + 1) * 3 + 2] = 1;
    return [{}, { met: [2], metAt: [1.5] }, { active: none, paths: near }, { active: none }].map(pairs);
}"""
"""whose sets bind made-up plans: two paths of vehicle 1, and one of vehicle 2 that is met, or near, or neither"""


def test_what_binds_a_plan(page) -> None:
    """The middle one of the points 2, 3, 3, 4; what is met; else what is nearest, if it is near."""
    assert page.evaluate(BOUND) == [[[1, 3]], [[1, 3], [2, 3]], [[2, 2]], []]


def test_a_click_isolates_a_vehicle_with_its_set(page) -> None:
    page.evaluate(RECTANGLES)
    press(page, "Home", "ArrowRight", "v")
    assert page.inner_text("#release") == "vehicle 1 alone ✕"
    assert len(page.evaluate("window.rectangles")) == 3 * 9  # at all times
    page.keyboard.press(".")
    assert len(page.evaluate("window.rectangles")) == 3  # at that of the slider
    page.keyboard.press("Escape")
    assert not page.locator("#release").is_visible() and len(page.evaluate("window.rectangles")) == 6
    page.evaluate("""() => {
        const show = RoadView.prototype.show;
        RoadView.prototype.show = function (...what) {
            show.apply(this, what);
            window.places = this.now.map((vehicle) => vehicle && this.place(vehicle.lon, vehicle.lat));
        };
    }""")
    page.keyboard.press("Home")
    x, y = page.evaluate("window.places[2]")
    for shown in (True, False):  # a second click shows all again
        page.locator("#road").click(position={"x": x + 3, "y": y - 3})
        assert page.locator("#release").is_visible() == shown
    page.locator("#road").click(position={"x": x, "y": y})
    assert page.inner_text("#release") == "vehicle 2 alone ✕"
    page.click("#release")
    assert not page.locator("#release").is_visible()


def test_the_ego_is_drawn_at_that_time_on_both_branches(page) -> None:
    press(page, "Home")
    page.evaluate("""() => {
        const draw = RoadView.prototype.outline;
        RoadView.prototype.outline = function (body) {
            window.bodies.push([body.lon, this.context.getLineDash().length]);
            draw.call(this, body);
        };
    }""")
    page.evaluate("window.bodies = []")
    page.evaluate(
        "const bar = document.getElementById('ahead'); bar.value = 1.5; bar.dispatchEvent(new Event('input'))"
    )
    (drive, solid), (safe, dashed), *_ = page.evaluate("window.bodies")
    assert (drive, solid, dashed) == (pytest.approx(1.5 * 24.4), 0, 2) and safe == drive


def test_what_is_not_clear_is_said_with_gap_and_time_to_collision(page) -> None:
    press(page, "Home", "ArrowRight")
    assert page.inner_text("#read-reason").startswith("the rest of the last plan")
    for _ in range(2):
        page.keyboard.press("ArrowRight")
    assert page.inner_text("#read-status") == "unsafe"
    assert page.inner_text("#read-reason") == "plan unsafe: meets nothing that is seen now"
    assert [page.inner_text(f"#read-{name}") for name in ("gap", "ttc", "severity")] == ["3.7 m", "0.8 s", "–"]


def test_space_on_a_button_presses_that_button(page) -> None:
    press(page, "Home", *["ArrowRight"] * 5)
    for button, key, expected in (("#back", "Space", 4), ("#forward", "Space", 5), ("#forward", "Enter", 6)):
        page.focus(button)
        page.keyboard.press(key)
        assert moment(page) == expected
    page.wait_for_timeout(300)
    assert moment(page) == 6 and page.get_attribute("#play", "aria-label") == "Play"
    page.focus("#play")
    page.keyboard.press("Space")
    page.wait_for_function("Number(document.getElementById('scrub').value) >= 9")
    assert page.get_attribute("#play", "aria-label") == "Pause"


def test_near_misses_are_named_and_readings_explained(page) -> None:
    assert page.inner_text("#trial option[value='0']") == "trial 0: 2 vehicles, finished, near miss"
    assert page.inner_text("#trial option[value='7']") == "trial 7: 2 vehicles, side"
    assert "0 at its edge" in page.get_attribute("div:has(> #read-slack)", "title")
    press(page, "End")
    assert page.inner_text("#read-status") == "invalid input"
    assert "cannot be true" in page.get_attribute("#read-status", "title")


RULER = """() => {
    const canvas = document.getElementById("road"), ratio = canvas.width / canvas.clientWidth, height = 22 * ratio;
    const { data } = canvas.getContext("2d").getImageData(0, canvas.height - height, canvas.width, height);
    const colours = [];
    for (let i = 0; i < data.length; i += 4) colours.push(data[i] - data[i + 2]);
    return colours.reduce((most, each) => Math.max(most, each), -255);
}"""
"""how red at most, rather than blue, the band is in which the distances stand"""


def test_sets_leave_the_ruler_readable(crowd) -> None:
    crowd.focus("#player")
    crowd.keyboard.press("ArrowRight")
    assert crowd.evaluate(RULER) < 10


def test_a_phone_sees_three_seconds_of_road_and_every_section(opened: Opened) -> None:
    page = opened((400, 800))
    assert page.locator("#road").bounding_box()["height"] >= 160
    assert page.evaluate("new RoadView(document.getElementById('road')).window()[1]") >= 60
    assert page.evaluate("(nav => nav.scrollWidth <= nav.clientWidth)(document.querySelector('nav'))")
    assert not page.locator(".hint").is_visible()
    page.click("#affordance summary")
    assert page.locator(".hint").is_visible()


def test_keys_work_without_the_focus_while_the_player_is_in_view(page) -> None:
    first = moment(page)
    page.keyboard.press("ArrowRight")
    assert moment(page) == first + 1
    page.focus("#theme")
    page.keyboard.press("ArrowRight")
    assert moment(page) == first + 1
    page.evaluate("document.activeElement.blur()")
    page.evaluate("document.getElementById('basis').scrollIntoView({ behavior: 'instant' })")
    page.keyboard.press("ArrowRight")
    assert moment(page) == first + 1


def marks_of(kind: str | None = None) -> list[int]:
    """Moments of the marks, of a kind if one is named."""
    marks = replay_data(0, make_trace(LONG), None)["marks"]
    return sorted({step for step, each, _ in marks if kind in (None, each)})


def test_marks_are_reached_by_click_and_by_key(page) -> None:
    press(page, "Home")
    expected = [step for step in marks_of() if step > 0]
    for step in expected[:3]:
        page.keyboard.press("n")
        assert moment(page) == step
    page.keyboard.press("p")
    assert moment(page) == expected[1]
    for kind in ("gap", "time", "lane", "lost"):
        button = page.locator(f"#marks button[data-kind='{kind}']")
        page.keyboard.press("Home")
        button.press("Enter")
        assert moment(page) == next(step for step in marks_of(kind) if step > 0)
        button.click()
        later = marks_of(kind)
        assert moment(page) == [*later, *later][1 + (later[0] == 0)]
    assert page.locator("#marks button[data-kind='contact']").is_hidden()
    page.keyboard.press("w")
    assert moment(page) == worst_of(make_trace(LONG)).moment
    page.keyboard.press("Home")
    page.click("#worst")
    assert moment(page) == worst_of(make_trace(LONG)).moment


def test_a_click_above_the_slider_goes_to_the_nearest_mark(page) -> None:
    ticks = page.locator("#ticks")
    width, at = ticks.bounding_box()["width"], marks_of("gap")[0]
    assert ticks.locator("i").count() == len(replay_data(0, make_trace(LONG), None)["marks"])
    ticks.hover(position={"x": width * at / LONG, "y": 12})
    assert page.inner_text(".tip").startswith(f"{at / 10:.1f} s: ")
    ticks.click(position={"x": width * at / LONG, "y": 12})
    assert moment(page) == at and "least gap" in page.inner_text("#read-reason")


SMALL = """() => [...document.querySelectorAll(
        "#player :is(button, select, input, #ticks), .key button, th button, summary, nav a",
    )]
    .filter((each) => each.getClientRects().length && Math.min(each.offsetWidth, each.offsetHeight) < 24)
    .map((each) => each.outerHTML)"""
"""what is smaller than a finger"""


def test_what_is_touched_is_large_enough(opened: Opened) -> None:
    page = opened((390, 844), unfolded=True, has_touch=True)
    assert page.evaluate(SMALL) == []
    page.locator("#marks button[data-kind='lane']").tap()
    assert moment(page) in marks_of("lane")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1440, 900), (390, 844)])
def test_axe_finds_nothing_serious(opened: Opened, scheme: str, size: tuple[int, int]) -> None:
    package = pytest.importorskip("axe_playwright_python", reason="install it: pip install '.[test]'")
    page = opened(size, unfolded=True, color_scheme=scheme)
    page.evaluate("figures.forEach((view) => view.draw())")
    page.evaluate((Path(package.__file__).parent / "axe.min.js").read_text(encoding="utf-8"))
    found = page.evaluate("axe.run()")["violations"]
    assert [
        (each["id"], each["nodes"][0]["target"]) for each in found if each["impact"] in ("serious", "critical")
    ] == []


def test_plus_and_minus_change_the_speed(page) -> None:
    press(page, "+")
    assert page.input_value("#rate") == "2"
    for _ in range(5):
        page.keyboard.press("-")
    assert page.input_value("#rate") == "0.25"


def test_scrubbing_draws_the_moment(page) -> None:
    before = pixels(page, "road"), page.inner_html("#course")
    page.evaluate(
        "const bar = document.getElementById('scrub'); bar.value = 120; bar.dispatchEvent(new Event('input'))"
    )
    assert page.inner_text("#clock").startswith("12.0 s")
    assert page.inner_text("#read-speed") == "24.4 m/s"
    assert page.inner_text("#read-status") == "solved"
    assert page.inner_text("#read-paths") == "6"
    after = pixels(page, "road"), page.inner_html("#course")
    assert before[0] != after[0] and before[1] != after[1]


def test_a_click_on_the_course_goes_there(page) -> None:
    course = page.locator("#course")
    width = course.bounding_box()["width"]
    for x in (width / 4, 3 * width / 4):  # in either column
        page.keyboard.press("Home")
        course.click(position={"x": x, "y": 60})
        assert abs(moment(page) - LONG / 2) < 8


def test_a_pointer_over_the_course_tells_the_values_there(page) -> None:
    page.evaluate("""() => {
        const show = CourseView.prototype.show;
        CourseView.prototype.show = function (moment, pointed = null) {
            const values = pointed === null ? null : this.panels.map((panel) => panel.values[pointed]);
            window.pointed = [moment, pointed, values];
            return show.call(this, moment, pointed);
        };
    }""")
    course, before = page.locator("#course"), moment(page)
    course.hover(position={"x": course.bounding_box()["width"] / 4, "y": 60})
    at, pointed, (gap, time, speed, *_) = page.evaluate("window.pointed")
    trace = make_trace(LONG)
    assert at == moment(page) == before and abs(pointed - LONG / 2) < 8
    assert gap == pytest.approx(min(gaps(trace)[pointed], 100), abs=0.01) and speed == pytest.approx(24.4, abs=0.01)
    assert time == pytest.approx(min(distances(trace).time_to_collision[pointed], 100), abs=0.01)
    page.mouse.move(5, 5)
    assert page.evaluate("window.pointed")[1] is None


def test_facts_about_another_fact_stand_further_right(page) -> None:
    starts = page.evaluate(
        """[...document.querySelectorAll(".facts dt")].map((each) => {
            const text = each.textContent, letter = document.createRange();
            const spaces = text.length - text.trimStart().length;
            letter.setStart(each.firstChild, spaces);
            letter.setEnd(each.firstChild, spaces + 1);
            return [spaces, letter.getBoundingClientRect().left];
        })"""
    )
    (plain,), (within,) = ({left for spaces, left in starts if (spaces > 0) == indented} for indented in (False, True))
    assert within > plain


def test_the_table_opens_sorts_and_filters(page) -> None:
    page.click("#trials a[data-trial='7']")
    page.wait_for_selector("#player[data-loaded='7']")
    press(page, "End")
    assert page.inner_text("#read-end") == "side collision (at fault: other; planning failure)"
    page.keyboard.press("ArrowLeft")
    assert page.inner_text("#read-end") == ""
    page.click("#trials th:first-child button")
    assert page.evaluate("document.querySelector('#trials tbody tr').cells[0].dataset.value") == "11"
    for name, worst in (("least gap [m]", min), ("unsafe plans", max)):
        head = page.locator("#trials th", has_text=name)
        head.locator("button").click()
        column = head.evaluate("head => head.cellIndex")
        values = page.evaluate(
            "column => [...document.querySelectorAll('#trials tbody tr')].map(row => row.cells[column].dataset.value)",
            column,
        )
        assert float(values[0]) == worst(map(float, values))
    page.click(".filters button[data-show='collision']")
    assert page.locator("#trials tbody tr:visible").count() == 2


@pytest.mark.parametrize("name", ["unsafe plans", "least gap [m]"])
def test_what_is_unknown_is_at_the_end_of_the_table_however_it_is_sorted(page, name: str) -> None:
    head = page.locator("#trials th", has_text=name)
    cell = "document.querySelector('#trials tbody tr:{}-child').cells[{}].dataset.value"
    first, last = (cell.format(end, head.evaluate("head => head.cellIndex")) for end in ("first", "last"))
    page.evaluate(f"{first} = 'nan'")
    for _ in range(2):
        head.locator("button").click()
        assert page.evaluate(last) == "nan"


@pytest.mark.parametrize(("scheme", "size"), [("light", (390, 844)), ("dark", (1280, 900))])
def test_light_and_dark_wide_and_narrow(opened: Opened, tmp_path, scheme: str, size: tuple[int, int]) -> None:
    page = opened(size, color_scheme=scheme)
    assert page.evaluate("document.documentElement.dataset.theme") == scheme
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]  # nothing sticks out
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.click("#theme")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != background
    page.screenshot(path=tmp_path / "page.png", full_page=True)
    assert (tmp_path / "page.png").stat().st_size > 50_000


def test_it_prints_light_and_within_the_paper(page, tmp_path) -> None:
    page.emulate_media(color_scheme="dark")
    page.set_viewport_size({"width": 690, "height": 900})  # rules for narrow pages hold on paper, too
    cell = '<td class="number">17.41 (Δ −0.70 … +0.26)</td>'
    table = f'<table id="wide"><tr>{9 * cell}</tr></table>'
    page.evaluate("(table) => document.getElementById('study').insertAdjacentHTML('beforeend', table)", table)
    page.evaluate(
        """addEventListener("beforeprint", () => {
            const drawn = [...document.querySelectorAll(".panel svg")];
            const shown = [...drawn, ...document.querySelectorAll(".tile, #wide td")];
            const widths = shown.map((each) => each.getBoundingClientRect().right);
            const main = document.querySelector("main").getBoundingClientRect();
            window.printed = [document.documentElement.dataset.theme, Math.max(...widths) - main.left, drawn.length];
        })"""
    )
    page.pdf(path=tmp_path / "page.pdf", format="A4")
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
    page.set_viewport_size({"width": 1280, "height": 900})
    theme, widest, drawn = page.evaluate("window.printed")
    assert drawn == page.evaluate("document.querySelectorAll('.panel').length")  # those that were never in view, too
    assert theme == "light"
    assert widest <= 687  # [pixel] A4 less its margins
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"


def test_the_documentation_has_its_picture_from_the_page(address: str, tmp_path) -> None:
    page, picture = Path(url2pathname(urlparse(address).path)), tmp_path / "replay.png"
    command = [sys.executable, DOCUMENTATION / "images" / "replay.py", page, picture, "--trial", "7", "--time", "1"]
    subprocess.run(command, check=True, timeout=120)
    assert picture.read_bytes().startswith(b"\x89PNG")
