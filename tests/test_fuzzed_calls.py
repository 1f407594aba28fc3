"""Options of the command and of the environment, drawn at random: they are taken, or refused with an error of ours.

Every case has its own seed, `FIRST` and its number, so that one that fails can be called again alone.
"""

import io
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import coverdrive as cd
from command import status_of_main
from coverdrive.bridges.gymnasium import Motorway, RewardSettings
from coverdrive.cli import _COMMANDS, app
from coverdrive.errors import CoverdriveError, DataError
from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.traffic.replay import ReplaySettings
from shape_checks import unchecked

FIRST = 30
"""of all seeds; another one draws other cases"""

ODD: tuple[Any, ...] = (
    None, True, -1, 0, 1, 2, 9, 101, 10**6, 2**63, 10**400, 0.5, -0.0, 1e300, np.nan, np.inf, -np.inf, 1j, "", "ten",
    "-1", "\x00", "é", b"bytes", (), [], {}, (3, 5), (3, "five"), [np.nan, 0.0], [[0.0, 0.0]], np.zeros(2),
    np.zeros((2, 0)), np.float32(0.3), np.int64(4), np.array(4), np.array("a"), {"vehicles": 3}, Path("nowhere"),
    object(), len, int, range(3), EpisodeSettings,
)  # fmt: skip
"""what may be given for anything"""

SOUND: dict[str, tuple[Any, ...]] = {
    "traffic": ("drivers", "aggressive", "set-sampling", "mixed", "replay", "reactive-replay", ReplaySettings()),
    "vehicles": (0, 3, (3, 5), np.int64(2), 100),
    "observation": ("affordance", "scene"),
    "action": ("continuous", "discrete"),
    "slots": (1, 16, 1000),
    "sets": (True, False),
    "render_mode": (None, "rgb_array"),
    "episode": (None, EpisodeSettings(duration=0.3), EpisodeSettings(duration=0.01, step=0.25)),
    "reward": (None, RewardSettings(wanted_speed=0.1)),
    "car": (None, VehicleSettings()),
    "seed": (None, 0, 7, 2**70),
    "options": (None, {}),
    "step": (0, 4, 8, np.int64(3), [0.0, 0.0], np.array([1.0, -1.0]), (0.3, -7), np.ones(2, np.float32)),
}
"""what is meant to be given for a name"""

WORDS = (
    "", "-1", "0", "1", "3", "1e300", "-1e300", "nan", "inf", "0.5", "0.1", "1.0", "9" * 400, "0x10", "1_000", "ten",
    "é", "🚗", "auto", "window", "share", "drivers", "replay", "mixed", "paper", "curved", "recorded", "us-101",
    "NGSIM", "gif", "own", "default", "idm", "highway-env-1", "sumo-2000", "commonroad:x", "os:path", "no:thing", "--",
    "-", "--json", "--help", "--set", "seed=1", "planner.problem=3", "traffic.kind=replay", "=", "a=",
    "study.trials=nan", "*", "..", "/dev/null", "nowhere.csv", "a" * 300, "[red]x", "{}", "[1,2]", "None", "True",
)  # fmt: skip
"""what may stand behind anything in a shell"""


def each(cases: int, case: Callable[[np.random.Generator], str]) -> None:
    """Call a case over and over; what is raised says which it was."""
    print(f"cases ({FIRST}, 0) to ({FIRST}, {cases - 1})")
    for number in range(cases):
        try:
            case(np.random.default_rng((FIRST, number)))
        except BaseException as error:
            error.add_note(f"case ({FIRST}, {number})")
            raise


def drawn(random: np.random.Generator, name: str, odd: float = 0.15) -> Any:
    """What is meant for a name, or now and then anything."""
    choices = ODD if name not in SOUND or random.random() < odd else SOUND[name]
    return choices[int(random.integers(len(choices)))]


@pytest.fixture(scope="module")
def predictor(quick_predictor: Path) -> Any:
    return cd.Predictor.load(quick_predictor)


@pytest.mark.parametrize("cases", [60, pytest.param(1000, marks=pytest.mark.slow)])
def test_environments(predictor: Any, cases: int) -> None:
    recordings = generate(GeneratedSettings(scenes=2, duration=8.0, vehicles=(3, 4)))
    known = {"predictor": (None, predictor, predictor), "recordings": ((), recordings, recordings[0])}
    begun = []

    def case(random: np.random.Generator) -> None:
        names = [name for name in SOUND if name not in ("seed", "options", "step") and random.random() < 0.5]
        given = {name: drawn(random, name) for name in names}
        for name, sound in known.items():
            given[name] = drawn(random, name) if random.random() < 0.1 else sound[int(random.integers(len(sound)))]
        try:
            env = Motorway(**given)
        except CoverdriveError:
            return
        for name in ("observation", "action", "render_mode"):
            assert name not in given or given[name] in SOUND[name]
        try:
            shown, _ = env.reset(seed=drawn(random, "seed"), options=drawn(random, "options"))
        except (CoverdriveError, gymnasium.error.Error):
            return
        begun.append(env)
        for _ in range(3):
            assert shown in env.observation_space
            try:
                shown, reward, ended, late, _ = env.step(drawn(random, "step"))
            except CoverdriveError:
                continue
            assert np.isfinite(reward)
            if ended or late:
                break
        if env.render_mode == "rgb_array":
            assert env.render().shape == (240, 1200, 3)
        env.close()

    with unchecked():
        each(cases, case)
    assert len(begun) > cases / 20


@pytest.mark.parametrize("cases", [100, pytest.param(1500, marks=pytest.mark.slow)])
def test_the_command(quick_fit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cases: int) -> None:
    """Every option of every command, up to where its work begins."""
    reached = []

    def begun() -> None:
        reached.append(True)
        raise DataError("so far, so good")

    for file in _COMMANDS.values():
        monkeypatch.setattr(f"coverdrive.cli.{file}.stages", begun, raising=False)
    monkeypatch.chdir(tmp_path)
    names = [*_COMMANDS]
    options = {name: [argument.names[0] for argument in app[name].assemble_argument_collection()] for name in names}

    def case(random: np.random.Generator) -> None:
        name = names[int(random.integers(len(names)))]
        words = [*WORDS, str(quick_fit), str(quick_fit), str(quick_fit / "config.toml"), str(quick_fit / "run.json")]
        called = [name]
        for option in random.permutation([each for each in options[name] if each.startswith("--")])[:4]:
            called += [str(option), *random.choice(words, int(random.choice([0, 1, 1, 1, 1, 2])))]
        for option in ("--out", "--folder", "--fit"):
            if option in options[name] and option not in called and random.random() < 0.9:
                called += [option, str(quick_fit)]
        if not any(each.startswith("--") for each in options[name][:1]):
            called += random.choice(words, int(random.choice([0, 1, 1, 1, 2]))).tolist()
        said = io.StringIO()
        monkeypatch.setattr(sys, "argv", ["coverdrive", *map(str, called)])
        with redirect_stdout(said), redirect_stderr(said):
            status = status_of_main()
        assert status in (0, 2) and "Traceback" not in said.getvalue(), f"{called}: {status}, {said.getvalue()}"

    before = sorted(quick_fit.rglob("*"))
    with unchecked():
        each(cases, case)
    assert len(reached) > cases / 50
    assert sorted(quick_fit.rglob("*")) == before
