"""Files of what was learned: equal contents are equal bytes, and nothing that was changed is read."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors import safe_open

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import DataError
from coverdrive.prediction.certifying.scored import ScoredSides
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.fits.learned import Learned
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.prediction.storage import fingerprint_of, loaded, save_arrays

BASES = 3


def made_predictor() -> Predictor:
    random = np.random.default_rng(0)
    basis = Basis(random.normal(size=(BASES, 7, 2)), 0.75, 4.0, 1.0, 0.5, reach=random.uniform(0.5, 1, (7, 2)))
    network = Network(
        mean=np.zeros(21, np.float32),
        scale=np.ones(21, np.float32),
        weights=(random.normal(size=(1, 4, 21)).astype(np.float32), np.ones((1, BASES, 4), np.float32)),
        biases=(np.zeros((1, 4), np.float32), np.zeros((1, BASES), np.float32)),
        prior=np.zeros(BASES, np.float32),
        inputs="affordance",
        output="sigmoid",
    )
    rule = Thresholds(random.uniform(size=BASES), np.full(BASES, 0.75))
    certificate = Certificate("conformal, pooled", 0.1, 0.99, 50, "vehicle", BASES, 0, 0, 0, 0.75, "abc")
    return Predictor(basis, network, rule, certificate, np.arange(5))


def made_scores(predictor: Predictor) -> ScoredSides:
    def side(vehicles: int, hidden: bool) -> ScoredSamples:
        random = np.random.default_rng(vehicles)
        scores = random.uniform(size=(vehicles, BASES)).astype(np.float32)
        values = random.normal(size=(vehicles, 4)).astype(np.float32) if hidden else None
        return ScoredSamples(
            scores, np.zeros(vehicles, int), random.uniform(size=vehicles), np.arange(vehicles), values
        )

    return ScoredSides(side(4, True), side(3, True), side(2, False), predictor.fingerprint)


def made_learned() -> Learned:
    counts = np.arange(BASES * 2).reshape(BASES, 2)
    edges = np.array([0, 0.5, 1])
    return Learned(
        np.full(BASES, 1 / 3), np.ones((BASES, 7, 2)), np.ones(5), edges, counts, counts, np.arange(BASES + 1)
    )


def saved_as_again(path: Path, load: Callable[[Path], object]) -> bool:
    """Whether what a file holds is written as the file `original` beside it; False if the file is refused."""
    try:
        read = load(path)
    except DataError as error:
        assert str(path) in str(error)
        return False
    read.save(path.with_name("again"))
    assert path.with_name("again").read_bytes() == path.with_name("original").read_bytes()
    return True


KINDS = {
    "predictor": (made_predictor, Predictor.load),
    "basis": (lambda: made_predictor().basis, Basis.load),
    "scores": (lambda: made_scores(made_predictor()), lambda path: ScoredSides.load(path, made_predictor())),
    "learned": (made_learned, Learned.load),
}


@pytest.fixture(scope="module", params=KINDS)
def saved(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Callable]:
    make, load = KINDS[request.param]
    path = tmp_path_factory.mktemp(request.param) / "original"
    make().save(path)
    return path, load


def test_equal_contents_are_equal_bytes(saved: tuple[Path, Callable]) -> None:
    path, load = saved
    assert saved_as_again(path, load)


def test_the_library_reads_them(saved: tuple[Path, Callable]) -> None:
    path, _ = saved
    with safe_open(path, framework="numpy") as file:
        assert file.metadata()["format"].startswith("coverdrive ")
        assert all(np.isfinite(file.get_tensor(name)).all() for name in file.keys())  # noqa: SIM118 (not a mapping)


@settings(max_examples=200, derandomize=True)
@given(st.data())
def test_changed_bytes_are_refused_or_change_nothing(saved: tuple[Path, Callable], data: st.DataObject) -> None:
    path, load = saved
    content = bytearray(path.read_bytes())
    header = 8 + int.from_bytes(content[:8], "little")
    places = st.one_of(st.integers(0, header - 1), st.integers(0, len(content) - 1))
    for place in data.draw(st.lists(places, min_size=1, max_size=3)):
        content[place] ^= data.draw(st.integers(1, 255))
    changed = path.with_name("changed")
    changed.write_bytes(content)
    saved_as_again(changed, load)


@settings(max_examples=50, derandomize=True)
@given(st.data())
def test_a_part_of_a_file_is_refused(saved: tuple[Path, Callable], data: st.DataObject) -> None:
    path, load = saved
    content = path.read_bytes()
    changed = path.with_name("changed")
    changed.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    assert not saved_as_again(changed, load)


def test_a_better_bound_or_another_weight_is_refused(tmp_path: Path) -> None:
    predictor, path = made_predictor(), tmp_path / "predictor.safetensors"
    predictor.save(path)
    content = path.read_bytes()
    for old, new in ((b'\\"epsilon\\": 0.1', b'\\"epsilon\\": 0.0'), (content[-9:], bytes(9))):
        assert old in content
        path.write_bytes(content.replace(old, new))
        with pytest.raises(DataError, match=r"predictor.safetensors: .* changed after it was written"):
            Predictor.load(path)


def test_names_that_no_predictor_has_and_those_that_it_lacks(tmp_path: Path) -> None:
    predictor, path = made_predictor(), tmp_path / "predictor.safetensors"
    predictor.save(path)
    with loaded(path, "predictor", "a command") as (header, arrays):
        lacking = {name: values for name, values in arrays.items() if name != "thresholds"}
    narrow = arrays | {"basis": np.zeros((2, 7))}
    for other, given_arrays in (
        ({}, arrays),
        (header, lacking),
        (header, arrays | {"more": np.zeros(1)}),
        (header | {"certificate": {"epsilon": 0.1}}, arrays),
        (header | {"rule": "magic"}, arrays),
        (header, narrow),
    ):
        save_arrays(path, "predictor", other, given_arrays)
        with pytest.raises(DataError, match="not a predictor file"):
            Predictor.load(path)


def test_another_version_is_named(tmp_path: Path) -> None:
    path = tmp_path / "file"
    save_arrays(path, "predictor", {}, {})
    path.write_bytes(path.read_bytes().replace(b"predictor 4", b"predictor 1"))
    with pytest.raises(DataError, match="expected the format 'coverdrive predictor 4', got 'coverdrive predictor 1'"):
        Predictor.load(path)


def test_scores_are_read_as_they_were_and_belong_to_one_predictor(tmp_path: Path) -> None:
    predictor = made_predictor()
    scored = made_scores(predictor)
    scored.save(tmp_path / "scores")
    again = ScoredSides.load(tmp_path / "scores", predictor)
    for side in ("train", "calibration", "test"):
        for name, values in vars(getattr(scored, side)).items():
            read = getattr(getattr(again, side), name)
            assert (read is None) if values is None else (read.dtype == values.dtype and np.array_equal(read, values))
    other = replace(predictor, trained_on=np.arange(6))
    with pytest.raises(DataError, match="scores: these are scores of the predictor"):
        ScoredSides.load(tmp_path / "scores", other)


def test_fingerprints_tell_names_and_types_apart() -> None:
    ones = np.ones(2)
    contents = [({}, {"a": ones}), ({}, {"b": ones}), ({"a": 1}, {"a": ones}), ({}, {"a": ones.astype(np.float32)})]
    assert len({fingerprint_of(*content) for content in contents}) == len(contents)
    assert fingerprint_of({"b": 1, "a": 2}, {}) == fingerprint_of(json.loads('{"a": 2, "b": 1}'), {})
