"""The map in CONTRIBUTING leads to files that exist, and to what it says is in them."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (?!paper |---)(.+?) \| (.+) \|$", TEXT, re.MULTILINE)


def defined(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}


def test_the_map_leads_to_what_it_names() -> None:
    for row, places in ROWS:
        words, file = re.findall(r"`([^`]+)`", places), None
        assert words and words[0].endswith(".py"), row
        for word in words:
            if word.endswith(".py"):
                file = ROOT / "src" / "coverdrive" / word
                assert file.is_file(), f"{row}: {word}"
            else:
                assert file is not None and word in defined(file), f"{row}: {word} is not in {file}"


def test_the_map_has_every_section_and_where_to_add() -> None:
    first = "\n".join(row for row, _ in ROWS)
    sections = ["§2.1", "§2.2", "§2.3", "§3.1", "§3.2", "§4", "§5", "appendix", "Remark 1", "Remark 2", "Theorem 1"]
    new = ("traffic", "rule of the planner", "kind of set", "format")
    assert [
        words for words in (*sections, "Tables 1, 2", *(f"a new {what}" for what in new)) if words not in first
    ] == []


def test_it_fits_a_screen() -> None:
    assert len(TEXT.splitlines()) <= 45 and TEXT.index("|") < 350
