"""Perturbed starts: bounds, reproducibility, no overlaps, and odds that agree with a closed form."""

import numpy as np
import pytest

import sandbox
from sandbox.action import Impulse
from sandbox.engines.registry import able, start
from sandbox.measure.metrics.clearance import close_pairs
from sandbox.measure.proportion import wilson_interval
from sandbox.measure.starts import MAX_WIDTHS, Starts
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import shipped
from tests.toml_text import toml

NUMBERS = (1, 2, 3)
SCENES = sorted(name for name, _ in shipped() if not name.startswith("particles/"))  # which start in one point


def depth(scene: Scene) -> float:
    """Return the largest overlap at the start, m."""
    return max((-clear for _, clear in close_pairs(scene)), default=0.0)


def joint_lengths(scene: Scene) -> np.ndarray:
    """Return the distance of the ends of each joint, m."""
    first, second = scene.joint_arrays.ends(scene.bodies.position, scene.bodies.angle)
    return np.hypot(*(second - first).T)


@pytest.mark.fail_slow(60)  # terrain of artillery, stacks of hundreds of boxes
@pytest.mark.parametrize("name", SCENES)
def test_starts_of_shipped_scenes_have_no_new_overlap_and_no_stretched_joint(name: str) -> None:
    scene = load(name)
    starts = Starts(scene)
    for number in NUMBERS:
        varied = starts.start(number)
        bodies, own = varied.bodies, scene.bodies
        if len(bodies) == len(own) and bodies.names == own.names:
            assert np.array_equal(bodies.position[own.fixed | own.kinematic], own.position[own.fixed | own.kinematic])
        assert depth(varied) <= depth(scene) + 1e-8  # pairs may each deepen by 1e-9 m, which is rounding
        if len(varied.joint_arrays) == len(scene.joint_arrays):
            # rounding of a rotation of metres
            np.testing.assert_allclose(joint_lengths(varied), joint_lengths(scene), rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("name", ["bounce", "tower", "double_pendulum", "gas", "ragdoll_stairs"])
def test_a_start_is_found_again_by_its_number(name: str) -> None:
    first, again = (Starts(load(name)).start(7).bodies for _ in range(2))
    for key in ("position", "velocity", "angle", "angular_velocity"):
        assert getattr(first, key).tobytes() == getattr(again, key).tobytes()
    other = Starts(load(name)).start(8).bodies
    assert any(getattr(first, key).tobytes() != getattr(other, key).tobytes() for key in ("position", "velocity"))


def test_number_0_and_a_spread_of_0_are_the_start_of_the_file() -> None:
    scene = load("bounce")
    assert Starts(scene).start(0) is scene
    assert Starts(scene, 0.0).start(5) is scene
    assert not Starts(scene, 0.0).can_vary
    assert Starts(load("gas"), 0.0).start(5).bodies.velocity.tolist() != load("gas").bodies.velocity.tolist()


def test_free_bodies_move_within_the_spread_and_a_step_of_free_motion() -> None:
    scene = loads(
        toml("world", gravity=[0.0, -10.0], duration=1.0)
        + toml("solver", dt=0.01)
        + toml("box", name="a", position=[0.0, 5.0], size=[1.0, 0.4], velocity=[3.0, 4.0], angular_velocity=2.0)
    )
    starts, own = Starts(scene, 0.02), scene.bodies
    assert starts.distance == pytest.approx(0.02 * 0.2)  # half the smaller side
    places, speeds, angles, phases = [], [], [], []
    for number in range(1, 400):
        bodies = starts.start(number).bodies
        gained = -(bodies.velocity[0] @ [0.0, 1.0] - 4.0) / 10.0  # s, with the noise of the velocity
        places.append(bodies.position[0] - own.position[0])
        speeds.append(np.hypot(*bodies.velocity[0]))
        angles.append(bodies.angle[0])
        phases.append(gained)
    along = np.array(places) @ [0.6, 0.8]
    reach = 0.01 * 5.0 * 1.02 + starts.distance
    assert -starts.distance < along.min() < 0.002
    assert 0.9 * (reach - starts.distance) < along.max() < reach
    assert np.abs(np.array(angles)).max() == pytest.approx(0.02 * 0.87, rel=0.02)  # 400 draws reach the bound
    assert np.ptp(speeds) / 5.0 == pytest.approx(2 * 0.02, rel=0.5)  # and the fall of up to a step


@pytest.mark.parametrize(("step", "count"), [(None, 30), (0.04, 30), (0.04, 50)])
def test_phases_of_successive_starts_divide_the_step_evenly(step: float | None, count: int) -> None:
    """Multiples of the golden ratio leave no gap over 1.9 times the mean one (three-distance theorem)."""
    scene = loads(
        toml("world", gravity=[0.0, -10.0], duration=1.0)
        + toml("solver", dt=0.01)
        + toml("ball", name="a", position=[0.0, 5.0], radius=1.0)
    )
    starts, length = Starts(scene, 1e-6, step), 0.01 if step is None else step
    gained = [-starts.start(number).bodies.velocity[0, 1] / 10.0 for number in range(count)]
    edges = np.sort([*gained, length])
    assert np.diff(edges).max() < 1.9 * length / count
    assert edges[0] == 0.0
    assert edges[-2] < length


def test_actions_come_up_to_a_frame_later_in_the_same_order() -> None:
    scene = load("bounce")
    times = [0.0, 0.0, 0.5, 0.502, 0.9]
    actions = [Impulse(time=time, body="ball", impulse=(float(k), 0.0)) for k, time in enumerate(times)]
    starts = Starts(scene, step=0.02)
    assert starts.actions(actions, 0) == tuple(actions)
    assert starts.actions(actions, 7) == starts.actions(actions, 7) != starts.actions(actions, 8)
    delays = []
    for number in range(1, 200):
        changed = starts.actions(actions, number)
        assert [each.impulse for each in changed] == [each.impulse for each in actions]
        moved = [each.time for each in changed]
        assert moved == sorted(moved)
        assert moved[0] == moved[1]  # what comes at once stays together
        delays.append(moved[4] - times[4])
    assert (min(delays), max(delays)) == (pytest.approx(0.0, abs=0.001), pytest.approx(0.02, abs=0.001))  # 199 draws


def test_a_fast_body_does_not_start_behind_a_wall() -> None:
    scene = loads(
        toml("world", gravity=[0.0, 0.0], duration=1.0)
        + toml("solver", dt=0.1)
        + toml("wall", points=[[1.0, -5.0], [1.0, 5.0]], thickness=0.02)
        + toml("ball", name="a", position=[0.0, 0.0], radius=0.1, velocity=[100.0, 0.0])
    )
    found = [Starts(scene).start(number).bodies.position[0, 0] for number in range(1, 60)]
    assert max(found) <= 1.0 - 0.01 - 0.1 + 1e-9
    assert max(found) > 0.7  # it comes near
    assert max(found) <= MAX_WIDTHS * 0.1 + 0.001


def test_a_fast_body_is_moved_on_by_even_parts_of_its_free_motion() -> None:
    """Of a step of 200 half widths the body covers between 0 and `MAX_WIDTHS`, not mostly the largest."""
    scene = loads(
        toml("world", duration=1.0)
        + toml("solver", dt=0.1)
        + toml("ball", position=[0.0, 0.0], velocity=[100.0, 0.0], radius=0.05)
    )
    moved = np.sort([Starts(scene).start(number).bodies.position[0, 0] for number in range(1, 101)]) / 0.05
    assert moved.max() <= MAX_WIDTHS + 0.2  # the displacement and the change of the speed, of 1 % each
    # Of 100 starts 50 ± 10 are in the lower half, by two standard deviations.
    assert abs(np.searchsorted(moved, 0.5 * MAX_WIDTHS) - 50) <= 10
    assert np.diff(moved).max() < 0.1 * MAX_WIDTHS


@pytest.mark.parametrize("name", ["bounce", "tower", "double_pendulum", "newtons_cradle", "half_ball"])
@pytest.mark.fail_slow(60)  # engines that are compiled
def test_every_engine_starts_from_the_perturbed_state(name: str) -> None:
    scene = Starts(load(name)).start(3)
    for engine in able(scene):
        simulation = start(scene, engine)
        frame = simulation.frame()
        np.testing.assert_array_equal(frame.position, scene.bodies.position)
        np.testing.assert_array_equal(frame.angle, scene.bodies.angle)
        simulation.close()


def test_changed_duration_and_settings_keep_the_start() -> None:
    scene = Starts(load("bounce")).start(2)
    for engine, dt in (("pymunk", 0.01), ("reference", 0.004)):
        run = sandbox.run(scene.with_duration(0.1), engine=engine, dt=dt, audit=False)
        assert run.position[0].tolist() == scene.bodies.position.tolist()


@pytest.mark.fail_slow(60)  # 400 runs
def test_odds_of_tunnelling_over_starts_are_those_of_the_phase_of_the_step() -> None:
    """The bullet passes unless a step ends within its radius of the wall: 1 − 2 (r + w/2)/(v dt) = 0.8."""
    scene = load("bullet")
    starts, count = Starts(scene), 400
    passed = 0
    for number in range(1, count + 1):
        run = sandbox.run(starts.start(number), engine="pymunk", audit=False)
        passed += bool(run.velocity[-1, 0, 0] > 0.0)
    low, high = wilson_interval(passed, count)
    # velocities differ by 1 %, and the odds with them by 0.002
    assert low - 0.002 <= 0.8 <= high + 0.002


@pytest.mark.parametrize(("name", "varies"), [("hanging_chain", False), ("cloth", False), ("pendulum_90", True)])
def test_a_net_at_rest_between_points_does_not_vary(name: str, varies: bool) -> None:
    assert Starts(load(name)).can_vary == varies


def test_a_perturbed_start_cannot_be_written_as_a_file() -> None:
    scene = Starts(load("bounce")).start(1)
    assert scene.is_perturbed
    assert not load("bounce").is_perturbed
    with pytest.raises(ValueError, match="cannot be written"):
        sandbox.dumps(scene)


def test_negative_number_raises() -> None:
    with pytest.raises(ValueError, match="at least 0, is -1"):
        Starts(load("bounce")).start(-1)


@pytest.mark.parametrize("spread", [-0.01, 0.6, float("nan")])
def test_invalid_spread_raises(spread: float) -> None:
    with pytest.raises(ValueError, match=r"spread: must be from 0 to 0\.5"):
        Starts(load("bounce"), spread)


@pytest.mark.parametrize("between", ['["a"]', '["post", "a"]'])
@pytest.mark.parametrize(
    "kind", ['kind = "weld"', 'kind = "prismatic"\naxis = [1.0, 0.0]\ntravel = [0.0, 1.0]', "hinge"]
)
def test_hanging_body_is_turned_in_other_starts_unless_a_joint_holds_its_angle(kind: str, between: str) -> None:
    text = 'kind = "pivot"\nat = [0.0, 0.0]' if kind == "hinge" else f"{kind}\nat = [0.0, 0.0]"
    scene = loads(
        '[[box]]\nname = "a"\nposition = [0.6, 0.0]\nsize = [1.0, 0.2]\n'
        '[[ball]]\nname = "post"\nposition = [0.0, 0.0]\nradius = 0.05\nfixed = true\n'
        f"[[joint]]\nbetween = {between}\n{text}\n"
    )
    turned = [bool(Starts(scene).start(number).bodies.angle.any()) for number in range(1, 6)]
    assert turned == [kind == "hinge"] * 5
