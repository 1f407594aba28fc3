"""Recordings of an own format are read, fitted and certified: `python examples/own_data.py mine/`.

Without a folder, one is written first, of generated traffic: rows of car, milliseconds, feet and miles per hour.
"""

import argparse
from pathlib import Path

import polars as pl

import coverdrive as cd
from coverdrive.simulation.drivers.generated import GeneratedSettings

FOOT, MILE_PER_HOUR = 0.3048, 0.44704


def read_mine(file: Path, how: object) -> list[cd.MapTracks]:
    """What is driven on in a file, in metres and seconds on a plane; the lanes are estimated from the tracks."""
    table = pl.read_csv(file).select(
        vehicle="car",
        time=pl.col("ms") / 1000,
        x=pl.col("east_ft") * FOOT,
        y=pl.col("north_ft") * FOOT,
        speed=pl.col("mph") * MILE_PER_HOUR,
    )
    return [cd.MapTracks(file.stem, table)]


def write_mine(folder: Path, scenes: int) -> None:
    """Some generated traffic in this format."""
    folder.mkdir()
    for number, each in enumerate(cd.generate(GeneratedSettings(scenes=scenes))):
        rows = each.table.select(
            car="vehicle",
            ms=(1000 * pl.col("time")).round().cast(pl.Int64),
            east_ft=pl.col("lon") / FOOT,
            north_ft=pl.col("lat") / FOOT,
            mph=pl.col("speed") / MILE_PER_HOUR,
        )
        rows.write_csv(folder / f"scene-{number}.csv")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path, nargs="?", default=Path("mine"))
    options.add_argument("--scenes", type=int, default=24, help="to write, if there is no folder")
    given = options.parse_args()
    if not given.folder.exists():
        write_mine(given.folder, given.scenes)
    cd.register_reader("mine", read_mine, lambda head: {"car", "ms"} <= head.columns, numbers="restart")
    print(cd.fit(cd.read(given.folder)).predictor.certificate.sentence)


if __name__ == "__main__":
    main()
