"""The dial on drives of which it is known which sizes of the sets end in a collision."""

import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from simulation_fakes import REPLAYED, ConstantPlanner, FakeBasis, FakePredictor, make_scene

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.drives import anytime_limit, drives_needed
from coverdrive.dialling.dial import SCALES, Dialled, Request, dial, dialled, proof_of, said_of_dial
from coverdrive.errors import CertificateError, DataError, SettingError, StartError
from coverdrive.locks import alone
from coverdrive.road import Road
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.traffic.model import Start, TrafficStep
from shape_checks import unchecked

pytestmark = pytest.mark.usefixtures("uncollected")

CLAIM = Certificate("conformal, pooled", 0.1, 0.99, 100, "share", 1, 0, 0, 0, 1.0, "0")


@dataclass(frozen=True, eq=False)
class Sized(FakePredictor):
    """Sets whose boxes are as much larger than the bodies as their scale says."""

    scale: float = 1.0

    def scaled(self, scale):
        return replace(self, scale=scale)

    @property
    def fingerprint(self):
        return f"sized {self.scale:g}"

    @property
    def certificate(self):
        return replace(CLAIM, epsilon=0.1 if self.scale >= 1 else 0.5, scale=self.scale)

    def predict(self, scene, road, ego, dt, steps):
        paths = super().predict(scene, road, ego, dt, steps)
        return replace(paths, half_sizes=paths.half_sizes + self.scale)


class Bold(ConstantPlanner):
    """Drives the faster, the smaller the sets, and into the one ahead if they are smaller than 0.5."""

    driven = 0

    def plan(self, state, paths, road):
        Bold.driven += 1
        beyond = float(paths.half_sizes[0, 0, 1]) - 0.95
        self.inputs = np.tile([20.0 if beyond < 0.5 else 3.6 - 3 * beyond, 0.0], (12, 1))
        return super().plan(state, paths, road)


class Ahead:
    """One vehicle ahead that keeps its speed."""

    def start(self, settings, vehicles, rng):
        return Start(make_scene([0.0, 9.0 + rng.random()], [1.8, 1.8]), Road.straight(), np.inf)

    def reset(self, scene, road, rng):
        pass

    def step(self, scene, dt):
        states = np.array(scene.states)
        states[1, 0] += dt * states[1, 2]
        return TrafficStep.without_bases(replace(scene, lon=states[:, 0]))


class Crowded(Ahead):
    """Every second start finds no room, and none among many."""

    def start(self, settings, vehicles, rng):
        if vehicles > 1 or rng.random() < 0.5:
            raise StartError(f"no room for {vehicles}")
        return super().start(settings, vehicles, rng)


PREDICTOR = Sized(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
SETUP = Setup(PREDICTOR, Bold, Ahead, EpisodeSettings(duration=0.8), (1,), seed=7)
REQUEST = Request(risk=0.3, confidence=0.9, scales=(0.0, 0.6, 1.0), pilot=3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dial")
    dialled(SETUP, PREDICTOR, folder, REQUEST)
    return folder


@pytest.fixture
def turned(folder: Path, tmp_path: Path) -> Dialled:
    """What was found, with the folder copied."""
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    return Dialled.of(json.loads((tmp_path / "dial.json").read_text(encoding="utf-8")))


@pytest.fixture
def asked_nothing(turned: Dialled, tmp_path: Path) -> Path:
    """A folder with these drives, of which nobody has asked anything."""
    (tmp_path / "request.json").unlink()
    return tmp_path


def test_the_boldest_that_is_proved_is_taken(turned: Dialled) -> None:
    assert (turned.scale, turned.reached) == (0.6, True)
    assert turned.proofs[0].events == 0 and turned.proofs[0].bound <= 0.3
    assert turned.windows.epsilon == 0.5 and turned.windows.scale == 0.6
    assert "0.8-s drives like these touch anybody (0 of" in turned.sentence and "scale 0.6" in turned.sentence
    lines = {(each["drives_of"], each["scale"]): each for each in turned.frontier.iter_rows(named=True)}
    assert lines["pilot", 0.0]["collisions"] == lines["pilot", 0.0]["own_fault"] == 3
    assert lines["proof", 0.6]["collisions"] == 0 and lines["proof", 0.0]["collisions"] > 0
    assert lines["pilot", 0.6]["mean_speed"] > lines["pilot", 1.0]["mean_speed"]
    drives = lines["proof", 0.6]["drives"]
    ends = [lines["proof", 0.6][f"rate_{end}"] for end in ("low", "high")]
    assert ends == [0, pytest.approx(anytime_limit(0, drives, 0.95))]  # which hold although they ended when they did
    assert lines["pilot", 0.6]["rate_high"] == pytest.approx(1 - 0.025 ** (1 / 3))


def test_other_seeds_prove_than_choose_and_no_study_has_them(turned: Dialled, tmp_path: Path) -> None:
    seeds = {name: StudyFolder(tmp_path / name / "0.6").description()["seed"] for name in ("pilot", "proof")}
    assert len({*seeds.values(), SETUP.seed}) == 3
    dialled(replace(SETUP, seed=8), PREDICTOR, tmp_path / "other", replace(REQUEST, risk=0.6, scales=(0.6,)))
    assert StudyFolder(tmp_path / "other" / "proof" / "0.6").description()["seed"] not in seeds.values()


def test_a_dial_goes_on_where_it_was_and_nothing_is_lost(turned: Dialled, tmp_path: Path) -> None:
    before = Bold.driven
    assert dialled(SETUP, PREDICTOR, tmp_path, REQUEST).record == turned.record
    assert Bold.driven == before  # nothing is driven again
    damaged, gone = (tmp_path / "proof" / "0.6" / "trials" / f"00000{trial}.parquet" for trial in (0, 1))
    damaged.write_bytes(b"nothing")
    gone.unlink()
    assert dialled(SETUP, PREDICTOR, tmp_path, REQUEST).record == turned.record
    assert Bold.driven == before + 2 * 8
    assert damaged.with_suffix(".damaged").exists()


@pytest.mark.slow
def test_what_is_proved_does_not_depend_on_the_workers(tmp_path: Path) -> None:
    named = replace(REQUEST, scales=(0.6,))
    one, two = (dialled(SETUP, PREDICTOR, tmp_path / str(n), named, workers=n) for n in (1, 2))
    assert one.record == two.record


@pytest.mark.parametrize("vehicles", [(1,), (1, 60)])
def test_drives_that_cannot_start_are_none(vehicles, turned: Dialled, tmp_path: Path) -> None:
    setup = replace(SETUP, traffic=Crowded, vehicles=vehicles)
    found = dialled(setup, PREDICTOR, tmp_path / "crowded", REQUEST)
    assert (found.scale, found.reached, found.proofs) == (turned.scale, turned.reached, turned.proofs)
    assert "; among 1 vehicle within" in found.place
    table = StudyFolder(tmp_path / "crowded" / "proof" / "0.6").table()
    assert table["trial"].to_list() == list(range(table.height)) and table.height > found.proofs[0].drives
    before = Bold.driven
    assert dialled(setup, PREDICTOR, tmp_path / "crowded", REQUEST).record == found.record
    assert Bold.driven == before


def test_where_hardly_any_drive_can_start_nothing_is_proved(tmp_path: Path) -> None:
    none = replace(SETUP, traffic=Crowded, vehicles=(60,))
    named = replace(REQUEST, risk=0.01, scales=(1.0,))
    with pytest.raises(SettingError, match=r"^0 of 100 trials could start, none of the last 100.* no room for 60"):
        dialled(none, PREDICTOR, tmp_path, named)


def test_replays_prove_nothing(tmp_path: Path) -> None:
    with pytest.raises(CertificateError, match="replays of recorded scenes depend on each other"):
        dialled(replace(SETUP, **REPLAYED), PREDICTOR, tmp_path, REQUEST)
    assert not any(tmp_path.iterdir())


def test_a_dial_of_other_drives_is_refused(turned: Dialled, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="another configuration"):
        dialled(replace(SETUP, planner=ConstantPlanner), PREDICTOR, tmp_path, REQUEST)


def test_one_scale_is_named_beforehand_and_needs_no_pilot(tmp_path: Path) -> None:
    named = dialled(SETUP, PREDICTOR, tmp_path, replace(REQUEST, scales=(1.0,)))
    assert named.reached and not (tmp_path / "pilot").exists()
    assert named.proofs[0].method == "named beforehand"
    assert named.proofs[0].drives == drives_needed(0, 0.3, 0.9)
    assert dialled(SETUP, PREDICTOR, tmp_path / "bad", replace(REQUEST, scales=(0.0,))).reached is False


@pytest.mark.parametrize("procedure", ["fixed sequence", "Holm"])
def test_the_other_procedures_find_the_same(procedure, asked_nothing: Path) -> None:
    found = dialled(SETUP, PREDICTOR, asked_nothing, replace(REQUEST, procedure=procedure))
    assert found.scale == 0.6 and found.proofs[0].method == procedure


def test_faults_alone_may_count(asked_nothing: Path) -> None:
    found = dialled(SETUP, PREDICTOR, asked_nothing, replace(REQUEST, event="own"))
    assert found.scale == 0.6 and "at the ego's fault" in found.proofs[0].sentence and len(found.proofs) == 1


def test_two_at_once_do_not_dial_in_one_folder(asked_nothing: Path) -> None:
    with alone(asked_nothing), pytest.raises(DataError, match="another process writes to"):
        dialled(SETUP, PREDICTOR, asked_nothing, REQUEST)


def test_others_stand_beside(asked_nothing: Path) -> None:
    beside = {("keeps", None): replace(SETUP, planner=ConstantPlanner)}
    found = dialled(SETUP, PREDICTOR, asked_nothing, REQUEST, beside=beside)
    line = found.frontier.filter(found.frontier["who"] == "keeps").row(0, named=True)
    assert line["scale"] is None and line["claim"] is None and line["drives"] == 3


def test_what_was_proved_is_read_back(turned: Dialled) -> None:
    kept = Dialled.of(turned.record)
    assert kept.record == turned.record and kept.sentence == turned.sentence


def test_other_drives_than_those_that_were_proved_are_told(turned: Dialled) -> None:
    proved = replace(SETUP, predictor=PREDICTOR.scaled(0.6), seed=99)
    assert turned.unlike(proved) == {}
    assert said_of_dial(turned, proved) == [turned.sentence]
    other = replace(proved, episode=EpisodeSettings(duration=2.0))
    assert turned.unlike(other) == {"episode.duration": (0.8, 2.0)}
    assert "episode.duration 0.8, now 2.0" in said_of_dial(turned, other)[1]
    assert "predictor" in turned.unlike(replace(proved, predictor=PREDICTOR))  # proving one and driving another
    assert said_of_dial(None, other) == []


def test_a_study_proves_something_as_well(turned: Dialled, tmp_path: Path) -> None:
    trials = StudyFolder(tmp_path / "pilot" / "0.6").table()
    proof = proof_of(trials, 0.8)
    assert proof.bound == pytest.approx(1 - 0.01 ** (1 / 3)) and "(0 of 3)" in proof.sentence
    longer = proof_of(trials, 0.8, True)  # that may end whenever it has proved something
    assert (longer.method, longer.bound) == ("anytime", anytime_limit(0, 3, 0.99)) and longer.bound > proof.bound


@pytest.mark.parametrize(
    "changes", [{"scales": (0.6, 1.0)}, {"risk": 0.4}, {"event": "own"}, {"procedure": "Holm"}, {"pilot": 4}]
)
def test_drives_that_were_looked_at_prove_nothing_else(changes, turned: Dialled, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="dial with another seed"):
        dialled(SETUP, PREDICTOR, tmp_path, replace(REQUEST, **changes))


def test_at_any_time_more_drives_may_be_asked_for(turned: Dialled, tmp_path: Path) -> None:
    assert dialled(SETUP, PREDICTOR, tmp_path, replace(REQUEST, most=60)).scale == turned.scale


def test_a_number_that_was_fixed_beforehand_is_not_raised_afterwards(tmp_path: Path) -> None:
    named = replace(REQUEST, scales=(1.0,))
    dialled(SETUP, PREDICTOR, tmp_path, named)
    with pytest.raises(DataError, match="dial with another seed"):
        dialled(SETUP, PREDICTOR, tmp_path, replace(named, most=30))


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"risk": 0.0}, CertificateError, "between 0 and 1"),
        ({"risk": 1.0}, CertificateError, "between 0 and 1"),
        ({"confidence": 1.0}, CertificateError, "between 0 and 1"),
        ({"scales": ()}, SettingError, "scales that differ"),
        ({"scales": (0.5, 0.5)}, SettingError, "scales that differ"),
        ({"scales": (-1.0, 0.5)}, SettingError, "between 0"),
        ({"scales": (float("nan"),)}, SettingError, "between 0"),
        ({"most": 5}, CertificateError, f"{drives_needed(0, 0.3, 0.9, anytime=True)} without any event would do"),
        ({"pilot": 0}, CertificateError, "at least 1 drive"),
        ({"most": 0}, CertificateError, "at least 1 drive"),
        ({"pilot": 2.5}, SettingError, "pilot: expected a whole number"),
        ({"risk": "a"}, SettingError, "risk: expected a number, got 'a'"),
        ({"scales": None}, SettingError, "needs scales, got None"),
        ({"event": "collision"}, SettingError, "event: expected 'any' or 'own', got 'collision'"),
        ({"procedure": "x"}, SettingError, "procedure: expected .*'Holm'"),
    ],
)
def test_bad_input_is_refused_before_anything_is_driven(changes, error, words, tmp_path: Path) -> None:
    before = Bold.driven
    with unchecked(), pytest.raises(error, match=words):
        dialled(SETUP, PREDICTOR, tmp_path, replace(REQUEST, **changes))
    assert Bold.driven == before and not (tmp_path / "request.json").exists()


def test_scales_may_be_an_array_and_every_number_of_vehicles_is_driven_as_often() -> None:
    with unchecked():
        assert Request(scales=np.array([0.3, 0.4])).scales == (0.3, 0.4)  # pyright: ignore[reportArgumentType]
    named = Request(risk=0.002, scales=(1.0,))
    assert (named.dial(20.0).most, named.dial(20.0, turn=5).most) == (2301, 2305)
    assert replace(named, most=2301).dial(20.0, turn=5).most == 2301


def test_the_dial_of_the_package(tmp_path: Path) -> None:
    found = dial(
        PREDICTOR, Bold, folder=tmp_path, risk=0.6, confidence=0.9, scales=(0.6, 1.0), pilot=2, traffic=Ahead,
        vehicles=(1,), episode=EpisodeSettings(duration=0.8),
    )  # fmt: skip
    assert found.reached and found.scale == 0.6 and SCALES[0] == 0.0
