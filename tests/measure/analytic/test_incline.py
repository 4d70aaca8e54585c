"""What lies on a plane: slides, rests and rolls, against DOP853 with the same friction and against the engines."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.incline import phases_of
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import form_of, integrated, motion_of, scene_of

G = 9.81
TIME = np.linspace(0.0, 2.0, 81)
HALF = math.sqrt(0.75)


def laid(
    shape: str = "box",
    tilt: float = 30.0,
    friction: float = 0.3,
    speed: float = 0.0,
    extra: str = "",
    fixed: str = "",
    world: str = "",
) -> Scene:
    """A box of 1 m by 0.4 m, or a ball of 0.2 m, on a plane that falls to the right, moving along it."""
    sin, cos = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
    form = "size = [1.0, 0.4]" if shape == "box" else "radius = 0.2"
    return scene_of(
        f"[[plane]]\npoint = [0.0, 0.0]\nnormal = [{sin!r}, {cos!r}]\nfriction = {friction}\n{fixed}",
        f"[[{shape}]]\nposition = [{0.2 * sin!r}, {0.2 * cos!r}]\n{form}\nangle = {-math.radians(tilt)!r}\n"
        f"velocity = [{speed * cos!r}, {-speed * sin!r}]\nmass = 3.0\n{extra}",
        world=f"gravity = [0.0, -9.81]\nduration = 2.0\n{world}",
    )


def way(scene: Scene, tilt: float = 30.0) -> np.ndarray:
    """Return how far the body has come along the plane, (T,) m, by formula."""
    sin, cos = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
    found = motion_of(scene, TIME)
    moved = found.position - found.position[0]
    assert moved @ [sin, cos] == pytest.approx(0.0, abs=1e-14)  # it stays on the plane: roundings of 10 m
    return moved @ [cos, -sin]


def test_box_slides_where_friction_is_too_little_and_sticks_where_it_is_enough() -> None:
    assert way(laid(friction=0.3)) == pytest.approx(0.5 * G * (0.5 - 0.3 * HALF) * TIME**2, abs=1e-13)  # of 5 m
    assert not way(laid(friction=0.58)).any()
    assert form_of(laid(friction=0.58)).about == "rest on a plane"


def test_box_thrown_up_the_slope_stops_and_comes_back_or_not() -> None:
    up, down = G * (0.5 + 0.3 * HALF), G * (0.5 - 0.3 * HALF)
    stop = 3.0 / up
    right = np.where(stop > TIME, -3.0 * TIME + 0.5 * up * TIME**2, -1.5 * stop + 0.5 * down * (TIME - stop) ** 2)
    assert way(laid(friction=0.3, speed=-3.0)) == pytest.approx(right, abs=1e-13)  # roundings of a few m
    stop = 3.0 / (G * (0.5 + 0.7 * HALF))
    later = stop <= TIME
    found = motion_of(laid(friction=0.7, speed=-3.0), TIME)
    assert not found.velocity[later].any()
    assert way(laid(friction=0.7, speed=-3.0))[later] == pytest.approx(-1.5 * stop, abs=1e-14)  # likewise


def test_slide_to_stop_takes_the_published_way_and_time() -> None:
    scene = laid(tilt=0.0, friction=0.5, speed=5.0)
    assert way(scene, 0.0)[-1] == pytest.approx(2.5484, abs=5e-5)  # the digits given
    found = motion_of(scene, np.array([1.01936, 1.01938]))
    assert found.velocity[0, 0] > 0.0 == found.velocity[1, 0]


@pytest.mark.parametrize(
    ("tilt", "friction", "speed", "spin"),
    [(0, 0.2, 3.0, 40.0), (0, 0.1, -1.0, -30.0), (30, 0.1, 0.0, 0.0), (30, 0.5, -4.0, 10.0)],
)  # fmt: skip
def test_ball_slips_and_rolls_as_dop853_with_friction_that_is_nearly_a_jump(
    tilt: float, friction: float, speed: float, spin: float
) -> None:
    sin, cos = math.sin(math.radians(tilt)), math.cos(math.radians(tilt))
    width = 3e-3  # m/s of slip over which the oracle's friction turns round

    def law(_: float, s: np.ndarray) -> list[float]:
        rub = -friction * G * cos * math.tanh((s[1] + 0.2 * s[3]) / width)
        return [s[1], G * sin + rub, s[3], rub / (0.5 * 0.2)]

    right = integrated(law, [0.0, speed, 0.0, spin], TIME)
    scene = laid("ball", tilt, friction, speed, f"angular_velocity = {spin!r}\n")
    found = motion_of(scene, TIME)
    # The oracle creeps by up to its width, for 2 s.
    assert way(scene, tilt) == pytest.approx(right[0], abs=2.0 * width)
    assert found.spin == pytest.approx(right[3], abs=3.0 * width / 0.2)


def test_disc_rolls_down_at_two_thirds_and_from_sliding_at_two_thirds() -> None:
    a = 2.0 / 3.0 * G * 0.5
    scene = laid("ball", friction=0.5)
    assert way(scene) == pytest.approx(0.5 * a * TIME**2, rel=1e-14)  # a few roundings
    assert motion_of(scene, TIME).spin == pytest.approx(-a * TIME / 0.2, rel=1e-14)  # likewise
    found = motion_of(laid("ball", 0.0, 0.2, 3.0), np.array([3.0 / (3.0 * 0.2 * G), 2.0]))
    assert found.velocity[:, 0] == pytest.approx([2.0, 2.0], rel=1e-14)  # likewise
    assert found.spin == pytest.approx([-10.0, -10.0], rel=1e-14)  # likewise


@given(
    pull=st.floats(-8.0, 8.0),
    friction=st.floats(0.0, 2.0),
    speed=st.floats(-5.0, 5.0),
    spin=st.floats(-20.0, 20.0),
    ball=st.booleans(),
)
def test_friction_stays_in_its_cone_and_never_drives_the_slip(
    pull: float, friction: float, speed: float, spin: float, ball: bool
) -> None:
    radius, inertia = (0.3, 2.0 / 0.3) if ball else (0.0, 0.0)
    phases = phases_of(pull, 5.0, friction, speed, spin if ball else 0.0, radius, inertia)
    assume(phases is not None)
    assert phases is not None
    assert len(phases) <= 2
    for phase in phases:
        slip = phase.speed + radius * phase.spin
        assert abs(phase.friction_accel) <= friction * 5.0 * (1.0 + 1e-12)  # rounding
        assert phase.friction_accel * slip <= 1e-12  # a slip of rounding while it rolls
    if len(phases) == 2:  # what one phase ends with the next begins with
        first, last = phases
        t = last.begin
        assert first.speed + first.tangential_accel * t == pytest.approx(
            last.speed, abs=1e-12 * (1.0 + abs(pull) * t)
        )  # rounding


def test_contact_is_one_that_lasts_and_carries_the_momentum() -> None:
    scene = laid(friction=0.3, speed=-3.0)
    form = solved_run(scene, scene.solver)
    assert form is not None
    assert form.contact_time.tolist() == [0.0]
    assert form.contact_pair.tolist() == [[0, -1]]
    gained = 3.0 * (form.velocity[-1, 0] - form.velocity[0, 0])
    taken = gained - 3.0 * 2.0 * np.array([0.0, -G])
    assert -form.contact_impulse[0] == pytest.approx(taken, abs=1e-12)  # roundings of 60 N·s


@pytest.mark.parametrize(
    "scene", [laid(), laid(speed=-3.0), laid("ball", friction=0.5, speed=2.0)], ids=["down", "up", "ball"]
)
def test_reference_converges_to_it(scene: Scene) -> None:
    errors = []
    for dt in (0.008, 0.002):
        truth = solved_run(scene, scene.solver.replace(dt=dt))
        found = run(scene, "reference", audit=False, dt=dt, integrator="velocity_verlet", slop=0.0)
        assert truth is not None
        errors.append(float(np.hypot(*(found.position[-1, 0] - truth.position[-1, 0]))))
    assert errors[1] < 0.5 * errors[0] < 0.02  # first order, of a way of some 5 m: a contact is felt a step late


@pytest.mark.parametrize(
    "scene",
    [
        laid(friction=math.tan(math.radians(30.0))),
        laid(world="linear_drag = 0.1"),
        laid(fixed="[[post]]\nposition = [9.0, 9.0]\nradius = 0.1\n"),
        laid(extra="angular_velocity = 0.1\n"),
        laid(tilt=70.0, friction=3.0),
        laid(extra="[[ball]]\nposition = [9.0, 9.0]\nradius = 0.1\n"),
        laid(extra="[[attraction]]\ntoward = [0.0, 9.0]\nstrength = 0.1\n"),
        laid(extra="[[joint]]\nkind = 'spring'\nbetween = ['box-1']\nstiffness = 0.1\n"),
    ],
    ids=["on the edge", "drag", "a post", "turning", "tips over", "another ball", "attraction", "a spring"],
)  # fmt: skip
def test_what_is_not_certain_has_no_form(scene: Scene) -> None:
    assert solution(scene) is None


def test_box_that_hovers_sinks_or_is_tilted_has_no_form() -> None:
    head = "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\nfriction = 0.5\n"
    for change, has in (("0.5]", True), ("0.501]", False), ("0.499]", False), ("0.5]\nangle = 0.001", False)):
        box = f"[[box]]\nsize = [1.0, 1.0]\nposition = [0.0, {change}\n"
        found = solution(scene_of(head, box, world="gravity = [0.0, -9.81]"))
        assert (found is not None) is has


def test_capsule_lies_on_its_side_and_a_hammer_on_head_and_handle() -> None:
    head = "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\nfriction = 0.5\n"
    capsule = "[[capsule]]\nlength = 1.0\nradius = 0.1\nposition = [0.0, 0.1]\nvelocity = [1.0, 0.0]\n"
    hammer = (
        "[[body]]\nposition = [0.0, 0.2]\nvelocity = [1.0, 0.0]\n[[body.ball]]\nradius = 0.2\nposition = [0.5, 0.0]\n"
        "[[body.ball]]\nradius = 0.2\nposition = [-0.5, 0.0]\n[[body.box]]\nsize = [1.0, 0.1]\n"
    )
    for each in (capsule, hammer):
        found = motion_of(scene_of(head, each, world="gravity = [0.0, -10.0]"), np.array([5.0]))
        assert found.position[0, 0] == pytest.approx(0.1, rel=1e-12)  # v²/(2 μ g), a few roundings
