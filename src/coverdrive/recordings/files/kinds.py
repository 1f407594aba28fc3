"""Classes of vehicles, in the words of the data sets."""

from collections import Counter

import polars as pl

KINDS = ("unknown", "car", "van", "truck", "bus", "motorcycle")
"""Classes of vehicles; a recording has their numbers"""

NUMBER_OF = {name: number for number, name in enumerate(KINDS)} | {"trailer": 3, "medium": 2, "van/truck": 2, "taxi": 1}
"""Number of the classes, by what the data sets call them"""

OTHERS = ("pedestrian", "bicycle", "cyclist", "pedestrian/bicycle", "animal", "scooter", "train")
"""What moves on a road without being traffic of a motorway"""


def with_kinds(table: pl.DataFrame, repairs: Counter[str]) -> pl.DataFrame:
    """The rows of vehicles, with the column ``kind`` from the word in ``class``.

    ``repairs`` gains ``rows of other road users``, which are left out.
    """
    others = table["class"].is_in(OTHERS)
    repairs["rows of other road users"] += int(others.sum())
    kind = pl.col("class").replace_strict(NUMBER_OF, default=0, return_dtype=pl.Int8)
    return table.filter(~others).with_columns(kind=kind).drop("class")
