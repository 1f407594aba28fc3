"""A file of the size and shape of the portal's whole export is read in bounded memory."""

import json
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

READ = """
import json, sys
from pathlib import Path
from coverdrive.recordings.read import read

recordings = read([Path(sys.argv[1])], location="us-101")
status = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines())
print(json.dumps({
    "rows": [len(recording.table) for recording in recordings],
    "vehicles": [recording.table["vehicle"].n_unique() for recording in recordings],
    "groups": len(set().union(*(recording.table["group"].unique().to_list() for recording in recordings))),
    "repairs": [recording.repairs for recording in recordings],
    "bytes": 1024 * int(status["VmHWM"].split()[0]),
}))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the peak memory of a process is read from Linux's /proc")
def test_a_large_file_of_several_sites_is_read_in_bounded_memory(make_ngsim, tmp_path: Path):
    path = tmp_path / "portal.csv"
    stretch = make_ngsim(vehicles=2000, seconds=40)  # 800,000 rows
    with path.open("w", encoding="utf-8") as stream:
        for period in range(2):
            for site in ("i-80", "us-101", "lankershim"):
                start = 1_118_846_980_200 + 900_000 * period
                part = stretch.with_columns(Location=pl.lit(site), Global_Time=start + 100 * pl.col("Frame_ID"))
                part = part[:400_000] if site != "us-101" else part
                part.write_csv(stream, include_header=period == 0 and site == "i-80")
    assert path.stat().st_size > 2.5e8

    done = subprocess.run([sys.executable, "-c", READ, str(path)], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["rows"] == [796_000, 796_000]  # every track begins 0.2 s later: what is seen comes from the past
    assert found["vehicles"] == [2000, 2000]
    assert found["repairs"] == [{}, {}]
    assert found["groups"] == 2  # 900 s apart, 40 s each
    assert found["bytes"] < 2.5e9
