"""``coverdrive dial``: how bold the ego may be, proved on drives."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.driving.study import AS_FITTED, Cluster, Driven
from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import between, console, processes
from coverdrive.errors import SettingError

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.dialling.dial import Dialled, Request
    from coverdrive.results import Results

Risk = Annotated[
    float | None,
    Parameter(
        validator=between(0, 1),
        help="Probability of a collision in a drive that is to be proved not to be exceeded, as in `--risk 0.002`.",
    ),
]


def dial(
    folder: options.Folder = Path("results"),
    /,
    *,
    risk: Annotated[Risk, Parameter(show_default=lambda _: "0.01")] = None,
    confidence: Annotated[
        float,
        Parameter(validator=between(0, 1), help="Probability with which the bound holds, as in `--confidence 0.95`."),
    ] = 0.99,
    event: Annotated[
        Literal["any", "own"],
        Parameter(help="What is counted: any collision of the ego, or those at its own fault, as in `--event own`."),
    ] = "any",
    scales: Annotated[
        list[float] | None,
        Parameter(
            consume_multiple=True,
            help="Scales λ of the predicted sets to try, 0 (the likeliest path alone) to 100, where 1 is what was "
            "calibrated; as in `--scales 0.3 0.6 1`. A single one is named beforehand and needs no pilot.",
            show_default=lambda _: "0 0.15 0.3 0.45 0.6 0.8 1",
        ),
    ] = None,
    procedure: Annotated[
        Literal["anytime", "fixed sequence", "Holm"] | None,
        Parameter(
            help="How several scales are kept from being tried until one passes by chance: from the safest to the "
            "fastest of the pilot, each driven until it is proved (anytime) or for --most drives (fixed sequence); or "
            "all of them, at levels that make up for their number (Holm). A single one needs none of it; "
            "as in `--procedure Holm`.",
            show_default=lambda _: "anytime",
        ),
    ] = None,
    pilot: Annotated[
        int,
        Parameter(
            converter=options.whole,
            validator=Number(gte=1),
            help="Drives at every scale that choose, as in `--pilot 200`.",
        ),
    ] = 100,
    most: Annotated[
        int | None,
        Parameter(
            converter=options.whole,
            validator=Number(gte=1),
            help="Drives to prove one scale at the most, as in `--most 5000`.",
            show_default=lambda _: "twice as many as are needed without a collision, of a single scale as many",
        ),
    ] = None,
    beside: Annotated[
        list[str] | None,
        Parameter(
            consume_multiple=True,
            help="Entrants of the league whose risk and speed in the pilot stand beside, as in `--beside idm-mobil "
            "constant-velocity-box`; sets are driven at every scale.",
        ),
    ] = None,
    driven: Driven = AS_FITTED,
    settings: options.Set = None,
    workers: options.Workers = None,
    cluster: Cluster = None,
) -> dict[str, Any]:
    """Find the boldest sets with which drives are proved to be safe enough, and let everything use them.

    Every scale drives pilot drives, which choose; drives of other seeds prove. What is proved is about drives in this
    traffic on this road with these settings; what is proved about windows of recorded traffic stands beside. A dial
    that was stopped goes on where it was.

    For example:

    - among reacting drivers: `coverdrive dial results --traffic drivers --risk 0.002`
    - one scale, named beforehand: `coverdrive dial results --traffic aggressive --vehicles 8 10 12 --scales 0.4`
    - chosen on groups of recorded scenes: `coverdrive dial results --traffic replay --recording scenarios/`
    - with others on the frontier: `coverdrive dial results --traffic drivers --beside idm-mobil constant-velocity`
    """
    with waiting():
        from coverdrive.dialling.dial import SCALES, Request
        from coverdrive.results import Results
        from coverdrive.simulation.traffic.replay import REPLAYS
    results = Results(folder)
    experiment = driven.experiment(results, settings, workers=workers)
    recording, road = driven.recording or [], driven.road
    results.check_replay((experiment.traffic.kind,), [] if beside else recording, road)
    if experiment.traffic.kind in REPLAYS:
        _refuse_proofs(event=event != "any", scales=scales, procedure=procedure, most=most, beside=beside)
    tried = tuple(scales or SCALES)
    request = Request(0.01 if risk is None else risk, confidence, event, tried, procedure, pilot, most)
    if experiment.traffic.kind in REPLAYS:
        with stages():
            chosen = results.choose_on_groups(
                experiment, request, recording, road, workers=processes(experiment.study), cluster=cluster
            )
        console.print(f"• {chosen.sentence}")
        return {"results": str(folder), "reached": False, "scale": chosen.scale, "sentence": chosen.sentence,
                "groups": chosen.table.to_dicts()}  # fmt: skip
    found = dial_and_print(results, experiment, request, recording, road, cluster, beside or [])
    return {"results": str(folder), **found.record}


def _refuse_proofs(**asked: Any) -> None:
    """Refuse the options that say how drives prove, as replays prove nothing."""
    if named := [f"--{name}" for name, value in asked.items() if value]:
        raise SettingError(
            f"{' and '.join(named)} would have no effect, as replays prove nothing: sets are compared that are left in "
            "5 to 80 % of the windows; leave it out, or choose another --traffic"
        )


def dial_and_print(
    results: "Results",
    experiment: "Experiment",
    request: "Request",
    recording: list[Path],
    road: str | None,
    cluster: str | None = None,
    beside: Sequence[str] = (),
) -> "Dialled":
    """Turn the dial, say what is proved, and let the folder use it; a `CertificateError` if it is too little."""
    from coverdrive.errors import CertificateError
    from coverdrive.reporting.figures.frontier import frontier_table

    with stages(kept="finished drives"):
        found = results.dial(
            experiment,
            request,
            recording,
            road,
            workers=processes(experiment.study),
            cluster=cluster,
            beside=beside,
        )
    console.print(frontier_table(found.frontier))
    if not found.reached:
        raise CertificateError(f"{found.sentence} The sets of {results.folder} are as they were")
    console.print(f"• {found.sentence}")
    console.print(f"• {found.windows.sentence}")
    return found
