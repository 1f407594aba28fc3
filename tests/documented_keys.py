"""Keys of the JSON that commands print, as the documentation lists them."""

import re
from collections import defaultdict
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "commands.md"


def documented_keys() -> dict[str, list[set[str]]]:
    """The keys of every command, and of the forms of it that print others."""
    from coverdrive.simulation.measures.trial import COLUMNS

    found: dict[str, list[set[str]]] = defaultdict(list)
    text = PAGE.read_text(encoding="utf-8").partition("## Results as JSON")[2].partition("\n## ")[0]
    for command, listed in re.findall(r"^\| `(\w+).*?` \| (.*) \|$", text, re.MULTILINE):
        keys = set(re.findall(r"`(.+?)`", listed))
        found[command].append(keys - {"trials.parquet"} | (set(COLUMNS) if "trials.parquet" in keys else set()))
    return found
