from dataclasses import replace

import jax
import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor

from coverdrive.errors import DataError
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.drives.storage import load_trace, save_trace
from coverdrive.simulation.traffic.set_sampling import SetSamplingTraffic


def a_trace(vehicles, seed=0, duration=1.0):
    predictor = FakePredictor(FakeBasis.make())
    settings = EpisodeSettings(duration=duration)
    return run_episode(predictor, ConstantPlanner(), SetSamplingTraffic(predictor), settings, vehicles, seed)


@pytest.mark.parametrize(("vehicles", "duration"), [(0, 0.5), (3, 1.0), (7, 20.0)])
def test_round_trip(tmp_path, vehicles, duration):
    trace = a_trace(vehicles, duration=duration)
    save_trace(trace, tmp_path / "deep" / "trace.npz")
    found = load_trace(tmp_path / "deep" / "trace.npz")
    assert jax.tree.structure(found) == jax.tree.structure(trace)
    for ours, theirs in zip(jax.tree.leaves(trace), jax.tree.leaves(found), strict=True):
        assert np.array_equal(ours, theirs)
        assert np.asarray(ours).dtype == np.asarray(theirs).dtype
    assert found.outcome == trace.outcome
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["trace.npz"]


def test_the_whole_road_is_kept(tmp_path):
    edges = np.arange(4) * 3.6
    line = ReferenceLine(np.array([3.0, 4.0]), 0.2, np.full(501, 1 / 500), 500.0, lat=2.0)
    changing = LaneEdges(np.array([0.0, 500.0]), np.array([edges, [3.6, 3.6, 7.2, 10.8]]))
    road = Road(edges, 500.0, line, changing, speed_limit=33.3, side="left")
    trace = replace(a_trace(1), road=road)
    road.to_map(1.0, 2.0)  # what is cached is not kept
    save_trace(trace, tmp_path / "trace.npz")
    found = load_trace(tmp_path / "trace.npz").road
    assert jax.tree.structure(found) == jax.tree.structure(road)
    assert all(map(np.array_equal, jax.tree.leaves(found), jax.tree.leaves(road)))


def test_paths_stay_with_their_step(tmp_path):
    trace = a_trace(3)
    few = trace.paths[0].of(np.array([0, 2]))
    none = trace.paths[1].of(np.zeros(0, dtype=int))
    trace = type(trace)(**{**vars(trace), "paths": (few, none, *trace.paths[2:])})
    save_trace(trace, tmp_path / "trace.npz")
    assert [len(paths) for paths in load_trace(tmp_path / "trace.npz").paths] == [2, 0, *[36] * 8]


@pytest.mark.parametrize("name", ["ellipses", "weight"])
def test_what_paths_may_have_besides_is_kept(name: str, tmp_path):
    trace = a_trace(3)
    values = [each.half_sizes[:, 0, 0] if name == "weight" else each.half_sizes / 3 for each in trace.paths]
    paths = tuple(replace(each, **{name: value}) for each, value in zip(trace.paths, values, strict=True))
    save_trace(replace(trace, paths=paths), tmp_path / "trace.npz")
    for value, found in zip(values, load_trace(tmp_path / "trace.npz").paths, strict=True):
        assert np.array_equal(getattr(found, name), value)


def test_where_only_some_steps_have_ellipses_the_centre_may_be_anywhere_in_the_others(tmp_path):
    trace = a_trace(3)
    first, *others = trace.paths
    mixed = replace(trace, paths=(replace(first, ellipses=first.half_sizes / 3), *others))
    save_trace(mixed, tmp_path / "trace.npz")
    found = load_trace(tmp_path / "trace.npz")
    assert np.array_equal(found.all_paths[1].ellipses, mixed.all_paths[1].ellipses)
    assert np.isfinite(found.paths[0].ellipses).all() and np.isinf(found.paths[1].ellipses).all()


def test_a_plan_keeps_its_fail_safe_branch_and_severity_or_that_it_has_none(tmp_path):
    trace = a_trace(3)
    branch, (first, second, *others) = trace.plans[0].states + 1.0, trace.plans
    plans = (replace(first, fail_safe=branch, severity=3.5), second, *others)
    save_trace(replace(trace, plans=plans), tmp_path / "trace.npz")
    found = load_trace(tmp_path / "trace.npz").plans
    np.testing.assert_array_equal(found[0].fail_safe, branch)
    assert found[0].severity == 3.5
    assert all(plan.fail_safe is None and plan.severity == 0.0 for plan in found[1:])


def test_missing_and_foreign_files_are_named(tmp_path):
    with pytest.raises(DataError, match="there is no trace at"):
        load_trace(tmp_path / "nothing.npz")
    (tmp_path / "text.npz").write_text("hello", encoding="utf-8")
    with pytest.raises(DataError, match=r"text.npz is not a trace"):
        load_trace(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", time=np.zeros(3))
    with pytest.raises(DataError, match=r"other.npz is not a trace"):
        load_trace(tmp_path / "other.npz")
    np.save(tmp_path / "single.npy", np.zeros(3))
    with pytest.raises(DataError, match=r"single.npy is not a trace"):
        load_trace(tmp_path / "single.npy")


def test_a_damaged_trace_is_refused(tmp_path):
    path = tmp_path / "trace.npz"
    save_trace(a_trace(3), path)
    content = bytearray(path.read_bytes())
    for damaged in (content[: len(content) // 2], content[:5000] + bytes(1000) + content[6000:]):
        path.write_bytes(damaged)
        with pytest.raises(DataError, match="not a trace"):
            load_trace(path)


def test_a_pickle_is_refused(tmp_path):
    np.savez(tmp_path / "pickle.npz", time=np.array([{"a": 1}], dtype=object))
    with pytest.raises(DataError, match="not a trace"):
        load_trace(tmp_path / "pickle.npz")
