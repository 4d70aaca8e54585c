"""Paths of kinematic bodies: their pose as a function of time, in closed form, and faults of their keys."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.arrays import FloatArray
from sandbox.scene.compile.paths import PEAK_ACCELERATION, PathMotion
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document

ROUNDING = 1e-12
"""m or rad: some sums of numbers of some metres"""


def motion(path: dict[str, Any], **body: Any) -> PathMotion:
    """Return the motion of a box on a path."""
    box = {"position": [0.0, 0.0], "size": [2.0, 0.2], "kinematic": True, **body, "path": path}
    return from_document({"box": [box]}).bodies.paths[0]


def poses(path: dict[str, Any], times: list[float], **body: Any) -> FloatArray:
    """Return the poses (T, 3) of a box on a path."""
    follows = motion(path, **body)
    return np.asarray([follows.pose(time) for time in times])


def test_there_and_back_at_constant_speed() -> None:
    path = {"points": [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0]], "speed": 2.0}
    times = [-1.0, 0.0, 1.0, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 6.5, 600.5]
    x = [0.0, 0.0, 2.0, 4.0, 4.0, 4.0, 4.0, 4.0, 2.0, 0.0, 1.0, 1.0]
    y = [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert poses(path, times, position=[1.0, 10.0]) == pytest.approx(
        np.column_stack((1.0 + np.asarray(x), 10.0 + np.asarray(y), np.zeros(12))), abs=ROUNDING
    )


def test_loop_closes_to_the_first_point_and_period_shares_the_time_by_length() -> None:
    path = {"points": [[0, 0], [3, 0], [3, 4]], "period": 6.0, "repeat": "loop"}  # sides of 3, 4 and 5 m: 2 m/s
    expected = [[3.0, 0.0], [3.0, 4.0], [1.5, 2.0], [0.0, 0.0], [3.0, 0.0]]
    assert poses(path, [1.5, 3.5, 4.75, 6.0, 7.5])[:, :2] == pytest.approx(np.asarray(expected), abs=ROUNDING)


def test_once_stays_at_the_end() -> None:
    path = {"points": [[0, 0], [3, 0], [3, 1]], "period": 3.0, "pause": 1.0, "repeat": "once"}  # 2 s for 4 m
    expected = [[0.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 0.0], [3.0, 0.5], [3.0, 1.0], [3.0, 1.0]]
    assert poses(path, [0.0, 1.0, 1.5, 2.5, 2.75, 3.0, 1e6])[:, :2] == pytest.approx(np.asarray(expected), abs=ROUNDING)


def test_it_pauses_at_every_point_that_it_arrives_at_and_the_period_contains_the_pauses() -> None:
    """A lift of three floors: 4 legs of 3 m at 3 m/s, and 4 pauses of 2 s, take 12 s."""
    by_speed = {"points": [[0, 0], [0, 3], [0, 6]], "speed": 3.0, "pause": 2.0}
    by_period = {"points": [[0, 0], [0, 3], [0, 6]], "period": 12.0, "pause": 2.0}
    times = [0.5, 1.0, 3.0, 3.5, 4.0, 6.0, 7.0, 9.0, 10.0, 12.0, 12.5]
    y = [1.5, 3.0, 3.0, 4.5, 6.0, 6.0, 3.0, 3.0, 0.0, 0.0, 1.5]
    for path in (by_speed, by_period):
        assert motion(path).cycle == pytest.approx(12.0, rel=ROUNDING)
        assert poses(path, times)[:, 1] == pytest.approx(y, abs=ROUNDING)


def test_start_delays_the_path_or_sets_its_phase() -> None:
    """A body that is on its way at time 0 starts the scene there."""
    path: dict[str, Any] = {"points": [[1, 0], [5, 0]], "speed": 1.0}
    assert poses({**path, "start": 2.0}, [0.0, 2.0, 3.5])[:, 0] == pytest.approx([1.0, 1.0, 2.5], abs=ROUNDING)
    assert poses({**path, "start": -6.0}, [0.0, 1.0])[:, 0] == pytest.approx([3.0, 2.0], abs=ROUNDING)
    box = {"position": [10.0, 0.0], "size": [1.0, 1.0], "kinematic": True, "path": {**path, "start": -6.0}}
    bodies = from_document({"box": [box]}).bodies
    assert bodies.position[0] == pytest.approx([13.0, 0.0], abs=ROUNDING)


def test_smooth_leg_starts_and_ends_at_rest_with_bounded_acceleration() -> None:
    """Of a leg L in T: largest speed 15/8 L/T at its middle, largest acceleration 10/√3 L/T² at (3 ± √3)/6 of T."""
    length, duration, h = 3.0, 2.0, 1e-4
    follows = motion({"points": [[0, 0], [length, 0]], "period": duration, "easing": "smooth", "repeat": "once"})
    times = np.arange(-0.5, duration + 0.5, h)
    x = np.asarray([follows.pose(time).x for time in times.tolist()])
    speed, acceleration = np.diff(x) / h, np.diff(x, 2) / h**2
    assert x[-1] == length and follows.pose(1.0).x == pytest.approx(1.5, abs=ROUNDING)
    assert speed.max() == pytest.approx(15.0 / 8.0 * length / duration, rel=1e-6)  # h² of a difference
    assert follows.max_speed == pytest.approx(15.0 / 8.0 * length / duration, rel=ROUNDING)
    largest = PEAK_ACCELERATION * length / duration**2
    # differences of the second order: h² x'''' and rounding of x over h²
    assert np.abs(acceleration).max() == pytest.approx(largest, rel=1e-5)
    assert times[np.argmax(acceleration) + 1] == pytest.approx((3.0 - math.sqrt(3.0)) / 6.0 * duration, abs=0.01)
    jerk = np.abs(np.diff(acceleration)).max()
    assert jerk < 60.0 * length / duration**3 * h + 1e-6  # continuous: at most 60 L/T³; rounding of x over h²


def test_door_turns_about_its_hinge() -> None:
    """The centre of a door of 2 m moves on a circle of 1 m about the hinge, which does not move."""
    path = {"angles": [0.0, math.pi / 2.0], "pivot": [-1.0, 0.0], "period": 4.0}
    expected = [
        [0.0, 0.0, 0.0],
        [-1.0 + math.sqrt(0.5), math.sqrt(0.5), math.pi / 4.0],
        [-1.0, 1.0, math.pi / 2.0],
        [0.0, 0.0, 0.0],
    ]
    assert poses(path, [0.0, 1.0, 2.0, 4.0]) == pytest.approx(np.asarray(expected), abs=ROUNDING)
    follows = motion(path)
    assert follows.max_spin == pytest.approx(math.pi / 4.0) and follows.max_speed == pytest.approx(math.pi / 4.0)


def test_pivot_turns_with_the_angle_of_the_body() -> None:
    path = {"points": [[0, 0], [3, 0]], "angles": [0.0, math.pi], "pivot": [1.0, 0.0], "period": 2.0}
    start, end = poses(path, [0.0, 1.0], position=[5.0, 5.0], angle=math.pi / 2.0)
    assert start == pytest.approx([5.0, 5.0, math.pi / 2.0], abs=ROUNDING)
    assert end == pytest.approx([8.0, 7.0, 1.5 * math.pi], abs=ROUNDING)  # the pivot, 1 m above, comes to 3 m right


def test_polygon_turns_about_its_origin_and_not_its_centre_of_mass() -> None:
    door = {"points": [[0, -0.1], [2, -0.1], [2, 0.1], [0, 0.1]], "position": [1.0, 0.0], "kinematic": True}
    path = {"angles": [0.0, math.pi / 2.0], "period": 2.0}
    pose = from_document({"polygon": [{**door, "path": path}]}).bodies.paths[0].pose(1.0)
    assert pose == pytest.approx((1.0, 1.0, math.pi / 2.0), abs=ROUNDING)


def test_speed_is_1_by_default() -> None:
    assert poses({"points": [[0, 0], [4, 0]]}, [1.5, 7.0])[:, 0] == pytest.approx([1.5, 1.0], abs=ROUNDING)
    assert poses({"angles": [0.0, 0.5]}, [0.25, 0.75])[:, 2] == pytest.approx([0.25, 0.25], abs=ROUNDING)


def test_pose_has_no_error_that_grows_with_time() -> None:
    path = {"points": [[0, 0], [1, 0]], "period": 4.0, "easing": "smooth"}
    early, late = poses(path, [0.75, 0.75 + 4.0 * 2**28])  # both times are exact in binary
    assert early.tolist() == late.tolist()


COORDINATES = st.tuples(*2 * [st.floats(-9.0, 9.0).map(lambda x: round(x, 2))])


@pytest.mark.fail_slow(60)  # a hundred examples
@given(data=st.data())
def test_every_path_is_continuous_and_never_faster_than_its_bound(data: st.DataObject) -> None:
    """Also at corners and pauses, at the end of a cycle, and at the start; a cycle later it is at the same place."""
    points = data.draw(st.lists(COORDINATES, min_size=2, max_size=5, unique=True))
    path = {
        "points": [list(each) for each in points],
        "angles": data.draw(st.just([]) | st.lists(st.floats(-3, 3), min_size=len(points), max_size=len(points))),
        data.draw(st.sampled_from(["speed", "period"])): data.draw(st.floats(5.0, 50.0)),
        "pause": data.draw(st.sampled_from([0.0, 0.25])),
        "repeat": data.draw(st.sampled_from(["there_and_back", "loop", "once"])),
        "easing": data.draw(st.sampled_from(["linear", "smooth"])),
        "start": data.draw(st.floats(-3.0, 3.0)),
    }
    follows, h = motion(path), 0.01
    times = np.arange(-1.0, min(follows.cycle, 8.0) + 1.0, h).tolist()
    rates = np.diff([follows.pose(time) for time in times], axis=0) / h
    assert np.hypot(*rates[:, :2].T).max() <= follows.max_speed * (1.0 + 1e-9) + 1e-9  # rounding over h
    assert np.abs(rates[:, 2]).max() <= follows.max_spin * (1.0 + 1e-9) + 1e-9  # likewise
    if path["repeat"] != "once":
        time = max(path["start"], 0.0) + 0.3
        assert follows.pose(time + follows.cycle) == pytest.approx(follows.pose(time), abs=1e-9)  # rounding of the time


POINTS = [[0, 0], [4, 0]]


@pytest.mark.parametrize(
    ("path", "body", "key", "message"),
    [
        ({"points": POINTS, "speed": 1}, {"kinematic": False}, "path", "needs `kinematic = true`"),
        ({"points": POINTS, "speed": 1}, {"kinematic": False, "fixed": True}, "path", "needs `kinematic = true`"),
        ({"points": POINTS, "speed": 1}, {"velocity": [1, 0]}, "velocity", "follows from the `path`"),
        ({"points": POINTS, "speed": 1}, {"angular_velocity": 1}, "angular_velocity", "follows from the `path`"),
        ({"points": [[4, 0]], "speed": 1}, {}, "path.points", "must be at least 2"),
        ({"angles": [1.0], "period": 1}, {}, "path.angles", "must be at least 2"),
        ({"speed": 1}, {}, "path.points", "must be at least 2"),
        ({"points": POINTS, "angles": [0, 1, 2], "speed": 1}, {}, "path.angles", "must be 2 angles"),
        ({"points": POINTS, "speed": 1, "pivot": [1, 0]}, {}, "path.pivot", "has no effect without `angles`"),
        ({"points": POINTS, "speed": 1, "period": 2}, {}, "path.speed", "cannot be combined with `period`"),
        ({"points": [[1, 1], [1, 1]], "speed": 1}, {}, "path.points", "are all at one place"),
        ({"angles": [0, 1], "speed": 1}, {}, "path.speed", "has no meaning for a path that only turns"),
        (
            {"points": [[0, 0], [1, 0], [1, 0]], "angles": [0, 0, 1], "period": 1},
            {},
            "path.angles",
            "between two points at one place",
        ),
        ({"points": POINTS, "period": 2, "pause": 1}, {}, "path.period", "longer than the pauses of a cycle"),
        ({"points": POINTS, "speed": 1, "easing": "bounce"}, {}, "path.easing", ""),
        ({"points": POINTS, "speed": 1e12, "easing": "smooth"}, {}, "path", "moves the body at up to 1.875e+12 m/s"),
        ({"points": [[0, 0], [1e16, 0]], "speed": 1}, {"position": [1e15, 0]}, "path", "leads more than 1e+16 m"),
        ({"points": POINTS, "speed": -1}, {}, "path.speed", ""),
    ],
)
def test_fault_names_its_key(path: dict[str, Any], body: dict[str, Any], key: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        motion(path, name="lift", **body)
    assert [fault.path for fault in caught.value.faults] == [f"box.lift.{key}"]
    assert message in caught.value.faults[0].message


def test_invalid_path_hides_no_other_fault() -> None:
    box = {"name": "lift", "position": [0, 0], "size": [1, 1], "kinematic": True, "path": {"points": [[0, 0]]}}
    ball = {"name": "lift", "position": [5, 5], "radius": 1}
    with pytest.raises(SceneError) as caught:
        from_document({"box": [box], "ball": [ball]})
    assert {fault.path for fault in caught.value.faults} == {"box.lift.path.points", "box.lift.name"}
