"""Preflight checks: odds of tunnelling, the largest safe step, and other warnings and notes."""

import math

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.preflight import (
    FAILED,
    floor_3_digits,
    largest_safe_dt,
    notes,
    top_speeds,
    tunnelling_risks,
    unknown_speeds,
    warnings,
)
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document, loads
from tests import strategies

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def bullet(speed: float, radius: float, thickness: float, solver: str = "") -> Scene:
    return loads(
        f'[solver]\n{solver}\n[[wall]]\nname = "w"\npoints = [[1, -1], [1, 1]]\nthickness = {thickness!r}\n'
        f'[[ball]]\nname = "b"\nposition = [0, 0]\nvelocity = [{speed!r}, 0]\nradius = {radius!r}\n'
    )


def test_continuous_collision_of_box2d_leaves_only_moving_bodies_at_risk() -> None:
    """The bullet itself is stopped at the wall on box2d, see `tests/engines/test_box2d.py`."""
    scene = bullet(1e3, 0.01, 0.01, "dt = 0.01")
    kinds = {engine: {warning.kind for warning in warnings(scene, engine=engine)} for engine in ("pymunk", "box2d")}
    assert "tunnelling" in kinds["pymunk"] and "tunnelling" not in kinds["box2d"]
    assert largest_safe_dt(scene, engine="box2d") == math.inf
    discrete = scene.solver.replace(continuous=False)
    assert "tunnelling" in {warning.kind for warning in warnings(scene, discrete, "box2d")}
    assert largest_safe_dt(scene, discrete, "box2d") == largest_safe_dt(scene)


def test_box2d_rounds_positions_to_32_bits() -> None:
    """Float32 has 24 bits: 4,096 m from the origin positions are multiples of 2⁻¹¹ m, 5 % of a radius of 10 mm."""
    scene = loads(
        "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n[[ball]]\nname = 'b'\nposition = [4100, 1]\nradius = 0.01\n"
    )
    assert "rounding" not in {warning.kind for warning in warnings(scene, engine="pymunk")}
    (found,) = [warning for warning in warnings(scene, engine="box2d") if warning.kind == "rounding"]
    assert found.details["share"] == pytest.approx(2.0**-11 / 0.01, rel=1e-12)
    (note,) = [note for note in notes(scene, "box2d") if note.kind == "box2d"]
    assert note.details["spacing"] == 2.0**-11
    assert "box2d" not in {note.kind for note in notes(scene)}


@given(st.floats(1.0, 1e6), st.floats(1e-3, 1.0), st.floats(0.0, 1.0), st.floats(1e-6, 10.0), st.integers(1, 9))
def test_tunnelling_odds_are_zero_up_to_the_safe_dt_and_then_grow(v, r, w, dt, substeps):
    """Flights with random phases agree with the odds: `tests/laws/test_tunnelling.py`."""
    scene = bullet(v, r, w, f"dt = {dt!r}\nsubsteps = {substeps}")
    (passage,) = tunnelling_risks(scene)
    safe = largest_safe_dt(scene)
    h, limit = dt / substeps, safe / substeps
    assert v * limit == pytest.approx(r + w / 2, rel=1e-12)  # depth of a contact; rounding of a product
    assert passage.odds(0.999 * limit) == 0.0
    assert 0.0 < passage.odds(1.001 * limit) < passage.odds(2.0 * limit) < 1.0
    tunnelling = [warning for warning in warnings(scene) if warning.kind == "tunnelling"]
    assert len(tunnelling) == (passage.odds(h) > 1e-9)  # less is rounding
    for warning in tunnelling:
        assert (warning.details["ball"], warning.details["thing"], warning.details["speed"]) == ("b", "w", v)
        assert (warning.details["odds"], warning.details["safe_dt"]) == (passage.odds(h), safe)


def test_tunnelling_of_two_balls_depends_on_closing_speed_and_both_radii() -> None:
    scene = loads(
        '[[ball]]\nname = "a"\nposition = [0, 0]\nvelocity = [30, 0]\nradius = 0.1\n'
        '[[ball]]\nname = "b"\nposition = [9, 0]\nvelocity = [-10, 0]\nradius = 0.3\n'
    )
    (passage,) = tunnelling_risks(scene)
    # Nothing else can turn them round: they approach at 40 m/s, and touch at the sum of their radii.
    assert (passage.speed, passage.reach) == (40.0, 0.4)
    (warning,) = warnings(scene, scene.solver.replace(dt=0.02))
    assert (warning.kind, warning.details["odds"], warning.details["safe_dt"]) == ("tunnelling", 0.5, 0.01)


def test_each_body_at_risk_is_named_with_its_own_speed() -> None:
    text = "[solver]\ndt = 0.01\n[[wall]]\nname = 'w'\npoints = [[1, -9], [1, 9]]\nthickness = 0.02\n"
    for k, (name, speed) in enumerate({"slow": 9.0, "middle": 25.0, "fast": 60.0}.items()):
        text += f"[[ball]]\nname = {name!r}\nposition = [0, {k}]\nvelocity = [{speed}, 0]\nradius = 0.1\n"
    found = [w for w in warnings(loads(text)) if w.details["thing"] == "w"]
    assert [(w.details["ball"], w.details["speed"]) for w in found] == [("fast", 60.0), ("middle", 25.0)]


def test_impact_speed_on_a_floor_wall_is_that_of_the_fall() -> None:
    scene = loads(
        "[world]\ngravity = [0, -9.81]\nduration = 20.0\n[[wall]]\nname = 'floor'\npoints = [[-5, 0], [5, 0]]\n"
        "thickness = 0.1\n[[ball]]\nposition = [0, 1.15]\nradius = 0.1\n"
    )
    (passage,) = tunnelling_risks(scene)
    assert passage.speed == pytest.approx(math.sqrt(2 * 9.81 * 1.0), rel=1e-12)  # roundings of a sum and a root
    assert warnings(scene) == []


def test_ball_that_cannot_reach_a_wall_is_no_tunnelling_risk() -> None:
    scene = loads(
        "[world]\ngravity = [0, -10]\nduration = 9.0\n[solver]\ndt = 0.1\n[[wall]]\npoints = [[-5, 9], [5, 9]]\n"
        "[[ball]]\nposition = [0, 0]\nvelocity = [0, 10]\nradius = 0.1\n"  # rises by 5 m
    )
    assert [passage.speed for passage in tunnelling_risks(scene)] == [0.0]


def test_safe_step_is_none_only_for_unbounded_speeds() -> None:
    ball = '[[ball]]\nname = "b"\nposition = [3, 0]\nradius = 0.1\n[[post]]\nposition = [0, 0]\nradius = 0.2\n'
    sun = "[[attraction]]\ntoward = [0, 0]\nstrength = 10.0\n"
    assert largest_safe_dt(loads(ball)) == math.inf
    assert largest_safe_dt(loads(ball + sun.replace("[0, 0]", "[0, 1]"))) is None
    # A post around the centre of attraction bounds the speed: v² = 2·s·(1/0.2 − 1/3).
    impact_speed = math.sqrt(2 * 10.0 * (1 / 0.2 - 1 / 3.0))
    assert largest_safe_dt(loads(ball + sun)) == pytest.approx(0.3 / impact_speed, rel=1e-12)  # roundings
    soft = loads(ball + sun + "softening = 0.1\n")
    # From 3 m to the post by energy: v² = 2·(s/ε)·(atan(3/ε) − atan(0.2/ε)).
    fastest = math.sqrt(2 * 100.0 * (math.atan(30.0) - math.atan(2.0)))
    assert largest_safe_dt(soft) == pytest.approx(0.3 / fastest, rel=1e-12)  # roundings
    stretched = ball + '[[joint]]\nkind = "spring"\nbetween = ["b"]\nrest_length = 1.0\nstiffness = 200.0\n'
    # ½·200·2² J in 1 kg
    assert largest_safe_dt(loads(stretched + "anchors = [[0, 0], [0, 0]]\n")) == pytest.approx(0.3 / math.sqrt(800.0))
    driven = '[world]\nduration = 2.0\n[[thrust]]\nbody = "b"\nforce = [5.0, 0]\n'
    assert largest_safe_dt(loads(driven + ball)) == pytest.approx(0.3 / 10.0)


@pytest.mark.parametrize(
    ("masses", "expected"), [((4.0, 1.0), 16.0), ((16.0, 4.0, 1.0), 25.6)], ids=["one impact", "two impacts"]
)
def test_speed_gains_of_impacts_from_heavy_to_light_multiply(masses: tuple[float, ...], expected: float) -> None:
    text = "".join(
        f"[[ball]]\nposition = [{5 * k}, 0]\nradius = 1\nmass = {mass}\n" + "velocity = [10, 0]\n" * (k == 0)
        for k, mass in enumerate(masses)
    )
    scene = loads(text)
    # 1.6 times at each impact
    assert top_speeds(scene, contact_matrix(scene))[-1] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("fraction", "holds"), [(0.95, True), (1.05, False)])
@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"])
def test_dampers_too_strong_for_the_step_are_predicted_for_reference(integrator, fraction, holds):
    def damped(rate: float) -> Scene:
        return loads(
            f"[world]\nduration = 2.0\n[solver]\nintegrator = {integrator!r}\n[[ball]]\nname = 'b'\nradius = 0.1\n"
            "position = [1.2, 0]\nvelocity = [1, 0]\n[[joint]]\nkind = 'spring'\nbetween = ['b']\nstiffness = 25.0\n"
            f"anchors = [[0, 0], [0, 0]]\nrest_length = 1.0\ndamping = {rate!r}\n"
        )

    (warning,) = warnings(damped(1e3), engine="reference")
    limit = float(warning.details["limit"])
    scene = damped(fraction * limit / 0.01)
    assert ([w.kind for w in warnings(scene, engine="reference")] == []) == holds
    assert warnings(scene, engine="pymunk") == []
    found = run(scene, "reference", audit=False)
    assert (found.status == "ok" and abs(found.position[-1, 0, 0] - 1.0) < 0.3) == holds


def test_posts_planes_and_fixed_balls_have_individual_depths() -> None:
    scene = loads(
        '[[plane]]\nname = "p"\npoint = [0, -9]\nnormal = [0, 1]\n'
        '[[post]]\nname = "q"\nposition = [5, 0]\nradius = 0.25\n'
        '[[ball]]\nname = "f"\nposition = [9, 0]\nradius = 0.75\nfixed = true\n'
        '[[ball]]\nname = "b"\nposition = [0, 0]\nvelocity = [10, 0]\nradius = 0.5\n'
    )
    assert {p.thing: p.reach for p in tunnelling_risks(scene)} == {"p": 1000.5, "q": 0.75, "f": 1.25}
    assert largest_safe_dt(scene) == 0.075
    (passage,) = tunnelling_risks(loads(FENCE + BOX.format(y=9) + "velocity = [30, 0]\n"))
    assert passage.reach == 1.1  # half the smaller side of the box, and half the thickness of the wall


@given(st.floats(0.0, 50.0), st.floats(-10.0, 10.0), st.floats(0.1, 20.0), st.floats(0.0, 1.0))
def test_speed_above_a_level_floor_is_bounded_by_the_drop(height: float, up: float, g: float, e: float) -> None:
    scene = loads(
        f"[world]\ngravity = [0.0, -{g!r}]\nduration = 2.0\n[solver]\ndt = 0.01\n"
        f"[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\nrestitution = {e!r}\n"
        f"[[ball]]\nposition = [0, {height + 0.5!r}]\nvelocity = [1.0, {up!r}]\nradius = 0.5\n"
    )
    bound = float(top_speeds(scene, contact_matrix(scene))[0])
    start = math.hypot(1.0, up)
    assert bound == pytest.approx(min(start + 2 * g, math.sqrt(start**2 + 2 * g * height)), rel=1e-12)  # roundings
    speed = np.hypot(*run(scene, audit=False).velocity[:, 0].T).max()
    # Contact one step late adds one step of gravity, and the correction of the overlap adds as much again.
    assert speed <= bound + 3 * g * 0.01


@pytest.mark.parametrize("normal", ["[0.1, 1.0]", "[0.0, -1.0]", "[1.0, 0.0]"])
def test_plane_that_is_no_level_floor_does_not_bound_the_speed(normal: str) -> None:
    scene = loads(
        "[world]\ngravity = [0.0, -10.0]\nduration = 3.0\n"
        f"[[plane]]\npoint = [0, 0]\nnormal = {normal}\n[[ball]]\nposition = [1, 1]\nradius = 0.5\n"
    )
    assert top_speeds(scene, contact_matrix(scene)).tolist() == [30.0]


PAIR = (
    "[solver]\niterations = {iterations}\n"
    "[[ball]]\nposition = [0, 0]\nradius = 1\nrestitution = {e}\n[[ball]]\nposition = [{x}, 0]\nradius = 1\n"
)


def kinds(text: str) -> list[str]:
    return [warning.kind for warning in warnings(loads(text))]


@pytest.mark.parametrize(
    ("iterations", "e", "x", "expected"),
    [
        (10, 0.5, 3.0, []), (10, 0.5, 2.0, []), (10, 0.5, 1.99, ["overlap"]), (3, 0.5, 3.0, []),
        (2, 0.5, 3.0, ["iterations"]), (2, 0.0, 3.0, []), (1, 0.5, 1.0, ["overlap", "iterations"]),
    ],
)  # fmt: skip
def test_overlap_and_few_iterations_are_warned_of(iterations: int, e: float, x: float, expected: list[str]) -> None:
    assert kinds(PAIR.format(iterations=iterations, e=e, x=x)) == expected


def test_overlaps_are_counted_in_pairs_that_can_collide() -> None:
    ball = "[[ball]]\nposition = [0, 0]\nradius = 1\n"
    (warning,) = warnings(loads(ball * 3))
    assert warning.kind == "overlap"
    assert warning.details == {"pairs": 3, "depth": 2.0, "first": "ball-1", "second": "ball-2"}
    assert kinds((ball + 'collides = "none"\n') * 3) == []
    passing = (ball + 'collides = "fixed"\n') * 3
    assert kinds(passing) == []
    assert kinds(passing + ball + ball.replace("[0, 0]", "[2, 0]")) == []  # two colliding balls add no warning


@pytest.mark.parametrize(("x", "is_warned"), [(1e12, False), (1e13, True), (1e15, True)])
def test_rounding_far_from_the_origin_is_warned_of(x: float, is_warned: bool) -> None:
    far = loads(f'[[post]]\nposition = [0, 0]\nradius = 1\n[[ball]]\nname = "b"\nposition = [{x!r}, 0]\nradius = 0.5\n')
    found = warnings(far)
    assert [w.kind for w in found] == ["rounding"] * is_warned
    for warning in found:
        assert warning.details == {"ball": "b", "share": np.spacing(x) / 0.5}


def test_particles_without_collisions_yield_no_warnings() -> None:
    scene = loads(
        "[world]\nduration = 9.0\ngravity = [0, -10]\n[solver]\niterations = 1\n"
        "[[emitter]]\nposition = [1e15, 0]\ncount = 50\nvelocity_min = [-1e9, 0]\nvelocity_max = [1e9, 1]\n"
    )
    assert warnings(scene) == []
    assert largest_safe_dt(scene) == math.inf


@given(strategies.scenes())
def test_any_scene_yields_finite_numbers(scene: Scene) -> None:
    safe = largest_safe_dt(scene)
    if safe is None:
        assert "moving surfaces" in unknown_speeds(scene)
    assert safe is None or safe > 0.0
    for warning in warnings(scene):
        assert "nan" not in warning.message
        assert all(isinstance(v, str) or math.isfinite(v) for v in warning.details.values())
        if warning.kind == "tunnelling":
            assert 0.0 < float(warning.details["odds"]) <= 1.0
            assert float(warning.details["safe_dt"]) < scene.solver.dt
    if safe is not None and safe < math.inf and 1e-9 <= (below := 0.999 * safe) <= 10.0:
        assert "tunnelling" not in [w.kind for w in warnings(scene, scene.solver.replace(dt=below))]


@given(st.floats(1e-300, 1e300))
def test_limit_is_rounded_down_to_three_digits(limit: float) -> None:
    text = floor_3_digits(limit)
    assert float(text) <= limit * (1 + 1e-9)  # less counts as rounding
    assert float(text) >= limit * 0.99  # three digits
    assert len(text) <= 10


def test_limit_of_few_digits_is_unchanged() -> None:
    assert [floor_3_digits(x) for x in (0.0002, 0.1 + 0.2, 0.00019999999999999998, 101.0, 1e-9)] == [
        "0.0002", "0.3", "0.0002", "101", "1e-09",
    ]  # fmt: skip


@pytest.mark.parametrize(("dt", "is_warned"), [(1.0, False), (1.1, True)])
def test_step_longer_than_the_run_is_warned_of(dt: float, is_warned: bool) -> None:
    text = f"[world]\nduration = 1.0\n[solver]\ndt = {dt}\n[[ball]]\nposition = [0.0, 0.0]\nradius = 1.0\n"
    assert ["duration" in w.kind for w in warnings(loads(text))] == [True] * is_warned


def spring_scene(omega_h: float, solver: str = "", count: int = 1, damping: float = 0.0) -> Scene:
    """Return a row of balls of 1 kg on springs, the first fixed to the world; one alone has this ω·h at dt = 0.01."""
    text = f"[world]\nduration = 5.0\n[solver]\ndt = 0.01\n{solver}\n"
    for k in range(1, count + 1):
        text += f'[[ball]]\nname = "b{k}"\nposition = [{k}.001, 0]\nradius = 0.1\ncollides = "none"\n'
    for k in range(1, count + 1):
        ends = f'["b{k - 1}", "b{k}"]' if k > 1 else '["b1"]'
        text += f'[[joint]]\nkind = "spring"\nbetween = {ends}\nrest_length = 1.0\n'
        text += f"anchors = [[0, 0], [0, 0]]\nstiffness = {(omega_h / 0.01) ** 2!r}\ndamping = {damping!r}\n"
    return loads(text)


@pytest.mark.parametrize(("omega_h", "is_warned"), [(1.49, False), (1.51, True), (1.99, True), (2.01, True)])
def test_spring_near_the_limit_of_the_scheme_is_warned_of(omega_h: float, is_warned: bool) -> None:
    found = warnings(spring_scene(omega_h))
    assert [w.kind for w in found] == ["spring"] * is_warned
    for warning in found:
        assert warning.details["omega_h"] == pytest.approx(omega_h, rel=1e-12)  # a root of a square
        assert warning.details["safe_dt"] == pytest.approx(1.5 * 0.01 / omega_h, rel=1e-12)  # likewise
        assert ("is unstable" in warning.message) == (omega_h > 2.0)
        assert warnings(spring_scene(omega_h), spring_scene(1.0).solver.replace(dt=0.99 * 0.015 / omega_h)) == []


def test_chain_of_springs_oscillates_twice_as_fast_as_one() -> None:
    (warning,) = warnings(spring_scene(0.99, count=40))
    # The highest mode of 40 balls fixed at one end: 2 ω·cos(π/(2·40 + 1)).
    assert warning.details["omega_h"] == pytest.approx(0.99 * 2.0 * math.cos(math.pi / 81.0), rel=1e-6)  # small angles
    (many,) = warnings(spring_scene(0.99, count=400))  # more rows than the dense matrix has: by iteration
    assert many.details["omega_h"] == pytest.approx(1.98, rel=1e-3)  # 160 iterations towards one end of the spectrum


def test_lever_arm_raises_the_frequency_of_a_spring() -> None:
    text = (
        "[solver]\ndt = 0.01\n[[box]]\nname = 'b'\nposition = [0, 0]\nsize = [2.0, 1.0]\nmass = 3.0\n"
        "[[joint]]\nkind = 'spring'\nbetween = ['b']\nanchors = [[1.0, 0.0], [1.0, 5.0]]\nstiffness = 30000.0\n"
    )
    (warning,) = warnings(loads(text))
    moment = 3.0 * (4.0 + 1.0) / 12.0
    # A vertical force at the end of an arm of 1 m.
    expected = math.sqrt(30000.0 * (1.0 / 3.0 + 1.0 / moment))
    assert warning.details["omega"] == pytest.approx(expected, rel=1e-12)  # rounding of an eigenvalue


def test_explicit_euler_is_warned_of_its_growth_unless_damped() -> None:
    euler = "integrator = 'explicit_euler'"
    (warning,) = warnings(spring_scene(0.1, euler))
    assert warning.details["growth"] == pytest.approx((1.0 + 0.01) ** 50, rel=1e-9)  # rounding in a power
    # |R| = 1 at c = k·h.
    assert warnings(spring_scene(0.1, euler, damping=1.001)) == []
    assert len(warnings(spring_scene(0.1, euler, damping=0.9))) == 1


def test_rk4_has_its_own_limit() -> None:
    assert warnings(spring_scene(2.0, "integrator = 'rk4'")) == []
    (warning,) = warnings(spring_scene(2.5, "integrator = 'rk4'"))
    assert warning.details["limit"] == 2.0 * math.sqrt(2.0)


def chain(links: int, load: float = 1.0, solver: str = "") -> Scene:
    """Return balls on rods, suspended at one end, the last with another mass."""
    text = f"[world]\ngravity = [0, -9.81]\nduration = 3.0\n[solver]\n{solver}\n"
    for k in range(1, links + 1):
        mass = load if k == links else 1.0
        text += f'[[ball]]\nname = "b{k}"\nposition = [0, {-0.1 * k!r}]\nradius = 0.03\nmass = {mass}\n'
        text += 'collides = "none"\n'
    for k in range(1, links + 1):
        ends = f'["b{k - 1}", "b{k}"]' if k > 1 else '["b1"]'
        text += f'[[joint]]\nname = "j{k}"\nkind = "rod"\nbetween = {ends}\n'
    return loads(text)


@pytest.mark.parametrize("links", [5, 10, 20, 40])
def test_iterations_needed_for_a_chain_agree_with_measurements(links: int) -> None:
    (warning,) = warnings(chain(links, solver="dt = 0.02\niterations = 1"))
    assert warning.kind == "chain"
    needed = warning.details["needed"]
    # 2.4 n² iterations per second; for its slowest mode the chain is half a link longer than n.
    assert needed == pytest.approx(2.4 * links**2, rel=0.15)


@pytest.mark.parametrize(("fraction", "holds"), [(0.5, False), (1.1, True)])
@pytest.mark.parametrize(("links", "load"), [(20, 1.0), (2, 100.0), (5, 100.0)])
def test_chain_holds_or_breaks_as_predicted(links: int, load: float, fraction: float, holds: bool) -> None:
    found = [w for w in warnings(chain(links, load, "dt = 0.005\niterations = 1")) if w.kind in ("chain", "mass_ratio")]
    if load > 1.0:
        joint, ratio = found[0].details["joint"], found[0].details["ratio"]
        assert (found[0].kind, joint, ratio) == ("mass_ratio", f"j{links}", 100.0)
    iterations = fraction * float(found[0].details["needed"]) * 0.005
    solver = f"dt = {0.005 * math.ceil(iterations) / iterations!r}\niterations = {math.ceil(iterations)}"
    scene = chain(links, load, solver)
    assert (warnings(scene) == []) == holds
    error = run(scene, audit=False).info["joint_error"]
    # Torn apart, the error is half a link or more; else it is the stretch by the fall in one step, a few percent.
    assert (error < 0.25) == holds


@pytest.mark.parametrize("method", ["relaxation", "xpbd", "rattle"])
@pytest.mark.parametrize(("links", "iterations", "dt"), [(20, 10, 1 / 60), (50, 10, 1 / 240), (20, 2, 1 / 120)])
def test_chain_of_position_methods_stretches_as_predicted(method: str, links: int, iterations: int, dt: float) -> None:
    solver = f"dt = {dt!r}\niterations = {iterations}\njoints = {method!r}\n"
    scene = chain(links, solver=solver)
    (warning,) = warnings(scene)
    assert (warning.kind, warning.details["joints"]) == ("chain", links)
    # The factor of the formula was measured at 0.8 to 1.8, and is taken as 1.6.
    predicted = pytest.approx(warning.details["share"], rel=0.4)
    assert run(scene, "reference", audit=False).info["joint_error"] == predicted
    assert warnings(scene, scene.solver.replace(dt=0.99 * float(warning.details["safe_dt"]))) == []


def test_free_chain_needs_a_quarter_of_the_iterations_of_a_suspended_one() -> None:
    """The slowest mode with both ends free is twice as fast as with one end fixed, so 4 times fewer iterations do."""
    suspended = chain(41, solver="dt = 0.016666\niterations = 1")
    free = suspended.model_copy(update={"joints": suspended.joints[1:]})
    (suspended_warning,), (free_warning,) = warnings(suspended), warnings(free)
    assert float(suspended_warning.details["needed"]) == pytest.approx(
        4.0 * float(free_warning.details["needed"]), rel=0.05
    )  # effects of the ends


def tower(boxes: int, masses: tuple[float, ...] = (), solver: str = "", gap: float = 0.0) -> Scene:
    text = f"[world]\ngravity = [0, -9.81]\nduration = 10.0\n[solver]\n{solver}\n"
    text += "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\nfriction = 0.5\n"
    for k in range(boxes):
        mass = masses[k] if masses else 1.0
        text += f'[[box]]\nname = "b{k + 1}"\nposition = [0, {0.5 + k * (1.0 + gap)!r}]\nsize = [1, 1]\n'
        text += f"mass = {mass!r}\nfriction = 0.5\n"
    return loads(text)


@pytest.mark.parametrize(("iterations", "is_warned"), [(2, True), (10, False)])
def test_tower_that_will_fall_is_warned_of(iterations: int, is_warned: bool) -> None:
    scene = tower(10, solver=f"dt = 0.016666\niterations = {iterations}")
    found = warnings(scene)
    assert [w.kind for w in found] == ["stack"] * is_warned
    for warning in found:
        assert (warning.details["body"], warning.details["bodies"]) == ("b1", 10)
        safe = scene.solver.replace(dt=float(warning.details["safe_dt"]))
        lean = 10.0**2.5 * 9.81 * safe.dt**2 / safe.iterations**0.8
        assert lean == pytest.approx(0.05, rel=1e-12)  # roundings
    top = run(scene, audit=False).position[-1, 9, 1]
    assert (top < 8.5) == is_warned  # it lost more than the height of a box, or nothing


def test_low_spaced_or_weightless_stack_is_not_warned_of() -> None:
    few_iterations = "dt = 0.016666\niterations = 2"
    assert warnings(tower(4, solver=few_iterations)) == []
    assert warnings(tower(10, solver=few_iterations, gap=0.1)) == []
    weightless = tower(10, solver=few_iterations).model_copy(update={"world": loads("[world]\nduration = 6.0\n").world})
    assert warnings(weightless) == []


@pytest.mark.parametrize(("iterations", "is_warned"), [(10, True), (80, False)])
def test_light_box_under_a_heavy_one_is_warned_of(iterations: int, is_warned: bool) -> None:
    scene = tower(2, (1.0, 100.0), f"dt = 0.016666\niterations = {iterations}")
    found = warnings(scene)
    assert [w.kind for w in found] == ["mass_ratio"] * is_warned
    for warning in found:
        assert (warning.details["body"], warning.details["other"], warning.details["ratio"]) == ("b2", "b1", 100.0)
    # If it is crushed, the upper box falls by its whole height; otherwise it sinks by a fraction of it at most.
    assert (run(scene, audit=False).position[-1, 1, 1] < 1.1) == is_warned


def test_touching_boxes_do_not_overlap_and_joined_ones_may() -> None:
    fine = "dt = 0.001\niterations = 50"
    assert warnings(tower(3, solver=fine)) == []
    (warning,) = warnings(tower(3, solver=fine, gap=-0.1))
    assert (warning.kind, warning.details["pairs"]) == ("overlap", 2)
    assert warning.details["depth"] == pytest.approx(0.1, rel=1e-9)
    assert warning.message.startswith("2 overlapping pairs of bodies at the start")
    two = tower(2, solver=fine, gap=-0.1)
    joined = loads(
        "[[box]]\nname = 'a'\nposition = [0, 0]\nsize = [1, 1]\n[[box]]\nname = 'b'\n"
        "position = [0.9, 0]\nsize = [1, 1]\n[[joint]]\nkind = 'pivot'\nbetween = ['a', 'b']\nat = [0.45, 0]\n"
    )
    assert [w.kind for w in warnings(two)] == ["overlap"]
    assert warnings(joined) == []


GROUND = "[[plane]]\nname = 'ground'\npoint = [0, 0]\nnormal = [0, 2]\n"
FENCE = "[[wall]]\nname = 'fence'\npoints = [[-3, 0], [3, 0], [3, 3]]\nthickness = 0.2\n"
PEG = "[[post]]\nname = 'peg'\nposition = [0, 0]\nradius = 0.5\n"
BALL = "[[ball]]\nname = 'a'\nposition = [0, {y}]\nradius = 1\n"
BOX = "[[box]]\nname = 'a'\nposition = [0, {y}]\nsize = [4, 2]\n"


@pytest.mark.parametrize("body", [BALL, BOX])
@pytest.mark.parametrize(("thing", "top"), [(GROUND, 0.0), (FENCE, 0.1), (PEG, 0.5)])
def test_overlap_with_a_fixed_shape_is_warned_of_with_its_depth(body: str, thing: str, top: float) -> None:
    (warning,) = warnings(loads("[world]\nduration = 0.01\n" + thing + body.format(y=0.4 + top)))
    names = warning.details["first"], warning.details["second"]
    assert (warning.kind, warning.details["pairs"], names[0]) == ("overlap", 1, "a")
    assert repr(names[1]) in warning.message
    assert warning.details["depth"] == pytest.approx(0.6, rel=1e-12)
    assert warnings(loads("[world]\nduration = 0.01\n" + thing + body.format(y=0.995 + top))) == []  # within the slop


@pytest.mark.parametrize(
    ("wall", "ball"),
    [("", "fixed = true\n"), ("", 'collides = "none"\n'), ("", 'layer = "up"\n'), ("solid = false\n", ""),
     ("one_way = true\n", "")],
)  # fmt: skip
def test_body_that_a_wall_does_not_stop_may_overlap_it(wall: str, ball: str) -> None:
    other = "[[zone]]\nposition = [9, 9]\nradius = 0.1\nto_layer = 'up'\n"
    assert kinds("[world]\nduration = 0.01\n" + FENCE + wall + BALL.format(y=0.4) + ball + other) == []


def test_deepest_overlap_among_bodies_and_fixed_shapes_is_named() -> None:
    text = GROUND + FENCE.replace("[-3, 0]", "[-3, 1]") + BALL.format(y=-0.5) + BALL.format(y=0.9).replace("'a'", "'b'")
    moving, fixed = (w for w in warnings(loads(text)) if w.kind == "overlap")
    assert (moving.details["pairs"], fixed.details["pairs"]) == (1, 4)
    assert (fixed.details["first"], fixed.details["second"]) == ("a", "ground")
    assert fixed.details["depth"] == pytest.approx(1.5, rel=1e-12)


def test_speed_of_a_pendulum_is_bounded_by_its_length() -> None:
    pendulum = loads(
        "[world]\ngravity = [0, -10]\nduration = 60.0\n[[post]]\nname = 'p'\nposition = [0, -3]\nradius = 0.1\n"
        "[[ball]]\nname = 'b'\nposition = [2, 0]\nradius = 0.1\n[[joint]]\nkind = 'rod'\nbetween = ['b']\n"
        "anchors = [[0, 0], [0, 0]]\n"
    )
    released = pendulum.model_copy(update={"joints": ()})
    # From the height of its anchor it falls to 2 m below the anchor at most.
    assert top_speeds(pendulum, contact_matrix(pendulum)).tolist() == pytest.approx([math.sqrt(2 * 10 * 2)], rel=1e-12)
    assert top_speeds(released, contact_matrix(released)).tolist() == [600.0]


def test_speed_is_bounded_by_the_fall_past_the_last_obstacle() -> None:
    scene = loads(
        "[world]\ngravity = [0, -10]\nduration = 60.0\n[[wall]]\npoints = [[-1, 0], [1, 0]]\nthickness = 0.2\n"
        "[[box]]\nposition = [0, 4]\nsize = [0.6, 0.8]\n"
    )
    # From 4 m to where its highest point, half a diagonal up, passes the lower side of the wall.
    assert top_speeds(scene, contact_matrix(scene)).tolist() == pytest.approx(
        [math.sqrt(2 * 10 * (4 + 0.1 + 0.5))], rel=1e-12
    )


def test_notes_report_concave_outlines_and_bodies_audited_as_discs() -> None:
    scene = loads(
        "[[polygon]]\nname = 'L'\npoints = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]\nposition = [5, 1]\n"
        "[[polygon]]\nname = 'convex'\npoints = [[0, 0], [2, 0], [2, 1]]\nposition = [9, 1]\n"
        "[[body]]\nname = 'two'\nposition = [0, 0]\n[[body.box]]\nsize = [1, 1]\n[[body.polygon]]\n"
        "points = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]\n"
    )
    outlines = {note.details["body"]: note for note in notes(scene) if note.kind == "outline"}
    assert {name: note.details["pieces"] for name, note in outlines.items()} == {"L": 2, "two": 2}
    assert outlines["L"].message == "the outline of 'L' is concave and is decomposed into 2 convex pieces"
    (audit,) = [note for note in notes(scene) if note.kind == "audit"]
    assert audit.details["bodies"] == 3
    assert notes(loads("[[ball]]\nposition = [0, 0]\nradius = 1\n")) == []


def test_first_order_flight_is_noted_with_its_error() -> None:
    scene = loads(
        "[world]\ngravity = [0, -10]\nduration = 2.0\n[solver]\ndt = 0.08\n[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n"
        "[[ball]]\nname = 'b'\nposition = [0, 20.5]\nradius = 0.5\n"
    )
    (note,) = [each for each in notes(scene) if each.kind == "flight"]
    assert note.details == {"body": "b", "error": pytest.approx(0.5 * 10 * 0.08 * 2.0, rel=1e-12)}  # rounding of a root
    exact = scene.model_copy(update={"solver": scene.solver.replace(integrator="velocity_verlet", detection="bisect")})
    assert "flight" not in [each.kind for each in notes(exact)]


CRATE = "[[box]]\nname = 'b'\nsize = [1, 1]\n"
STANDING_BALL = "[[ball]]\nname = 'b'\nradius = 0.5\nposition = [0, 0.5]\n"
WALL = "[[wall]]\npoints = [[-1, 0], [-1, 9]]\nthickness = 0.2\n"
NAIL = "[[joint]]\nkind = 'pivot'\nbetween = ['b']\nanchors = [[0, 0], [0, 5]]\n"


@pytest.mark.parametrize(
    ("tables", "body"),
    [
        (CRATE + "position = [0, 0.5]\n", None),
        (STANDING_BALL, None),
        (CRATE + "position = [0, 0.6]\n", "b"),
        (STANDING_BALL + "velocity = [0, 9]\n", "b"),
        ("[[stack]]\nbase = [0, 0]\nsize = [1, 1]\ncolumns = 1\nrows = 2\n", None),
        (CRATE + "position = [-0.4, 5]\n" + WALL, "b"),
        (CRATE + "position = [-0.4, 5]\n" + NAIL, None),
    ],
    ids=["crate", "ball", "crate above", "ball thrown", "stack", "beside a wall", "hangs"],
)
def test_bodies_that_stand_or_hang_do_not_fly(tables: str, body: str | None) -> None:
    text = "[world]\ngravity = [0, -10]\n[solver]\ndt = 0.5\n[[plane]]\npoint = [0, -9]\nnormal = [0, 1]\n"
    floor = "[[wall]]\npoints = [[-9, -0.5], [9, -0.5]]\nthickness = 1.0\n"
    found = [each.details["body"] for each in notes(loads(text + floor + tables)) if each.kind == "flight"]
    assert found == ([] if body is None else [body])


def test_settings_are_noted_by_their_names_in_pymunk_with_its_defaults_where_they_differ() -> None:
    table = {"ball": [{"position": [0, 1], "radius": 0.5}], "plane": [{"point": [0, 0], "normal": [0, 1]}]}
    scene = from_document(table)
    (note,) = (each for each in notes(scene, "pymunk") if each.kind == "pymunk")
    assert "space.collision_slop = 0.005 (pymunk's default: 0.1)" in note.message
    assert "space.iterations = 10, " in note.message  # the same in pymunk
    space = pymunk.Space()
    for name in ("iterations", "collision_bias", "collision_persistence"):
        assert note.details[name] == pytest.approx(getattr(space, name), rel=1e-5)  # pymunk rounds to 32 bits
    assert not [each for each in notes(scene) if each.kind == "pymunk"]
    # A slop that is large for the bodies is noted on any engine.
    (note,) = (each for each in notes(from_document({**table, "solver": {"slop": 0.1}})) if each.kind == "pymunk")
    assert "20 %" in note.message


@pytest.mark.parametrize("stiffness", [5e6, 1e30])
def test_explicit_euler_on_a_stiff_spring_gets_finite_answers(stiffness: float) -> None:
    ball = {"name": "a", "position": [1.0, 0.0], "radius": 0.1}
    spring = {"kind": "spring", "between": ["a"], "stiffness": stiffness, "anchors": [[0, 0], [0, 0]]}
    solver = {"dt": 0.001, "integrator": "explicit_euler"}
    scene = from_document({"ball": [ball], "joint": [spring], "solver": solver})
    found = warnings(scene)
    assert "spring" in [each.kind for each in found] and FAILED not in [each.kind for each in found]
    assert all(isinstance(v, str) or math.isfinite(v) for each in found for v in each.details.values())
