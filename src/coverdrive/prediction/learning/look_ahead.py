"""No input of a network may know the future, which no car on the road can."""

from collections.abc import Sequence

from coverdrive.errors import SettingError
from coverdrive.prediction.learning.inputs import Inputs
from coverdrive.recordings.recording import Recording


def refuse_look_ahead(recordings: Sequence[Recording], inputs: Inputs) -> None:
    """Refuse lateral speeds that were estimated from later positions: they tell which way a vehicle is about to go.

    Raises:
        SettingError: the inputs hold the lateral motion, and a recording was smoothed with a look into the future.
    """
    knowing = [recording.name for recording in recordings if not recording.causal]
    if inputs == "motion" and knowing:
        raise SettingError(
            f'inputs = "motion" needs headings that know nothing of the future, but {len(knowing)} of '
            f"{len(recordings)} recordings ({knowing[0]!r} is one) were smoothed with later positions; read them with "
            "causal = true in [smoothing] (of generated traffic with noise, [generated.smoothing]), or take "
            'inputs = "derived" in [prediction.training]'
        )
