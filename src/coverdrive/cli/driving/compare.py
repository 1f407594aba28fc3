"""``coverdrive compare``: two studies on the same seeds."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.shared.bars import waiting
from coverdrive.cli.shared.options import console


def compare(
    first: Annotated[
        Path, Parameter(help="Folder of a study, or the results folder around it, as in `results/study-drivers`.")
    ],
    second: Annotated[
        Path, Parameter(help="The same, as in `other/`; its trials must have the same seed and numbers of vehicles.")
    ],
    /,
) -> dict[str, Any]:
    """Compare two studies trial by trial: paired differences, second minus first, with 95 % intervals.

    For example:

    - two results folders: `coverdrive compare one/ other/`
    - two variants of a sweep: `coverdrive compare results/sweep/traffic.kind=drivers results/sweep/traffic.kind=mixed`
    """
    with waiting():
        from coverdrive.reporting.tables.study import comparison_table
        from coverdrive.simulation.studies.comparison import compare as compare_studies
    comparison = compare_studies(first, second)
    for name, (one, two) in comparison.settings.items():
        console.print(f"{name}: {json.dumps(one)} and {json.dumps(two)}", highlight=False, markup=False)
    console.print(comparison_table(comparison))
    return asdict(comparison)
