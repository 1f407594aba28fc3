"""The page holds everything, and says what is missing and how to make it."""

import json
import re
from dataclasses import replace

import pytest
from report_fakes import make_contents

from coverdrive.report.page.page import page, write_page


@pytest.fixture(scope="module")
def html() -> str:
    return page(make_contents())


def test_certificate_is_in_plain_view(html: str) -> None:
    certificate = make_contents().predictor.certificate
    (shown,) = re.findall(r'<blockquote class="certificate">\s*<p>(.*?)</p>', html, re.DOTALL)
    assert shown == certificate.sentence


def test_nothing_is_fetched(html: str) -> None:
    outside_plotly = re.sub(r"<script>.*?</script>", "", html, flags=re.DOTALL)
    assert not re.search(r'(src|href)="(https?:)?//', outside_plotly)
    assert "@import" not in html.split("</style>")[0]


def test_names_are_escaped(html: str) -> None:
    assert "results &lt;1&gt;" in html
    assert "results <1>" not in html


def test_every_plot_is_valid_json_with_data(html: str) -> None:
    plots = dict(
        re.findall(r'<script type="application/json" data-plot="plot-([\w-]+)">(.*?)</script>', html, re.DOTALL)
    )
    assert {"basis", "methods", "scores-driven", "collisions", "planning", "speed", "gap"} <= set(plots)
    assert all(json.loads(text)["data"] for text in plots.values())


def test_trials_link_to_their_replays(html: str) -> None:
    assert re.findall(r'href="#replay-(\d+)"', html) == ["0", "7"]
    assert re.findall(r'id="replay-data-(\d+)"', html) == ["0", "7"]
    assert '<span class="mark collision">side</span> <small>(at fault: other; ' in html
    assert "unsafe plans" in html
    assert "too few vehicles" in html


def test_missing_parts_name_their_command(tmp_path) -> None:
    shares = []
    contents = replace(make_contents({}), trials=None, compared=[])
    write_page(contents, tmp_path / "new" / "report.html", shares.append)
    html = (tmp_path / "new" / "report.html").read_text(encoding="utf-8")
    assert "<code>coverdrive certify</code>" in html
    assert "<code>coverdrive study</code>" in html
    assert 'id="player"' not in html
    assert shares[-1] == 1.0


def test_a_replay_that_ends_otherwise_is_said_to() -> None:
    contents = make_contents()
    swapped = {0: contents.traces[7], 7: contents.traces[0]}
    assert page(replace(contents, traces=swapped)).count("the replay ends otherwise") == 2
