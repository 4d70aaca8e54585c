"""The twenty cases with known answers: for each a shipped scene, its ground truth, and the known values."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from sandbox.arrays import FloatArray
from sandbox.measure.compare.ground_truth import Truth, TruthKind, truth_of
from sandbox.measure.metrics.energy import energies
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Trajectory

G = 9.81
SIN, COS = 0.5, math.sqrt(0.75)
DOWN = np.array([COS, -SIN])
"""Unit vector down the slope of 30°."""

Check = Callable[[Scene, Trajectory], None]


class Case(NamedTuple):
    """One scene of a case, with its overrides and the check of its ground truth."""

    number: int
    scene: str
    kind: TruthKind
    check: Check
    overrides: tuple[str, ...] = ()


def check_at_rest(_: Scene, truth: Trajectory) -> None:
    assert (truth.position == truth.position[0]).all()
    assert not truth.velocity.any()


def displacement(truth: Trajectory, along: FloatArray = DOWN) -> FloatArray:
    return np.asarray((truth.position[:, 0] - truth.position[0, 0]) @ along)


def check_projectile(_: Scene, truth: Trajectory) -> None:
    t = truth.time
    expected = np.column_stack((10 * t, 15 * t - G * t**2 / 2))
    assert truth.position[:, 0] == pytest.approx(expected, abs=1e-13)  # rounding of 30 m


def check_oscillation(omega: float, rest: float) -> Check:
    def check(_: Scene, truth: Trajectory) -> None:
        x = rest + 0.1 * np.cos(omega * truth.time)
        # 1e-13: rounding of ω, a root of the stiffness, and of a phase of up to 1,000 rad.
        assert truth.position[:, 0, 0] == pytest.approx(x, abs=1e-13)

    return check


PERIODS = {5: 2.0070219, 90: 2.3678419, 170: 4.8935243}


def pendulum_case(degrees: int) -> Case:
    quarter = PERIODS[degrees] / 4.0

    def check(scene: Scene, truth: Trajectory) -> None:
        assert f"{PERIODS[degrees]:.7f}" in scene.about
        fastest = math.sqrt(2.0 * G * (1.0 - math.cos(math.radians(degrees))))
        # At the bottom after a quarter of the period, which is known to half a unit of its seventh decimal.
        assert abs(truth.position[-1, 0, 0]) < fastest * 0.25 * 5e-8
        assert np.hypot(*truth.velocity[-1, 0]) == pytest.approx(fastest, rel=1e-12)  # a few roundings

    overrides = (f"world.duration={quarter!r}", f"solver.dt={quarter / 100.0!r}")
    return Case(4, f"pendulum_{degrees}", "closed_form", check, overrides)


def check_double_pendulum(scene: Scene, truth: Trajectory) -> None:
    total = energies(truth, scene).total
    assert np.abs(total - total[0]).max() < 1e-4 * 2.0 * G  # energy band of RATTLE, relative to a fall by 1 m


def check_orbit(_: Scene, truth: Trajectory) -> None:
    x, v = truth.position[:, 0], truth.velocity[:, 0]
    assert x[-1] == pytest.approx(x[0], abs=1e-14)  # roundings, after one period
    assert 0.5 * (v**2).sum(axis=1) - 1.0 / np.hypot(*x.T) == pytest.approx(-0.5, abs=1e-14)  # roundings
    assert x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0] == pytest.approx(math.sqrt(0.75), abs=1e-14)  # roundings


def check_bounces(_: Scene, truth: Trajectory) -> None:
    assert truth.contact_time[0] == pytest.approx(1.0096376, abs=5e-8)  # the digits given
    height = truth.position[:, 0, 1] - 0.5
    flights = np.split(height, np.searchsorted(truth.time, truth.contact_time))
    # A frame is at most half a millisecond from the top: ½·g·(0.5 ms)² below it.
    assert [each.max() for each in flights[1:4]] == pytest.approx([3.2, 2.048, 1.31072], abs=1.3e-6)
    rest_frame = np.searchsorted(truth.time, 9.0867380)
    assert height[rest_frame - 1] > 0.0
    assert not height[rest_frame:].any()


def check_elastic_bounces(scene: Scene, truth: Trajectory) -> None:
    total = energies(truth, scene).total
    assert total == pytest.approx(np.full(len(total), total[0]), rel=1e-12)  # rounding of the phases of 110 bounces
    assert len(truth.contact_time) == 1 + int((100.0 - math.sqrt(2.0 / G)) / math.sqrt(8.0 / G))


def check_resting_contact(scene: Scene, truth: Trajectory) -> None:
    check_at_rest(scene, truth)
    assert truth.contact_impulse[0] == pytest.approx([0.0, -G * 2.0], rel=1e-15)  # its weight, 2 s
    with pytest.raises(SceneError, match="restitution"):
        load(find("rest_depth"), ["ball.ball.restitution=1.01"])


def check_separation(mass: float) -> Check:
    def check(_: Scene, truth: Trajectory) -> None:
        expected = [(mass - 0.5) * 4.0 / (mass + 1.0), 1.5 * mass * 4.0 / (mass + 1.0)]
        assert truth.velocity[-1, :, 0] == pytest.approx(expected, rel=1e-15, abs=1e-15)  # a rounding

    return check


def check_perpendicular_exit(_: Scene, truth: Trajectory) -> None:
    first, second = truth.velocity[-1]
    assert abs(float(first @ second)) < 1e-15  # a rounding
    speeds = [np.hypot(*first), np.hypot(*second)]
    assert speeds == pytest.approx([0.5, math.sqrt(0.75)], rel=1e-14)  # root of a grazing collision


def check_cradle(count: int) -> Check:
    def check(_: Scene, truth: Trajectory) -> None:
        assert truth.velocity[-1, :, 0] == pytest.approx([0.0] * (5 - count) + [1.0] * count, abs=1e-15)  # a rounding

    return check


def check_sliding(_: Scene, truth: Trajectory) -> None:
    expected = 0.5 * G * (SIN - 0.3 * COS) * truth.time**2
    assert displacement(truth) == pytest.approx(expected, abs=1e-14)  # rounding of 5 m


def check_stopping(_: Scene, truth: Trajectory) -> None:
    assert truth.position[-1, 0, 0] == pytest.approx(2.5484, abs=5e-5)  # the digits given
    stopped = truth.time[np.flatnonzero(truth.velocity[:, 0, 0] == 0.0)[0]]
    assert stopped == pytest.approx(1.01937, abs=1e-3)  # a frame
    assert truth.velocity[-1].tolist() == [[0.0, 0.0]]


def check_rolling(_: Scene, truth: Trajectory) -> None:
    a = 2.0 / 3.0 * G * SIN
    assert displacement(truth) == pytest.approx(0.5 * a * truth.time**2, abs=1e-14)  # rounding of 6.5 m
    assert truth.angular_velocity[-1, 0] == pytest.approx(-13.08, abs=1e-13)  # roundings


def check_slipping(_: Scene, truth: Trajectory) -> None:
    # Just below μ = tanθ/3, so that it still slips.
    expected = 0.5 * G * (SIN - 0.192 * COS) * truth.time**2
    assert displacement(truth) == pytest.approx(expected, abs=1e-14)  # rounding of 6.5 m
    assert abs(truth.angular_velocity[-1, 0]) * 0.5 < np.hypot(*truth.velocity[-1, 0])


def check_slip_to_roll(_: Scene, truth: Trajectory) -> None:
    slip = truth.velocity[:, 0, 0] + 0.3 * truth.angular_velocity[:, 0]
    first = truth.time[np.flatnonzero(slip == 0.0)[0]]
    assert 0.0 <= first - 3.0 / (3.0 * 0.2 * G) < 1e-3  # a frame
    assert truth.velocity[-1, 0].tolist() == pytest.approx([2.0, 0.0], rel=1e-15)  # ⅔ of 3 m/s


def check_supported_weight(count: int, mass: float) -> Check:
    def check(scene: Scene, truth: Trajectory) -> None:
        check_at_rest(scene, truth)
        down = truth.contact_impulse[(truth.contact_pair == -1).any(axis=1)]
        assert down == pytest.approx(np.array([[0.0, -count * mass * G * scene.world.duration]]), rel=1e-13)  # 20 sums

    return check


def check_hanging_chain(_: Scene, truth: Trajectory) -> None:
    rods = np.hypot(*np.moveaxis(np.diff(truth.position, axis=1), 2, 0))
    assert rods == pytest.approx(0.1, abs=1e-5)  # a tenth of the tolerance of the refinement
    assert truth.position[-1, 10:, 0].max() < truth.position[0, 10:, 0].max()  # it falls


def check_bullet(_: Scene, truth: Trajectory) -> None:
    assert truth.contact_time.tolist() == pytest.approx([(1.0 - 0.02 - 0.05) / 100.0], rel=1e-14)  # roundings
    assert truth.velocity[-1].tolist() == [[-50.0, 0.0]]


def check_conservation(scene: Scene, truth: Trajectory) -> None:
    kinetic, mass = energies(truth, scene).kinetic, scene.bodies.mass
    assert (np.diff(kinetic) <= 1e-12 * kinetic[0]).all()  # roundings of one impact or a few
    if not scene.planes:
        momentum = np.einsum("n,tnk->tk", mass, truth.velocity)
        assert momentum - momentum[0] == pytest.approx(0.0, abs=1e-14)  # rounding of 0.85 kg m/s
    else:
        assert kinetic == pytest.approx(np.full(len(kinetic), kinetic[0]), rel=1e-11)  # e = 1: thousands of roundings
    pairs = np.triu_indices(len(mass), 1)
    for frame in truth.position[::10]:
        distance = np.hypot(*(frame[pairs[0]] - frame[pairs[1]]).T)
        assert distance.min() >= 2.0 * scene.bodies.radius[0] - 1e-12  # no overlap beyond rounding


SHORT = ("world.duration=0.1",)

CASES = (
    Case(1, "projectile", "closed_form", check_projectile),
    Case(2, "spring", "closed_form", check_oscillation(2.0 * math.pi, 1.0)),
    Case(3, "stiff_spring", "closed_form", check_oscillation(1990.0, 10.0)),
    Case(3, "stiff_spring_beyond", "closed_form", check_oscillation(2010.0, 10.0)),
    *(pendulum_case(degrees) for degrees in PERIODS),
    Case(5, "double_pendulum", "refined", check_double_pendulum, SHORT),
    Case(
        6, "kepler", "closed_form", check_orbit, (f"world.duration={2 * math.pi!r}", f"solver.dt={2 * math.pi / 100!r}")
    ),
    Case(7, "bounce_to_rest", "closed_form", check_bounces),
    Case(8, "elastic_ball", "closed_form", check_elastic_bounces),
    Case(9, "rest_depth", "closed_form", check_resting_contact),
    *(
        Case(10, "two_balls", "closed_form", check_separation(mass), (f"ball.heavy.mass={mass!r}",))
        for mass in (3.0, 1e-12, 1e12)
    ),
    Case(11, "oblique", "closed_form", check_perpendicular_exit),
    Case(12, "newtons_cradle", "closed_form", check_cradle(1)),
    Case(12, "newtons_cradle", "closed_form", check_cradle(2), ("ball.b.velocity=[1.0, 0.0]",)),
    Case(13, "box_sticks", "closed_form", check_at_rest),
    Case(13, "box_slides", "closed_form", check_sliding),
    Case(14, "slide_to_stop", "closed_form", check_stopping),
    Case(15, "incline", "closed_form", check_rolling),
    Case(15, "incline", "closed_form", check_slipping, ("plane.slope.friction=0.192",)),
    Case(15, "slide_to_roll", "closed_form", check_slip_to_roll),
    Case(16, "tower", "closed_form", check_supported_weight(20, 1.0)),
    Case(16, "pyramid", "closed_form", check_at_rest),
    *(
        Case(17, "heavy_on_light", "closed_form", check_supported_weight(1, 1.0 + mass), (f"box.heavy.mass={mass!r}",))
        for mass in (10.0, 100.0, 1e4)
    ),
    Case(18, "chain_of_20", "refined", check_hanging_chain, SHORT),
    Case(19, "bullet", "exact", check_bullet),
    Case(20, "break_shot", "exact", check_conservation),
    Case(20, "gas", "exact", check_conservation, ("world.duration=12.0", "solver.dt=0.02")),
)


def truth_for(case: Case) -> tuple[Scene, Truth]:
    scene = load(find(case.scene), case.overrides)
    truth = truth_of(scene, scene.solver, default_tolerance(scene))
    assert truth is not None
    return scene, truth


def test_every_case_has_a_scene() -> None:
    assert sorted({case.number for case in CASES}) == list(range(1, 21))


@pytest.mark.full
@pytest.mark.parametrize("case", CASES, ids=[f"{c.number}-{c.scene}-{k}" for k, c in enumerate(CASES)])
def test_ground_truth_has_the_known_values(case: Case) -> None:
    scene, truth = truth_for(case)
    assert truth.kind == case.kind
    case.check(scene, truth.trajectory)
    # Only the gas is chaotic: after some seconds its 225 balls depend on rounding of the initial state.
    assert (truth.trusted_until < scene.world.duration) == (case.scene == "gas")
