"""Bodies that slide, rest or roll on a plane, against DOP853 with the same friction and against the engines."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.incline import phases_of
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import integrated, motion_of, scene_of

G = 9.81
TIME = np.linspace(0.0, 2.0, 81)
HALF = math.sqrt(0.75)


def incline_scene(
    shape: str = "box",
    tilt: float = 30.0,
    friction: float = 0.3,
    speed: float = 0.0,
    extra: str = "",
    fixed: str = "",
    world: str = "",
) -> Scene:
    """Return a box of 1 m by 0.4 m, or a ball of radius 0.2 m, moving along a plane that descends to the right."""
    sin, cos = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
    shape_keys = "size = [1.0, 0.4]" if shape == "box" else "radius = 0.2"
    return scene_of(
        f"[[plane]]\npoint = [0.0, 0.0]\nnormal = [{sin!r}, {cos!r}]\nfriction = {friction}\n{fixed}",
        f"[[{shape}]]\nposition = [{0.2 * sin!r}, {0.2 * cos!r}]\n{shape_keys}\nangle = {-math.radians(tilt)!r}\n"
        f"velocity = [{speed * cos!r}, {-speed * sin!r}]\nmass = 3.0\n{extra}",
        world=f"gravity = [0.0, -9.81]\nduration = 2.0\n{world}",
    )


def distance(scene: Scene, tilt: float = 30.0) -> np.ndarray:
    """Return the closed-form distance of the body along the plane from its start, (T,) m."""
    sin, cos = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
    found = motion_of(scene, TIME)
    moved = found.position - found.position[0]
    assert moved @ [sin, cos] == pytest.approx(0.0, abs=1e-14)  # it stays on the plane: roundings of 10 m
    return moved @ [cos, -sin]


def test_box_pushed_up_the_slope_stops_and_slides_back_with_low_friction() -> None:
    up, down = G * (0.5 + 0.3 * HALF), G * (0.5 - 0.3 * HALF)
    stop = 3.0 / up
    expected = np.where(stop > TIME, -3.0 * TIME + 0.5 * up * TIME**2, -1.5 * stop + 0.5 * down * (TIME - stop) ** 2)
    # roundings of a few m
    assert distance(incline_scene(friction=0.3, speed=-3.0)) == pytest.approx(expected, abs=1e-13)
    stop = 3.0 / (G * (0.5 + 0.7 * HALF))
    stopped = stop <= TIME
    found = motion_of(incline_scene(friction=0.7, speed=-3.0), TIME)
    assert not found.velocity[stopped].any()
    # likewise
    assert distance(incline_scene(friction=0.7, speed=-3.0))[stopped] == pytest.approx(-1.5 * stop, abs=1e-14)


@pytest.mark.parametrize(
    ("tilt", "friction", "speed", "spin"),
    [(0, 0.2, 3.0, 40.0), (0, 0.1, -1.0, -30.0), (30, 0.1, 0.0, 0.0), (30, 0.5, -4.0, 10.0)],
)  # fmt: skip
def test_slipping_and_rolling_ball_agrees_with_dop853_under_smoothed_friction(tilt, friction, speed, spin):
    sin, cos = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
    width = 3e-3  # m/s of slip over which the smoothed friction changes its sign

    def derivative(_: float, s: np.ndarray) -> list[float]:
        friction_accel = -friction * G * cos * math.tanh((s[1] + 0.2 * s[3]) / width)
        return [s[1], G * sin + friction_accel, s[3], friction_accel / (0.5 * 0.2)]

    expected = integrated(derivative, [0.0, speed, 0.0, spin], TIME)
    scene = incline_scene("ball", tilt, friction, speed, f"angular_velocity = {spin!r}\n")
    found = motion_of(scene, TIME)
    # With smoothed friction the ball creeps at up to `width`, for 2 s.
    assert distance(scene, tilt) == pytest.approx(expected[0], abs=2.0 * width)
    assert found.spin == pytest.approx(expected[3], abs=3.0 * width / 0.2)


@given(
    pull=st.floats(-8.0, 8.0),
    friction=st.floats(0.0, 2.0),
    speed=st.floats(-5.0, 5.0),
    spin=st.floats(-20.0, 20.0),
    ball=st.booleans(),
)
def test_friction_stays_in_its_cone_and_never_increases_slip(pull, friction, speed, spin, ball):
    radius, inertia = (0.3, 2.0 / 0.3) if ball else (0.0, 0.0)
    phases = phases_of(pull, 5.0, friction, speed, spin if ball else 0.0, radius, inertia)
    assume(phases is not None)
    assert phases is not None
    assert len(phases) <= 2
    for phase in phases:
        slip = phase.speed + radius * phase.spin
        assert abs(phase.friction_accel) <= friction * 5.0 * (1.0 + 1e-12)  # rounding
        assert phase.friction_accel * slip <= 1e-12  # while rolling, slip is a rounding error
    if len(phases) == 2:  # the speed is continuous between phases
        first, last = phases
        t = last.begin
        # rounding
        assert first.speed + first.tangential_accel * t == pytest.approx(last.speed, abs=1e-12 * (1.0 + abs(pull) * t))


def test_lasting_contact_is_one_record_that_balances_momentum() -> None:
    scene = incline_scene(friction=0.3, speed=-3.0)
    form = solved_run(scene, scene.solver)
    assert form.contact_time.tolist() == [0.0]
    assert form.contact_pair.tolist() == [[0, -1]]
    gain = 3.0 * (form.velocity[-1, 0] - form.velocity[0, 0])
    impulse = gain - 3.0 * 2.0 * np.array([0.0, -G])
    assert -form.contact_impulse[0] == pytest.approx(impulse, abs=1e-12)  # roundings of 60 N·s


@pytest.mark.parametrize(
    "scene",
    [
        incline_scene(friction=math.tan(math.radians(30.0))),
        incline_scene(world="linear_drag = 0.1"),
        incline_scene(fixed="[[post]]\nposition = [9.0, 9.0]\nradius = 0.1\n"),
        incline_scene(extra="angular_velocity = 0.1\n"),
        incline_scene(tilt=70.0, friction=3.0),
        incline_scene(extra="[[ball]]\nposition = [9.0, 9.0]\nradius = 0.1\n"),
        incline_scene(extra="[[attraction]]\ntoward = [0.0, 9.0]\nstrength = 0.1\n"),
        incline_scene(extra="[[joint]]\nkind = 'spring'\nbetween = ['box-1']\nstiffness = 0.1\n"),
    ],
    ids=["on the edge", "drag", "a post", "turning", "tips over", "another ball", "attraction", "a spring"],
)  # fmt: skip
def test_motion_of_uncertain_outcome_has_no_closed_form(scene: Scene) -> None:
    assert solution(scene) is None


def test_box_off_the_plane_or_tilted_has_no_closed_form() -> None:
    head = "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\nfriction = 0.5\n"
    for change, has_form in (("0.5]", True), ("0.501]", False), ("0.499]", False), ("0.5]\nangle = 0.001", False)):
        box = f"[[box]]\nsize = [1.0, 1.0]\nposition = [0.0, {change}\n"
        found = solution(scene_of(head, box, world="gravity = [0.0, -9.81]"))
        assert (found is not None) is has_form


def test_capsule_and_dumbbell_slide_to_a_stop_on_a_plane() -> None:
    head = "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\nfriction = 0.5\n"
    capsule = "[[capsule]]\nlength = 1.0\nradius = 0.1\nposition = [0.0, 0.1]\nvelocity = [1.0, 0.0]\n"
    dumbbell = (
        "[[body]]\nposition = [0.0, 0.2]\nvelocity = [1.0, 0.0]\n[[body.ball]]\nradius = 0.2\nposition = [0.5, 0.0]\n"
        "[[body.ball]]\nradius = 0.2\nposition = [-0.5, 0.0]\n[[body.box]]\nsize = [1.0, 0.1]\n"
    )
    for body in (capsule, dumbbell):
        found = motion_of(scene_of(head, body, world="gravity = [0.0, -10.0]"), np.array([5.0]))
        assert found.position[0, 0] == pytest.approx(0.1, rel=1e-12)  # v²/(2 μ g), a few roundings
