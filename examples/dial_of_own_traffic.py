"""The dial proves what drives risk in a traffic of one's own: `python examples/dial_of_own_traffic.py`.

All vehicles keep their speed, and one of them brakes hard after a second.
"""

import argparse
from pathlib import Path

import numpy as np

import coverdrive as cd
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.traffic.model import TrafficStep
from coverdrive.simulation.traffic.motion import with_states


class OneBrakes:
    """Constant speed, but for one vehicle."""

    deceleration = 6.0
    """[m/s²]"""

    def reset(self, scene: cd.Scene, road: cd.Road, rng: np.random.Generator) -> None:
        """Choose who brakes."""
        self.time = 0.0
        self.braking = int(rng.choice(np.delete(np.flatnonzero(scene.valid), EGO)))

    def step(self, scene: cd.Scene, dt: float) -> TrafficStep:
        """Move everybody but the ego."""
        self.time += dt
        states, own = scene.states, scene.states[EGO].copy()
        if self.time > 1.0:
            states[self.braking, 2] = max(states[self.braking, 2] - self.deceleration * dt, 0.0)
        states[:, 0] += dt * states[:, 2]
        states[EGO] = own
        return TrafficStep.without_bases(with_states(scene, states))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--predictor", type=Path, default=Path("coverdrive-demo/predictor.safetensors"))
    options.add_argument("--folder", type=Path, default=Path("dial-braking"))
    options.add_argument("--risk", type=float, default=0.05)
    options.add_argument("--confidence", type=float, default=0.9)
    options.add_argument("--duration", type=float, default=10.0, help="[s] of a drive")
    given = options.parse_args()
    predictor = cd.Predictor.load(given.predictor)
    proved = cd.dial(
        predictor, folder=given.folder, traffic=OneBrakes, risk=given.risk, confidence=given.confidence,
        scales=[predictor.scale], episode=EpisodeSettings(duration=given.duration),
    )  # fmt: skip
    print(proved.sentence)


if __name__ == "__main__":
    main()
