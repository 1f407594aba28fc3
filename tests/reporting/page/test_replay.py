"""What the page stores of a drive can be restored up to rounding."""

import base64
import zlib
from dataclasses import replace

import numpy as np
import pytest
from report_fakes import COMES, LEAVES, STEPS, make_contents, make_stray

from coverdrive.reporting.drives.active_constraints import active_constraints
from coverdrive.reporting.drives.reasons import reason_of
from coverdrive.reporting.drives.worst_moment import worst_moment
from coverdrive.reporting.page.replay import MARKS, replay_data
from coverdrive.simulation.measures.metrics import distances, gaps
from coverdrive.simulation.measures.misses import find_windows


def restored(data: dict) -> dict[str, np.ndarray]:
    """What `replay-data.js` does."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(data["data"])), np.uint8).reshape(4, -1)
    integers = np.ascontiguousarray(planes.T).view("<i4").ravel()
    arrays, offset = {}, 0
    for name, about in data["arrays"].items():
        size = int(np.prod(about["shape"]))
        values = integers[offset : offset + size].reshape(about["shape"])
        arrays[name] = about["unit"] * (values if about["axis"] is None else values.cumsum(about["axis"]))
        offset += size
    assert offset == len(integers)
    return arrays


def test_arrays_are_restored_up_to_half_a_unit() -> None:
    contents = make_contents()
    trace = contents.traces[7]
    data = replay_data(7, trace, contents.problem)
    arrays = restored(data)
    for name in ("lon", "lat", "speed"):
        assert arrays[name] == pytest.approx(getattr(trace.scene, name), abs=0.0051)
    assert arrays["heading"] == pytest.approx(trace.scene.heading, abs=0.00051)
    for name, field in (("paths", "points"), ("boxes", "half_sizes")):
        original = np.concatenate([getattr(paths, field) for paths in trace.paths])
        assert np.moveaxis(arrays[name], -1, 0) == pytest.approx(original, abs=0.0101)
    assert arrays["plan"] == pytest.approx(np.stack([plan.states[:, [0, 1, 3]] for plan in trace.plans]), abs=0.00051)
    assert (data["kind"], data["partner"], data["fault"]) == ("side", 1, "other")
    assert [data["statuses"][index] for index in data["status"]] == [plan.status.value for plan in trace.plans]


def test_gap_time_to_collision_severity_and_first_contact_are_stored() -> None:
    trace = make_contents().traces[0]
    plans = [replace(plan, severity=0.5 * step) for step, plan in enumerate(trace.plans)]
    ahead = trace.scene.lon[3, 0] + 10.0 - trace.paths[3].points[1, 0, 0]
    met = replace(trace.paths[3], points=trace.paths[3].points + np.array([ahead, 1.05]))
    trace = replace(trace, plans=tuple(plans), paths=(*trace.paths[:3], met, *trace.paths[4:]))
    data = replay_data(0, trace, None)
    arrays = restored(data)
    assert arrays["gap"] == pytest.approx(np.minimum(gaps(trace), 100), abs=0.0051)
    assert arrays["ttc"] == pytest.approx(np.minimum(distances(trace).time_to_collision, 100), abs=0.0051)
    assert arrays["severity"] == pytest.approx([plan.severity for plan in plans], abs=0.0051)
    reason = reason_of(trace, 3)
    assert (arrays["met"][3], data["reasons"][3]) == (reason.path, reason.text) and reason.path >= 0
    assert arrays["metAt"][3] == pytest.approx(reason.time, abs=0.0051)
    assert [data["reasons"][step] for step in (0, 1, 5, 6)] == [""] * 4


def test_who_is_there_and_who_left_its_set_is_told_of_every_moment() -> None:
    data = replay_data(7, make_stray(), make_contents().problem)
    arrays, moment = restored(data), np.arange(STEPS + 1)
    always, never = moment >= 0, moment < 0
    assert np.array_equal(arrays["valid"].T, [always, moment >= COMES, always, never])
    assert np.array_equal(arrays["left"].T, [never, never, moment >= LEAVES, never])
    assert data["cause"] == "none"


def test_active_constraints_are_marked_point_by_point() -> None:
    contents = make_contents()
    trace = contents.traces[0]
    flags = np.concatenate([active_constraints(trace, step, contents.problem) for step in range(len(trace))])
    assert flags.any()
    masks = restored(replay_data(0, trace, contents.problem))["active"]
    assert (((masks[:, None] >> np.arange(flags.shape[1])) & 1) == flags).all()


def test_without_constraints_none_is_marked() -> None:
    assert not restored(replay_data(0, make_contents().traces[0], None))["active"].any()


def test_marks_are_what_is_near_lost_left_and_hit_and_lane_changes() -> None:
    trace = make_contents().traces[7]
    data = replay_data(7, trace, None)
    steps = {kind: [step for step, each, _ in data["marks"] if each == kind] for kind in MARKS}
    assert (
        steps["lane"] == [5, 12]
        and steps["contact"] == [STEPS]
        and (STEPS, "contact", "side collision") in data["marks"]
    )
    assert steps["gap"] == [gaps(trace).argmin()] and steps["time"] == [distances(trace).time_to_collision.argmin()]
    assert steps["lost"] == [2, 7] and steps["unsafe"] == [3, 4, 8, 9]  # invalid first, then unsafe and invalid in turn
    gone = [step for step, kind, _ in replay_data(9, make_stray(), None)["marks"] if kind == "left"]
    assert gone == [LEAVES]


def test_the_worst_moment_is_told() -> None:
    trace = make_stray()
    assert replay_data(9, trace, None)["worst"] == worst_moment(trace, find_windows(trace))._asdict()
