"""No measured number in README or docs without its file in `benchmarks/results/`.

What no macro of `benchmarks/measured.py` says has to be the default of a setting in that unit, or a constant with its
source in `documented_constants`. Looked at are numbers with a unit of time, speed, acceleration, area or data, shares,
and "n of m"; metres are not, nor is code. A measured number that equals a default in the same unit is not seen.
"""

import importlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import polars as pl
import pytest
from pydantic import BaseModel

from coverdrive.config import Experiment
from documented_constants import CONSTANTS

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = sorted((ROOT / "docs").rglob("*.md"))
NO_PROSE = re.compile(r"^```.*?^```|`[^`]*`|\{[{%].*?[}%]\}|\]\([^)]*\)", re.DOTALL | re.MULTILINE)
UNIT = r"(%|(?:m/s[²³]?|m²|ms|s|min|GB|MB|kB)(?![\w/²³]))"
NUMBER = r"\d+(?:,\d{3})*(?:\.\d+)?"
CHAIN = re.compile(rf"(?<![\w./§^])({NUMBER}(?:(?:[–/]| (?:to|and|or|instead of) ){NUMBER})*)[ -]?{UNIT}")
COUNT = re.compile(r"(?<![\w.])(\d+(?:,\d{3})*) of (?:the )?(\d+(?:,\d{3})*)(?!\w|\.\d)")


@pytest.fixture
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their modules can be imported."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")


@pytest.fixture
def measured(benchmarks: None) -> ModuleType:
    return importlib.import_module("measured")


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
    for chain, unit in CHAIN.findall(prose):
        yield from (f"{number} {unit}" for number in re.findall(NUMBER, chain))
    yield from (f"{part} of {whole}" for part, whole in COUNT.findall(prose))


KNOWN = {f"{value:g} {unit}" for value, unit in defaults(Experiment())} | set(CONSTANTS)


def unknown(text: str) -> list[str]:
    return sorted(set(numbers(text)) - KNOWN)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_number_is_said_by_a_macro_or_has_a_source(page: Path) -> None:
    assert unknown(page.read_text(encoding="utf-8")) == []


def test_readme_says_what_was_measured(measured: ModuleType) -> None:
    """`python benchmarks/measured.py` would change nothing, and nothing else in README was measured."""
    text = README.read_text(encoding="utf-8")
    assert text == measured.readme()
    assert measured.PART.search(text)[0].count("\n") > 20
    assert unknown(measured.PART.sub("", text) + measured.TOLD.read_text(encoding="utf-8")) == []


def test_pages_know_their_macros(measured: ModuleType) -> None:
    for page in PAGES:
        assert "{{" not in measured.filled(page.read_text(encoding="utf-8"))


def test_every_constant_is_needed() -> None:
    texts = [page.read_text(encoding="utf-8") for page in (README, ROOT / "benchmarks" / "came_out.md", *PAGES)]
    assert set(CONSTANTS) <= {each for text in texts for each in numbers(text)}


def test_a_stray_number_is_found(measured: ModuleType) -> None:
    text = 'At 31.7 m/s, from 4 to 9.3 %, in 7 of 2,196; `1.23 ms`, {{ measured("fit-us101.area") }} m², 3 s, 77.7 m.'
    assert unknown(text) == ["31.7 m/s", "4 %", "7 of 2,196", "9.3 %"]
    with pytest.raises(KeyError, match="no 'haste'"):
        measured.filled('{{ measured("fit-us101.haste") }}')
    with pytest.raises(KeyError, match=r"no nothing\.json"):
        measured.filled('{{ measured("nothing.area") }}')


def test_numbers_are_said_with_their_intervals(
    measured: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = {"rate": [0.051, 0.026, 0.0922], "apart": [-7.79, -9.22, -6.36], "bound": 0.00201}
    values |= {"drives": 2301, "no": None, "between": [-0.06, 0.092]}
    (tmp_path / "mine.json").write_text(json.dumps({"values": values}), encoding="utf-8")
    monkeypatch.setattr(measured, "FOLDER", tmp_path)
    measured.kept.cache_clear()
    assert measured.measured("mine.rate", ".1%") == "5.1 % (2.6–9.2)"
    assert measured.measured("mine.rate.2", ".0%") == "9 %"
    assert measured.measured("mine.apart", "+.1f") == "−7.8 (−9.2 … −6.4)"
    assert measured.measured("mine.between", "+.1f") == "−0.1 … +0.1"
    assert measured.measured("mine.drives", ",") == "2,301"
    assert measured.measured("mine.no", ".1f") == "–"
    assert measured.at_most("mine.bound") == "0.3 %"
    measured.kept.cache_clear()


def test_a_file_has_its_command_and_says_what_changed(
    benchmarks: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    results = importlib.import_module("results")
    monkeypatch.setattr(results, "FOLDER", tmp_path)
    before = {"speed": [20.0, 19.0, 21.0], "drives": 7, "time": {"p99": 0.0}}
    results.save("mine", before, 3, command="drive", commit="1a")
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


def test_what_a_command_printed_is_kept(
    benchmarks: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    keep, results = importlib.import_module("keep"), importlib.import_module("results")
    monkeypatch.setattr(results, "FOLDER", tmp_path)
    proof = {"events": 0, "drives": 459, "bound": 0.00998}
    row = {
        "who": "default",
        "scale": 0.5,
        "mean_speed": 30.0,
        "speed_low": 29.0,
        "speed_high": 31.0,
        "share_unsafe": 0.0,
    }
    printed = tmp_path / "printed.json"
    said = {"proofs": [proof, proof], "scale": 0.5, "frontier": [row | {"scale": 1.0, "mean_speed": 20.0}, row]}
    printed.write_text(json.dumps(said), encoding="utf-8")
    drives = {"reason": ["", "", "no room"], "time": [20.0, 20.0, None], "minimum_gap": [0.9, 2.0, None]}
    numbers = ("minimum_time_to_collision", "distance", "usual_headway", "jerk_longitudinal", "jerk_lateral")
    numbers += ("lost_clear", "planning_median", "planning_p99", "shares_missed", "vehicles_seen")
    drives |= {each: [2.0, 0.5, None] for each in numbers}
    (tmp_path / "proof").mkdir()
    pl.DataFrame(drives).write_parquet(tmp_path / "proof" / "trials.parquet")
    monkeypatch.setattr(
        "sys.argv",
        ["keep", "mine", str(printed), "--command", "coverdrive dial", "--drives", str(tmp_path), "--seed", "5"],
    )
    keep.main()
    kept = json.loads((tmp_path / "mine.json").read_text(encoding="utf-8"))
    assert (kept["command"], kept["seed"]) == ("coverdrive dial", 5)
    values = kept["values"]
    assert values["speed"] == [30.0, 29.0, 31.0] and values["at most"] == 0.00998
    assert values["near misses"] == 1.0 and values["below 1 s"] == 0.5 and values["windows missed"] == 1.0
