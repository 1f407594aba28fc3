"""One drive in one call."""

from collections.abc import Callable, Sequence

from coverdrive.planning.plan import Planner
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.episode import EpisodeSettings
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.setup import Setup
from coverdrive.simulation.trace import Trace
from coverdrive.simulation.traffic import Traffic
from coverdrive.simulation.traffics import TrafficSettings


def simulate(
    predictor: Predictor,
    planner: Planner | Callable[[], Planner] | None = None,
    *,
    traffic: str | TrafficSettings | Traffic | Callable[[], Traffic] = "set-sampling",
    vehicles: int = 5,
    seed: int = 0,
    trial: int = 0,
    recordings: Sequence[Recording] = (),
    episode: EpisodeSettings | None = None,
) -> Trace:
    """Drive once: the same drive as trial ``trial`` of a study with this seed and number of vehicles.

    Args:
        predictor: of the ego.
        planner: of the ego; ours with its defaults if left out.
        traffic: as in `study`.
        vehicles: number of uncontrolled vehicles.
        seed: of the drive; the same seed gives the same drive on every machine.
        trial: number of the trial.
        recordings: to replay.
        episode: start, length and time steps.

    Raises:
        StartError: the vehicles cannot be placed.
        SettingError: there is no such traffic, or the planner looks farther than the predictor.
    """
    return Setup.of(predictor, planner, traffic, (vehicles,), seed, recordings, episode).drive(trial)
