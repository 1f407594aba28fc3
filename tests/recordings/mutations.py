"""Random damage to files: to their bytes, and by their grammar, to cells, columns and rows, values and elements."""

import json
import re
from copy import deepcopy
from typing import Any
from xml.etree import ElementTree

import numpy as np

NASTY = (
    *(
        "0",
        "-0",
        "-1",
        "1e-300",
        "1e9",
        "1e18",
        "1e30",
        "1e308",
        "-1e308",
        "1e999",
        "nan",
        "inf",
        "-inf",
        "0.04",
        "3.5",
    ),
    *("9223372036854775807", "9007199254740993", "18446744073709551616", "0x10", "1_000", "١٢", "1,5"),
    *("", "x", "é", "\0", '"', "None"),
)


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    """Bytes flipped, cut, put in, taken out or repeated, or numbers replaced."""
    found = bytearray(content)
    for _ in range(random.integers(1, 4)):
        size = max(1, len(found))
        begin, length = (
            int(random.integers(size)),
            int(random.integers(1, 1 + min(size, int(10 ** random.uniform(0, 3))))),
        )
        match random.integers(7):
            case 0:
                found[begin : begin + 1] = random.bytes(1)
            case 1:
                found[begin:] = b"" if random.random() < 0.3 else found[begin:]
            case 2:
                found[begin:begin] = random.bytes(length)
            case 3:
                del found[begin : begin + length]
            case 4:
                found[begin:begin] = found[begin : begin + length]
            case _:
                found = bytearray(with_nasty_number(bytes(found), random))
    return bytes(found)


def with_nasty_number(content: bytes, random: np.random.Generator) -> bytes:
    numbers = list(re.finditer(rb"-?\d+\.?\d*", content))
    if not numbers:
        return content
    place = numbers[random.integers(len(numbers))]
    return content[: place.start()] + str(random.choice(NASTY)).encode() + content[place.end() :]


def with_other_cells(content: bytes, random: np.random.Generator) -> bytes:
    """CSV: a cell, a column, its name or rows replaced, removed, repeated, multiplied or out of order."""
    head, *rows = [line.split(b",") for line in content.splitlines()]
    column = int(random.integers(len(head)))
    match random.integers(8):
        case 0:
            factor = float(random.choice(FACTORS))
            for row in rows:
                row[column] = scaled(row[column], factor)
        case 1:
            other = int(random.integers(len(head)))
            head[column], head[other] = head[other], head[column]
        case 2:
            head[column] = str(random.choice(NASTY)).encode()
        case 3:
            for row in (head, *rows):
                del row[column]
        case 4:
            random.shuffle(rows)
        case 5:
            rows = [rows[k] for k in random.integers(len(rows), size=int(len(rows) * random.uniform(0, 1.5)))]
        case 6:
            value = str(random.choice(NASTY)).encode()
            for row in rows:
                row[column] = value
        case _:
            rows[random.integers(len(rows))][column] = str(random.choice(NASTY)).encode()
    return b"\n".join(b",".join(row) for row in (head, *rows)) + b"\n"


FACTORS = (-1.0, 0.0, 0.25, 0.3048, 1 / 3.6, 0.5, 2.0, 3.28084, 3.6, 25.0, 1000.0)
"""of other units, rates and directions"""


def scaled(cell: bytes, factor: float) -> bytes:
    try:
        return f"{float(cell) * factor:.6g}".encode()
    except ValueError:
        return cell


VALUES = (None, True, {}, [], [[]], "x", -1, 0, 1e300, -1e300, float("nan"), float("inf"), 10**400, 0.5, 2**63)


def with_other_values(content: bytes, random: np.random.Generator) -> bytes:
    """JSON: a value anywhere replaced, removed or repeated."""
    whole = inside = json.loads(content)
    key: Any = int(random.integers(len(inside)))
    while isinstance(inside[key], dict | list) and len(inside[key]) and random.random() < 0.8:
        inside = inside[key]
        keys = list(inside) if isinstance(inside, dict) else range(len(inside))
        key = keys[random.integers(len(keys))]
    match random.integers(4):
        case 0:
            del inside[key]
        case 1 if isinstance(inside, list):
            inside.insert(key, inside[key])
        case _:
            inside[key] = VALUES[random.integers(len(VALUES))]
    return json.dumps(whole).encode()


def with_other_elements(content: bytes, random: np.random.Generator) -> bytes:
    """XML: an element removed, repeated, moved or emptied, its text or an attribute replaced."""
    root = ElementTree.fromstring(content)
    parents = [each for each in root.iter() if len(each)]
    parents = [each for each in parents if each.tag not in ("leftBound", "rightBound")] or parents
    parent = parents[random.integers(len(parents))]
    place = int(random.integers(len(parent)))
    child = parent[place]
    match random.integers(7):
        case 0:
            parent.remove(child)
        case 1:
            parent.insert(place, child)
        case 2:
            parents[random.integers(len(parents))].append(deepcopy(child))  # that may be the child itself
        case 3:
            child.clear()
        case 4:
            child.tag = parents[random.integers(len(parents))].tag
        case 5 if child.attrib:
            child.set(str(random.choice(list(child.attrib))), printable(str(random.choice(NASTY))))
        case _:
            leaves = [each for each in child.iter() if not len(each)]
            leaves[random.integers(len(leaves))].text = printable(str(random.choice(NASTY)))
    try:
        return ElementTree.tostring(root, "utf-8")
    except RecursionError:  # moved into itself
        return content


def printable(text: str) -> str:
    return text.replace("\0", "")


GRAMMARS = {".csv": with_other_cells, ".json": with_other_values, ".xml": with_other_elements}


def changed(name: str, content: bytes, random: np.random.Generator) -> bytes:
    """By the grammar that the ending of the name says, or the bytes."""
    grammar = next((each for ending, each in GRAMMARS.items() if name.endswith(ending)), damaged)
    return (grammar if random.random() < 0.6 else damaged)(content, random)
