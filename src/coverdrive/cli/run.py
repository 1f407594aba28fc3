"""``coverdrive run``: everything, from recordings to the report."""

from dataclasses import asdict
from typing import Any

from coverdrive.cli.driving.dial import Risk, dial_and_print
from coverdrive.cli.driving.study import study_and_print
from coverdrive.cli.learning.calibrations import compare_and_save
from coverdrive.cli.learning.fit import USUAL, Learning, fit_and_print
from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import console, processes
from coverdrive.errors import SettingError
from coverdrive.simulation.studies.ahead import compiled_ahead


def run(
    *,
    learning: Learning = USUAL,
    risk: Risk = None,
    trials: options.Trials = None,
    traffic: options.TrafficName = None,
    vehicles: options.Vehicles = None,
    workers: options.Workers = None,
) -> dict[str, Any]:
    """Do everything: learn, certify, test, compare methods, drive a closed-loop study, and draw the report.

    A run that was stopped goes on with its study where it was if it is started again with the same settings.

    For example:

    - in generated traffic, to `results/`: `coverdrive run`
    - learn from recordings, and drive on a road like theirs: `coverdrive run --recording scenarios/ --out us101`
    - on a road with bends and a ramp: `coverdrive run --road curved --traffic drivers --out curved`
    - with sets as bold as drives prove to be safe: `coverdrive run --traffic drivers --risk 0.01`
    """
    with compiled_ahead():
        with waiting():
            from coverdrive.reporting.contents import Certified
            from coverdrive.reporting.report import draw_everything
            from coverdrive.results import Results, certificate_record
            from coverdrive.simulation.studies.study import check_early_end
            from coverdrive.simulation.traffic.replay import REPLAYS
        results, recording = Results(learning.out), learning.recording or []
        size = {"trials": trials, "workers": workers, "vehicles": vehicles}
        asked = learning.experiment(study=size, traffic={"kind": traffic})  # refused before hours of learning
        replays = asked.traffic.kind in REPLAYS
        if risk is not None and replays:
            raise SettingError(
                f"--risk proves drives of new traffic, and those with --traffic {asked.traffic.kind} are of recorded "
                "scenes; run without --risk, and choose λ on groups of scenes by `coverdrive dial`"
            )
        check_early_end(asked.study.until_width, replays)
        fitted = fit_and_print(learning, results, study=size, traffic={"kind": traffic})
        compared = compare_and_save(results)
        if risk is not None:
            from coverdrive.dialling.dial import Request

            dial_and_print(results, results.experiment, Request(risk), recording, None)
        study = results.study(results.experiment, recording)
        studied = study_and_print(study, results, results.experiment.study)
    with stages():
        page = draw_everything(results.fitted, study, processes(results.experiment.study))
    console.print(f"Results are in {learning.out}; look at {page}")
    return {
        **certificate_record(Certified.of(fitted)),
        "methods": [asdict(each) for each in compared],
        **studied,
        "report": str(page),
    }
