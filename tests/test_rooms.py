"""The rooms of the house: each says its door, as the import contract has it; what is loaded by name keeps to both."""

import ast
import re
import tomllib
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import coverdrive
from coverdrive import cli
from coverdrive.extras import EXTRAS
from coverdrive.simulation.traffic.kinds import TRAFFICS

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "coverdrive"
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
KEPT = {
    module: contract["allowed_importers"]
    for contract in CONTRACTS
    if contract["type"] == "protected"
    for module in contract["protected_modules"]
}
"""module that is kept to a room or hall -> who may import it"""

ROOMS = sorted(
    folder for folder in (*SOURCE.glob("*/*/"), SOURCE / "paper") if (folder / "__init__.py").is_file()
)  # fmt: skip


def named(path: Path) -> str:
    return ".".join(("coverdrive", *path.relative_to(SOURCE).with_suffix("").parts))


def door_of(room: Path) -> str:
    """What a room says of its door, up to the end of the sentence."""
    text = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8"))) or ""
    found = re.search(r"^Door: (.+?)(?:\. |\.$)", text, re.DOTALL | re.MULTILINE)
    assert found, f"{named(room)} does not say its door"
    return found[1]


@pytest.mark.parametrize("room", ROOMS, ids=named)
def test_a_room_says_which_modules_others_may_import(room: Path) -> None:
    modules = {named(path) for path in room.glob("[!_]*.py")}
    door, kept = door_of(room), modules & set(KEPT)
    if door.startswith("all of it"):
        assert not kept
    elif door.startswith("none"):
        assert kept == modules
    else:
        assert {named(room / name) for name in re.findall(r"`(\w+)`", door)} == modules - kept


def test_what_is_kept_exists() -> None:
    assert KEPT and all(find_spec(module) for module in KEPT)


def by_name() -> Iterator[tuple[str, str, str]]:
    """Every module that is loaded by a name in a table, who loads it, and what is taken from it."""
    for name, place in coverdrive._PLACES.items():
        module, _, inner = place.partition(":")
        yield "coverdrive", f"coverdrive.{module}", inner or name
    for module, *names in TRAFFICS.values():
        for name in names:
            yield "coverdrive.simulation.traffic.registry", f"coverdrive.simulation.traffic.{module}", name
    for name, file in cli._COMMANDS.items():
        yield "coverdrive.cli", f"coverdrive.cli.{file}", name


@pytest.mark.parametrize(("loader", "module", "name"), [*by_name()])
def test_what_is_loaded_by_name_is_a_door(loader: str, module: str, name: str) -> None:
    assert hasattr(import_module(module), name)
    assert all(f"{loader}.".startswith(f"{room}.") for room in KEPT.get(module, ()))


def test_modules_in_words_exist() -> None:
    assert all(find_spec(extra.purpose) for extra in EXTRAS.values() if extra.purpose.startswith("coverdrive."))


def asked_for(path: Path) -> set[str]:
    """Packages that a file asks for by name."""
    text = path.read_text(encoding="utf-8")
    if not re.search("require|import_module|__import__", text):
        return set()
    calls = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call))
    loading = (
        call.args[0]
        for call in calls
        if call.args and re.search(r"(^|\.)(require|import_module|__import__)$", ast.unparse(call.func))
    )
    return {
        argument.value.partition(".")[0]
        for argument in loading
        if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
    }


def forbidden() -> Iterator[tuple[str, str]]:
    for contract in CONTRACTS:
        if contract["type"] == "forbidden":
            for module in set(contract["forbidden_modules"]) - {"coverdrive"}:
                for source in contract["source_modules"]:
                    yield module, source


def test_the_contract_also_holds_for_what_is_loaded_by_name() -> None:
    ignored = {line for contract in CONTRACTS for line in contract.get("ignore_imports", ())}
    loaded = {(named(path), package) for path in SOURCE.rglob("*.py") for package in asked_for(path)}
    assert ("coverdrive.league.paper_way", "casadi") in loaded
    for module, package in loaded:
        for kept, source in forbidden():
            if package == kept and f"{module}.".startswith(f"{source}.") and f"{module} -> {package}" not in ignored:
                pytest.fail(f"{module} loads {package}, which {source} must not")
