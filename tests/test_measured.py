"""No measured number in README or docs without its file in `benchmarks/results/`.

What no macro of `benchmarks/measured.py` says has to be the default of a setting in that unit, or a constant with its source
in `documented_constants`. Looked at are numbers with a unit of time, speed, acceleration, area or data, shares, and "n of m";
metres are not, nor is code. A measured number that equals a default in the same unit is not seen.
"""

import importlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import jinja2
import pytest
from documented_constants import CONSTANTS
from pydantic import BaseModel

from coverdrive.config import Experiment

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = sorted((ROOT / "docs").rglob("*.md"))
COMMENT = re.compile(r"<!-- (\{\{.+?\}\}[^>]*?) -->")
NO_PROSE = re.compile(r"^```.*?^```|`[^`]*`|\{[{%].*?[}%]\}|\]\([^)]*\)", re.DOTALL | re.MULTILINE)
UNIT = r"(%|(?:m/s[²³]?|m²|ms|s|min|GB|MB|kB)(?![\w/²³]))"
RANGE = re.compile(r"(?<![\w.])(\d[\d,.]*\d|\d)(?:[–/]| (?:to|and|or|instead of) )(?=\d)")
NUMBER = re.compile(rf"(?<![\w./§^])(\d[\d,]*(?:\.\d+)?)[ -]?{UNIT}")
COUNT = re.compile(r"(?<![\w.])(\d[\d,]*) of (?:the )?(\d[\d,]*)(?![\w.])")


@pytest.fixture
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their modules can be imported."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")


@pytest.fixture
def measured(benchmarks: None) -> ModuleType:
    return importlib.import_module("measured")


@pytest.fixture
def macros(measured: ModuleType) -> jinja2.Environment:
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False)
    environment.globals |= {each.__name__: each for each in measured.MACROS}
    return environment


def defaults(of: BaseModel) -> Iterator[tuple[float, str]]:
    """All numbers of settings, with the unit that their descriptions begin with; without one, they may be shares."""
    for name, field in type(of).model_fields.items():
        value = getattr(of, name)
        for part in value if isinstance(value, list | tuple) else [value]:
            if isinstance(part, BaseModel):
                yield from defaults(part)
            elif isinstance(part, int | float):
                unit = re.match(r"\[([^\]]+)\]", field.description or "")
                yield (float(part), unit[1]) if unit else (float(100 * part), "%")


def numbers(text: str) -> Iterator[str]:
    """What has to have a source: "32.6 m/s", "4.7 %", "7 of 2,196"; of "2 to 9 s" both."""
    prose = NO_PROSE.sub("", text).replace("\n", " ")
    while found := RANGE.search(prose):  # the unit stands behind the last one only
        unit = re.match(rf"[\d,.]*\d[ -]?{UNIT}", prose[found.end() :])
        prose = f"{prose[: found.start()]}{found[1]} {unit[1] if unit else ''}; {prose[found.end() :]}"
    yield from (f"{number} {unit}" for number, unit in NUMBER.findall(prose))
    yield from (f"{part} of {whole}" for part, whole in COUNT.findall(prose))


KNOWN = {f"{value:g} {unit}" for value, unit in defaults(Experiment())} | set(CONSTANTS)


def unknown(text: str) -> list[str]:
    return sorted(set(numbers(text)) - KNOWN)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_number_is_said_by_a_macro_or_has_a_source(page: Path) -> None:
    assert unknown(page.read_text(encoding="utf-8")) == []


def test_readme_says_what_was_measured(macros: jinja2.Environment) -> None:
    """Every comment with macros stands behind what they say; nothing else there was measured."""
    said, text, rest = 0, README.read_text(encoding="utf-8"), ""
    for part in COMMENT.split(text):
        if "{{" not in part:
            rest += " ".join(part.split("\n"))
            continue
        words, said = macros.from_string(part).render(), said + 1
        assert rest.endswith(words), f"README: {part} is {words}, not {rest[-len(words) :]}"
        rest = rest[: -len(words)]
    assert said > 30
    assert unknown(rest) == []


def test_pages_know_their_macros(macros: jinja2.Environment) -> None:
    for page in PAGES:
        assert "{{" not in macros.from_string(page.read_text(encoding="utf-8")).render()


def test_every_constant_is_needed() -> None:
    found = {each for page in (README, *PAGES) for each in numbers(page.read_text(encoding="utf-8"))}
    assert set(CONSTANTS) <= found


def test_a_stray_number_is_found(macros: jinja2.Environment) -> None:
    text = 'At 31.7 m/s, from 4 to 9.3 %, in 7 of 2,196; `1.23 ms`, {{ measured("fit-us101.area") }} m², 3 s, 77.7 m.'
    assert unknown(text) == ["31.7 m/s", "4 %", "7 of 2,196", "9.3 %"]
    with pytest.raises(KeyError, match="no 'haste'"):
        macros.from_string('{{ measured("fit-us101.haste") }}').render()
    with pytest.raises(KeyError, match=r"no nothing\.json"):
        macros.from_string('{{ measured("nothing.area") }}').render()


def test_numbers_are_said_with_their_intervals(measured: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    values = {"rate": [0.051, 0.026, 0.0922], "apart": [-7.79, -9.22, -6.35], "bound": 0.00201, "drives": 2301, "no": None}
    (tmp_path / "mine.json").write_text(json.dumps({"values": values}), encoding="utf-8")
    monkeypatch.setattr(measured, "FOLDER", tmp_path)
    measured.kept.cache_clear()
    assert measured.measured("mine.rate", ".1%") == "5.1 % (2.6–9.2)"
    assert measured.measured("mine.rate.2", ".0%") == "9 %"
    assert measured.measured("mine.apart", "+.1f") == "−7.8 (−9.2 … −6.3)"
    assert measured.measured("mine.drives", ",") == "2,301"
    assert measured.measured("mine.no", ".1f") == "–"
    assert measured.at_most("mine.bound") == "0.3 %"
    measured.kept.cache_clear()


def test_a_file_has_its_command_and_says_what_changed(
    benchmarks: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    results = importlib.import_module("results")
    monkeypatch.setattr(results, "FOLDER", tmp_path)
    results.save("mine", {"speed": [20.0, 19.0, 21.0], "drives": 7, "time": {"p99": 0.0}}, 3, command="drive", commit="1a")
    assert capsys.readouterr().out == ""
    file = results.save("mine", {"speed": [22.0, 19.0, 21.0], "drives": 7, "time": {"p99": 1 / 3}}, 3)
    assert capsys.readouterr().out == "mine: speed.0 20 → 22 (1.100 times)\nmine: time.p99 0 → 0.333333\n"
    kept = json.loads(file.read_text(encoding="utf-8"))
    assert set(kept) == {"command", "commit", "date", "version", "seed", "values"} and kept["seed"] == 3
    assert kept["values"]["time"]["p99"] == 0.333333


def test_all_files_say_where_they_are_from() -> None:
    files = sorted((ROOT / "benchmarks" / "results").glob("*.json"))
    assert len(files) > 5
    for file in files:
        kept = json.loads(file.read_text(encoding="utf-8"))
        assert kept["command"] and re.fullmatch(r"[0-9a-f]{7,40}", kept["commit"]) and kept["values"], file.name
