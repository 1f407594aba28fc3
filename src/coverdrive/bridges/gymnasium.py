"""The closed loop as an environment of Gymnasium, ``coverdrive/Motorway-v0``, for agents learned or written by hand.

An episode is that of `coverdrive.simulation.drives.episode` with the same seed: traffics, starts, motion of the ego,
collisions and fault are the same code. Importing this module registers the environment.
"""

from collections.abc import Sequence
from copy import deepcopy
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from pydantic import Field

from coverdrive.arguments import all_of, of_kind, shown, wholes
from coverdrive.bridges.observations import Shown, observation_of
from coverdrive.bridges.rendering import View
from coverdrive.errors import SettingError, blaming
from coverdrive.extras import require
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.constants import vehicle_of
from coverdrive.planning.problem.vehicle import VehicleSettings, allowed
from coverdrive.planning.solver.manoeuvres import lane_seeking
from coverdrive.recordings.recording import Recording
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.settings import Settings, checked, merged
from coverdrive.simulation.drives.episode import EpisodeSettings, begin, move
from coverdrive.simulation.drives.fault import collision_at
from coverdrive.simulation.drives.outcome import Outcome
from coverdrive.simulation.drives.trace import Decision, Step, Trace, driven, make_trace
from coverdrive.simulation.measures.misses import find_windows
from coverdrive.simulation.predictor import Belief, Predictor, as_given, check_period
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.roads.places import Place, recorded_place
from coverdrive.simulation.studies.setup import MOST_VEHICLES, AnyTraffic, traffic_of
from coverdrive.simulation.traffic.replay import cut_scenarios

if TYPE_CHECKING:
    import gymnasium
else:
    gymnasium = require("gymnasium")

NAME = "coverdrive/Motorway-v0"

ACTION = np.array([8.0, 0.5])
"""acceleration [m/s²] and yaw rate [rad/s] of the continuous action (1, 1)"""
_ACCELERATIONS = (-3.0, 0.0, 2.0)
"""[m/s²] of the discrete actions"""
Actions = Literal["continuous", "discrete"]
"""kinds of actions"""
Rendered = Literal["human", "rgb_array"]
"""ways to be shown"""
_PATH_STEP = 0.25
"""[s] between two points of predicted paths"""


class RewardSettings(Settings):
    """What an agent is rewarded for: at most 1 for every second, and less for what it should not do."""

    wanted_speed: float = Field(default=30.0, gt=0, le=120)
    """[m/s] along the road, at which progress is 1 a second; it is 0 at no and at twice this speed"""
    discomfort: float = Field(default=0.02, ge=0, le=10)
    """[s⁴/m²] of the squared acceleration along and across, a second"""
    contact: float = Field(default=20.0, ge=0, le=1e6)
    """of touching another vehicle, whoever is at fault, and of leaving the road; both end the episode"""


class _Options(Settings):
    """What an environment is told in words, numbers and settings."""

    observation: Shown
    action: Actions
    slots: int = Field(ge=1, le=1000)
    sets: bool
    render_mode: Rendered | None
    episode: EpisodeSettings = EpisodeSettings()
    reward: RewardSettings = RewardSettings()
    car: VehicleSettings = VehicleSettings()


class Motorway(gymnasium.Env[Any, Any]):
    """One car on a motorway; everything else is our simulation."""

    metadata = {"render_modes": list(get_args(Rendered)), "render_fps": 10}  # noqa: RUF012

    def __init__(
        self,
        traffic: AnyTraffic = "drivers",
        vehicles: int | Sequence[int] | None = None,
        observation: Shown = "affordance",
        action: Actions = "continuous",
        *,
        slots: int = 16,
        predictor: Predictor | None = None,
        sets: bool = False,
        recordings: Sequence[Recording] = (),
        episode: EpisodeSettings | None = None,
        reward: RewardSettings | None = None,
        car: VehicleSettings | None = None,
        render_mode: Rendered | None = None,
    ):
        """Make an environment.

        Args:
            traffic: as of `coverdrive.study`.
            vehicles: number of uncontrolled vehicles, 0 to 100, or several numbers of which each episode has one; if
                left out, 5, or as many as were recorded.
            observation: see `coverdrive.bridges.observations.observation_of`.
            action: ``continuous``: shares of `ACTION`, from −1 to 1. ``discrete``: 3 · lane + speed, where lane is to
                steer to the centre of the lane to the right of the one that the ego is in (0), of this one (1), or of
                the one to the left (2), and speed is to brake at 3 m/s² (0), to keep it (1), or to accelerate at
                2 m/s² (2). What is applied is the nearest that the limits of the car allow.
            slots: how many vehicles the observation ``scene`` holds, the ego's included, 1 to 1000.
            predictor: for traffics that drive members of predicted sets, and for ``sets``.
            sets: whether ``info`` has the predicted paths of the scene that is shown as ``sets``, and, at the end of an
                episode, how many ``windows`` were seen and how many of them were ``misses``: at that of ``episode``, as
                nobody tells of ``max_episode_steps``. This takes time.
            recordings: to replay; other traffic drives on a road like theirs.
            episode: start, length and time steps; what is not set is as on the road.
            reward: what is rewarded.
            car: limits of the ego.
            render_mode: ``rgb_array``: `render` gives a picture of 1200 × 240 pixels. ``human``: a window shows every
                step in real time. Drives are also drawn from their `trace`.

        Raises:
            SettingError: an option makes no sense, there is no such traffic, no predictor where one is needed, or no
                window can be opened.
        """
        parts = {"episode": episode, "reward": reward, "car": car}
        words = {"observation": observation, "action": action, "slots": slots, "sets": sets, "render_mode": render_mode}
        given = checked(_Options, words | {name: part for name, part in parts.items() if part is not None})
        if predictor is None and sets:
            raise SettingError("predicted sets need a predictor; give one, or leave out sets")
        if predictor is not None:
            of_kind("predictor", predictor, Predictor, "a predictor (horizon, predict, choices)")
            check_period(predictor, given.episode.step)
        recordings = all_of("recordings", recordings, Recording, "recordings, as `coverdrive.read` gives")
        self._traffic = traffic_of(_alone(traffic), predictor, cut_scenarios(recordings))
        place = recorded_place(recordings) if recordings else Place(vehicles=(5,))
        self._vehicles = wholes("vehicles", place.vehicles if vehicles is None else vehicles, 0, MOST_VEHICLES)
        self._given = predictor if given.sets else None
        self._predictor: Belief | None = None
        self._paths: PredictedPaths | None = None
        own = given.episode.model_dump(exclude_unset=True)
        self._settings = EpisodeSettings.model_validate(merged(place.parts["episode"], own))
        self._reward = given.reward
        self._limits, self.render_mode = vehicle_of(given.car), given.render_mode
        self.metadata = self.metadata | {"render_fps": round(1 / self._settings.step)}
        self._view = View(render_mode == "human", self._settings.step) if render_mode else None
        self.observation_space, self._shown = observation_of(given.observation, given.slots)
        self._discrete = given.action == "discrete"
        self.action_space = gymnasium.spaces.Discrete(9) if self._discrete else gymnasium.spaces.Box(-1.0, 1.0, (2,))
        self._outcome: Outcome | None = None
        self._scenes, self._steps, self._open = list[Scene](), list[Step](), False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode: trial 0 of a study with the same seed, where one is given.

        There are no ``options``; a SettingError if any are given.
        """
        if of_kind("options of a reset", options, (dict, type(None)), "none"):
            raise SettingError(f"a reset has no options, got {shown(options)}; make the environment with them instead")
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(2**63)) if seed is None else seed
        root = np.random.SeedSequence(drawn, spawn_key=(0,))  # as trial 0 of a study
        vehicles = self._vehicles[int(root.generate_state(1)[0]) % len(self._vehicles)]
        scene, self._road, self._last = begin(self._traffic, self._settings, vehicles, root)
        self._scenes, self._steps, self._outcome = [scene], [], None
        self._applied, self._open = (0.0, 0.0), True
        self._paths, self._predictor = None, self._given and as_given(self._given)
        return self._told()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Drive for one time step; it ends with a contact, off the road, or when its time is over.

        A SettingError if the action is none of the `action_space`'s kind; numbers beyond its bounds are.
        """
        if not self._open:
            raise gymnasium.error.ResetNeeded("the episode is over, or has not begun; reset the environment")
        before, dt = self.scene, self._settings.step
        own = before.states[EGO]
        self._applied = allowed(own, self._wish(action), self._applied, dt, self.road, self._limits)
        moved = move(before, np.array(self._applied), self._traffic, dt)
        self._scenes.append(moved.scene)
        if self._paths is not None:
            plan = driven(before, moved.scene, np.array([self._applied]), dt)
            self._steps.append(Step(Decision(self._paths, plan), moved))
        self._outcome = collision_at(len(self._scenes) - 1, self._scenes, dt, self.road)
        lon, lat, speed, heading = moved.scene.states[EGO].tolist()
        edges = self.road.edges_at(lon)
        off_road = not edges[0] <= lat <= edges[-1]
        ended = self._outcome is not None or off_road
        late = not ended and len(self._scenes) > self._last
        self._open = not (ended or late)
        reward, across = self._reward, speed * self._applied[1]
        missing = abs(speed * np.cos(heading) / reward.wanted_speed - 1)
        gained = 1 - missing - reward.discomfort * (self._applied[0] ** 2 + across**2)
        observation, info = self._told(off_road)
        return observation, dt * gained - reward.contact * ended, ended, late, info

    @property
    def road(self) -> Road:
        """On which the episode takes place."""
        self._check_begun()
        return self._road

    @property
    def scene(self) -> Scene:
        """All vehicles as they are now, the ego in slot 0."""
        self._check_begun()
        return self._scenes[-1]

    def render(self) -> Any:
        """The picture (240, 1200, 3) of what is now, with ``render_mode="rgb_array"``; a window shows itself."""
        if self._view is None:
            raise SettingError('nothing is drawn; make the environment with render_mode="rgb_array" or "human"')
        return self._view.pixels(*self._seen()) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._view is not None:
            self._view.close()

    def trace(self) -> Trace:
        """The episode up to now, at least one step, for all that measures and draws drives; of an env with ``sets``.

        Its plans are the single steps that were driven, which nobody has shown to be clear of anything.

        Raises:
            SettingError: there are no sets, or there is no step.
        """
        if self._given is None:
            raise SettingError("a trace has the predicted sets of every step; make the environment with sets=True")
        if not self._steps:
            raise SettingError("a trace has at least one step, and none was driven; reset the environment and drive")
        return make_trace(self._scenes[0], self.road, self._steps, self._settings.step, self._outcome)

    def _check_begun(self) -> None:
        if not self._scenes:
            raise gymnasium.error.ResetNeeded("no episode has begun; reset the environment")

    def _wish(self, action: Any) -> tuple[float, float]:
        """Acceleration [m/s²] and yaw rate [rad/s] that an action asks for."""
        if not self._discrete:
            try:
                asked = np.asarray(action)
            except ValueError:  # rows of several lengths
                asked = np.array(None)
            if asked.shape != (2,) or asked.dtype.kind not in "fiu" or not np.isfinite(asked).all():
                raise SettingError(f"an action is two finite numbers, from -1 to 1, got {shown(action)}")
            acceleration, yaw_rate = (np.clip(asked, -1e6, 1e6) * ACTION).tolist()
            return acceleration, yaw_rate
        if not self.action_space.contains(action):
            raise SettingError(f"an action is a whole number from 0 to 8, got {shown(action)}")
        side, faster = divmod(int(action), 3)
        road, (lon, lat, speed, heading) = self.road, self.scene.states[EGO].tolist()
        own = int(road.lane_at(lon, lat))
        lane = min(max(own + side - 1, 0), road.lanes - 1)
        lane = lane if road.has_lane(lon)[lane] else own
        centre = float(road.edges_at(lon)[lane : lane + 2].mean())
        return _ACCELERATIONS[faster], lane_seeking(lat, speed, heading, centre, 1.0)

    def _seen(self) -> tuple[Scene, Road, PredictedPaths | None, str]:
        """What a picture shows."""
        now = (len(self._scenes) - 1) * self._settings.step
        return self.scene, self.road, self._paths, f"{now:.1f} s   {self.scene.speed[EGO]:.1f} m/s"

    def _told(self, off_road: bool = False) -> tuple[Any, dict[str, Any]]:
        """What is observed, and the info of it; in a window, if there is one, it is shown."""
        info = self._info(off_road)
        if self._view is not None:
            self._view.show(*self._seen())
        return self._shown(self.scene, self.road), info

    def _info(self, off_road: bool) -> dict[str, Any]:
        """How it went, and what is predicted if it is asked for."""
        found = self._outcome
        info: dict[str, Any] = {
            "collision": found.kind.value if found else "",
            "at_fault": found.at_fault.value if found else "",
            "partner": found.partner if found and found.partner is not None else -1,
            "off_road": off_road,
        }
        if self._given is not None and self._predictor is not None:
            with blaming("predictor", self._predictor):
                steps = int(self._given.horizon / _PATH_STEP + 1e-9)
                self._paths = self._predictor.predict(self.scene, self.road, EGO, _PATH_STEP, steps)
            info["sets"] = self._paths
            if not self._open:
                windows = find_windows(self.trace())
                info |= {"windows": int(windows.seen.sum()), "misses": int(windows.missed.sum())}
        return info


def _alone(traffic: AnyTraffic) -> AnyTraffic:
    """A traffic that no other environment drives among."""
    try:
        return deepcopy(traffic)
    except Exception as error:
        name = type(traffic).__qualname__
        raise SettingError(f"the traffic {name} cannot be copied ({error}); give what makes it instead") from error


if NAME not in gymnasium.registry:
    gymnasium.register(NAME, entry_point=f"{__name__}:Motorway")
