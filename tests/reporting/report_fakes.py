"""A small hand-made drive, small bases, and the contents of a results folder."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import polars as pl
from rich.console import Console
from rich.table import Table

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.drives import Proof
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.certificates.methods import Method
from coverdrive.certificates.rule import Thresholds
from coverdrive.dialling.dial import Dialled
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.prediction.certifying.occupied import Occupied
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.fits.learned import EDGES, Learned
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.reporting.contents import Certified, Contents
from coverdrive.reporting.plotting.figure import Panel
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.outcome import Fault, Kind, Outcome
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.trial import SCHEMA, measure

STEPS, HORIZON = 12, 4
LONG = 200
"""steps of the long drive of the page: 20 s"""
LOST = 9
"""moment from which on no plan of `make_lost` is clear"""
COMES, LEAVES = 4, 6
"""moments of the drive of `make_stray`"""
PATHS_PER_VEHICLE = 3


def printed(table: Table, width: int = 80) -> str:
    """A table as a terminal shows it."""
    console = Console(width=width, markup=False)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def marks_of(panel: Panel, kind: type) -> list:
    """The marks of a kind in a panel."""
    return [mark for mark in panel.marks if isinstance(mark, kind)]


def scenes(steps: int) -> Scene:
    """The ego at 24 m/s, one vehicle at 20 m/s ahead in its lane, one beside it; the last slot is empty.

    The ego moves to the left at 0.5 m per step, so that its centre crosses into lane 1 in step 4, and it passes
    the vehicle beside it in step 8.
    """
    moment = np.arange(steps + 1)
    constant = np.ones_like(moment)[:, None]
    lon = np.stack([2.4 * moment, 40 + 2.0 * moment, 3.4 + 2.0 * moment, 0 * moment], axis=-1)
    lat = np.stack([-0.45 + 0.5 * moment + 1.8, 1.8 + 0 * moment, 9.0 + 0 * moment, 0 * moment], axis=-1)
    return Scene(
        lon=lon,
        lat=lat,
        speed=constant * np.array([24.4, 20.0, 19.6, 0.0]),
        heading=constant * np.array([0.2, 0.0, 0.0, 0.0]),
        length=constant * np.array([5.0, 4.0, 4.0, 4.0]),
        width=constant * np.array([2.0, 2.0, 2.0, 2.0]),
        valid=np.broadcast_to([True, True, True, False], (steps + 1, 4)),
    )


def predicted(scene: Scene) -> PredictedPaths:
    """Three paths for each of the vehicles 1 and 2, at 0, 0.5, … s."""
    vehicle = np.repeat([1, 2], PATHS_PER_VEHICLE)
    times = 0.5 * np.arange(HORIZON + 1)
    drift = np.tile([-1.0, 0.0, 1.0], 2)[:, None]
    lon = scene.lon[vehicle, None] + scene.speed[vehicle, None] * times
    lat = scene.lat[vehicle, None] + drift * times
    half_sizes = np.broadcast_to([2.5, 1.2], (len(vehicle), HORIZON + 1, 2))
    return PredictedPaths(np.stack([lon, lat], axis=-1), vehicle, half_sizes, 0.5)


def planned(scene: Scene, status: Status) -> Plan:
    """Straight on for two seconds."""
    times = 0.5 * np.arange(HORIZON + 1)
    states = np.tile([scene.lon[0], scene.lat[0], scene.speed[0], 0.0], (len(times), 1))
    states[:, 0] += scene.speed[0] * times
    return Plan(states, np.zeros((HORIZON, 2)), np.zeros(HORIZON), status, cost=0.0, seconds=0.01, dt=0.5)


def make_trace(steps: int = STEPS, kind: Kind = Kind.FINISHED) -> Trace:
    """A drive of 0.1 s steps whose plans were found in every possible way in turn."""
    scene = scenes(steps)
    moments = [jax.tree.map(lambda values, k=k: values[k], scene) for k in range(steps)]
    statuses = [Status.SOLVED, Status.FALLBACK, Status.INVALID_INPUT, Status.UNSAFE, Status.INVALID_INPUT]
    seconds = 0.01 + 0.001 * np.arange(steps)
    nothing = np.zeros((steps, 4), dtype=bool)
    collided = kind is not Kind.FINISHED
    return Trace(
        time=0.1 * np.arange(steps + 1),
        scene=scene,
        road=Road.straight(),
        paths=tuple(predicted(moment) for moment in moments),
        plans=tuple(planned(moment, statuses[k % len(statuses)]) for k, moment in enumerate(moments)),
        base=np.zeros((steps, 4), dtype=int),
        stuck=nothing,
        missed=nothing,
        prediction_seconds=seconds / 2,
        planning_seconds=seconds,
        wall_seconds=2 * seconds,
        outcome=Outcome(kind, 0.1 * steps, 1 if collided else None, Fault.OTHER if collided else Fault.NONE),
    )


def make_stray(steps: int = STEPS) -> Trace:
    """The same drive, but vehicle 1 is there from moment 4, and vehicle 2 jumps out of its set at moment 6."""
    trace = make_trace(steps)
    moment = np.arange(steps + 1)
    lat, valid = np.array(trace.scene.lat), np.array(trace.scene.valid)
    lat[moment >= LEAVES, 2] -= 3.0
    valid[moment < COMES, 1] = False
    return replace(trace, scene=replace(trace.scene, lat=lat, valid=valid))


def make_lost() -> Trace:
    """A drive that ends in a contact, before which there was a clear plan until moment 9."""
    trace = make_trace(kind=Kind.SIDE)
    status = [Status.UNSAFE if step >= LOST else Status.SOLVED for step in range(STEPS)]
    plans = tuple(replace(plan, status=each) for plan, each in zip(trace.plans, status, strict=True))
    return replace(trace, plans=plans)


def make_crowd(vehicles: int = 12, members: int = 6, points: int = 13, steps: int = 200) -> Trace:
    """A drive of 20 s among many vehicles on three lanes, each with a set of many paths over 3 s."""
    number, moment = np.arange(vehicles + 1), np.arange(steps + 1)[:, None]
    speed = np.where(number == 0, 24.0, 19.0 + number % 5)
    lon = 12.0 * (number - vehicles // 2) * (number > 0) + 0.1 * moment * speed
    lat = np.broadcast_to(1.8 + 3.6 * (number % 3), lon.shape)
    constant = np.ones(lon.shape)
    scene = Scene(lon, lat, constant * speed, 0 * lon, 4.8 * constant, 1.9 * constant, constant > 0)
    times = np.linspace(0, 3, points)
    vehicle = np.repeat(number[1:], members)
    drift = np.tile(np.linspace(-1, 1, members), vehicles)[:, None] * times
    half_sizes = np.stack([2.4 + 0.5 * times, 1.0 + 0.2 * times], axis=-1)
    half_sizes = np.broadcast_to(half_sizes, (len(vehicle), points, 2))
    nothing = np.zeros((steps, vehicles + 1), dtype=bool)
    paths: list[PredictedPaths] = []
    plans: list[Plan] = []
    for k in range(steps):
        path = np.stack([lon[k, vehicle, None] + speed[vehicle, None] * times, lat[k, vehicle, None] + drift], axis=-1)
        paths.append(PredictedPaths(path, vehicle, half_sizes, times[1]))
        states = np.tile([lon[k, 0], lat[k, 0], speed[0], 0.0], (points, 1))
        states[:, 0] += speed[0] * times
        zeros = np.zeros((points - 1, 2))
        plans.append(Plan(states, zeros, zeros[:, 0], Status.SOLVED, cost=0.0, seconds=0.01, dt=times[1]))
    return Trace(
        time=0.1 * moment[:, 0], scene=scene, road=Road.straight(), paths=tuple(paths), plans=tuple(plans),
        base=np.zeros(nothing.shape, dtype=int), stuck=nothing, missed=nothing,
        prediction_seconds=np.full(steps, 0.001), planning_seconds=np.full(steps, 0.002),
        wall_seconds=np.full(steps, 0.003),
        outcome=Outcome(Kind.FINISHED, 0.1 * steps, None, Fault.NONE),
    )  # fmt: skip


def make_trials(traces: dict[int, Trace]) -> pl.DataFrame:
    """The rows of some trials."""
    return pl.DataFrame([measure(trace, 0, trial) for trial, trace in traces.items()], schema=SCHEMA)


def make_frontier() -> pl.DataFrame:
    """Three scales of our own, of which the middle one is proved, and a driver without sets."""
    line = {"claim": 0.1, "own_fault": 0, "share_unsafe": 0.01, "headway": 1.2, "speed_low": 30.0, "speed_high": 36.0}
    ours = line | {"who": "default", "drives": 100, "drives_of": "pilot", "rate_low": 0.0, "rate_high": 0.1}
    return pl.DataFrame(
        [
            ours | {"scale": 0.0, "collisions": 4, "mean_speed": 35.0},
            ours | {"scale": 0.5, "collisions": 1, "mean_speed": 34.0},
            ours | {"scale": 1.0, "collisions": 0, "mean_speed": 32.0},
            ours | {"who": "idm-mobil", "scale": None, "claim": None, "collisions": 2, "mean_speed": 25.0},
            ours | {"scale": 0.5, "drives_of": "proof", "drives": 2301, "rate_high": 0.002, "collisions": 0,
                    "mean_speed": 34.5},
        ]
    )  # fmt: skip


def make_dialled() -> Dialled:
    """What was dialled among them."""
    proof = Proof("touch anybody", 0, 2301, 0.002, 0.002, 0.99, "named beforehand", "20-s drives")
    return Dialled(0.5, True, (proof,), 34.5, make_certificate(5), "There.", {}, make_frontier())


def make_contents(traces: dict[int, Trace] | None = None, bases: int = 5) -> Contents:
    """A results folder in which everything was done: basis, certificates, all methods, and a study."""
    traces = {0: make_trace(), 7: make_trace(kind=Kind.SIDE)} if traces is None else traces
    random, basis = np.random.default_rng(0), make_basis(bases)
    network = Network.create(random.normal(size=(9, 21)), (4,), bases, random)
    certificate = make_certificate(bases)
    rates = {"windows": Rate(5, 1000, 0.002, 0.011), "vehicles": Rate(4, 100, 0.01, 0.1)}
    evaluation = Evaluation(
        **rates,
        shares=rates["vehicles"],
        groups=rates["vehicles"],
        not_predicted=5,
        outside_tube=0,
        mean_set_size=3.5,
        median_set_size=3,
        bases=bases,
    )
    counts = random.integers(0, 9, (2, bases, len(EDGES) - 1))
    return Contents(
        name="results <1>",
        folder=Path("results"),
        run={
            "coverdrive": "0", "python": "3", "packages": {"numpy": "2"}, "seed": 0, "seconds": {"training": 1.0},
            "recordings": [{"name": "made up", "rows": 10, "fingerprint": "abc"}],
        },
        settings="seed = 0",
        predictor=Predictor(basis, network, Thresholds.at(random.uniform(size=bases), 0.5), certificate, np.arange(2)),
        certified=Certified(
            (certificate,), evaluation, (certificate, evaluation),
            Occupied((0.5, 1.0), (2.0, 9.0), (3.0, 12.0), evaluation),
            Rate(3, 1000, 0.0, 0.1),
            {"segments": 100, "train": 50, "calibration": 30, "test": 20, "dropped": 0},
        ),
        learned=Learned(
            np.arange(1, bases + 1) / np.arange(1, bases + 1).sum(), basis.points, np.geomspace(9, 1, 12),
            EDGES, counts[0], counts[1], np.arange(bases + 1),
        ),
        compared=[
            Compared(Method.POST_BLOATING, None, certificate, evaluation, "", 0.1),
            Compared(Method.NESTED_SETS, 0.01, None, None, "too few vehicles", 0.0),
        ],
        trials=make_trials(traces),
        traffic="set-sampling",
        proved="With 99 % confidence at most 99.5 % of 20-s drives like these touch anybody (1 of 2)",
        road="Driven on a road of its own.",
        period=0.1,
        problem=ProblemSettings(),
        traces=traces,
    )  # fmt: skip


def make_certificate(bases: int) -> Certificate:
    """A certificate that counts vehicles."""
    return Certificate(
        method="post-bloating", epsilon=0.144, confidence=0.99, samples=191, unit="vehicle", bases=bases, uncovered=4,
        unseen_bases=0, discarded=0, tube=0.5, fingerprint="",
    )  # fmt: skip


def make_compared(method: Method, certificate: Certificate, target: float | None = None, size: float = 5.0) -> Compared:
    """One method with 4 % of the vehicles missed on unseen scenes."""
    evaluation = Evaluation(
        windows=Rate(5, 1000, 0.002, 0.011), vehicles=Rate(4, 100, 0.01, 0.1), shares=Rate(0.7, 100, 0.0, 0.05),
        groups=Rate(0.2, 5, 0.0, 0.5), not_predicted=5, outside_tube=0, mean_set_size=size, median_set_size=size,
        bases=certificate.bases,
    )  # fmt: skip
    return Compared(method, target, certificate, evaluation, "", 0.1)


def make_basis(size: int, seed: int = 0) -> Basis:
    """Base trajectories of constant acceleration and lateral speed."""
    random = np.random.default_rng(seed)
    times = 0.5 * np.arange(7)
    acceleration, drift = random.normal(0, 1, size), random.normal(0, 0.6, size)
    points = np.stack([acceleration[:, None] * times**2 / 2, drift[:, None] * times], axis=-1)
    return Basis(points, radius=0.5, aspect=4.0, growth=1.0, step=0.5)
