"""Many rows are worked on part by part where values on the way would take much memory."""

PART = 2**16
"""rows of a part"""


def parts(rows: int) -> list[slice]:
    """The parts of so many rows, in their order."""
    return [slice(first, min(first + PART, rows)) for first in range(0, rows, PART)]
