"""The twenty cases with a known answer: each a scene that ships, the truth that is found for it, and its figures."""

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
"""The slope of 30°."""

Check = Callable[[Scene, Trajectory], None]


class Case(NamedTuple):
    """One scene of a case, with what is changed of it."""

    number: int
    scene: str
    kind: TruthKind
    check: Check
    overrides: tuple[str, ...] = ()


def still(_: Scene, truth: Trajectory) -> None:
    assert (truth.position == truth.position[0]).all()
    assert not truth.velocity.any()


def way(truth: Trajectory, along: FloatArray = DOWN) -> FloatArray:
    return np.asarray((truth.position[:, 0] - truth.position[0, 0]) @ along)


def thrown(_: Scene, truth: Trajectory) -> None:
    t = truth.time
    assert truth.position[:, 0] == pytest.approx(np.column_stack((10 * t, 15 * t - G * t**2 / 2)), abs=1e-13)  # of 30 m


def swings(omega: float, rest: float) -> Check:
    def check(_: Scene, truth: Trajectory) -> None:
        x = rest + 0.1 * np.cos(omega * truth.time)
        # ω is a root of the stiffness, and up to 1,000 rad of phase round.
        assert truth.position[:, 0, 0] == pytest.approx(x, abs=1e-13)

    return check


PERIODS = {5: 2.0070219, 90: 2.3678419, 170: 4.8935243}


def pendulum(degrees: int) -> Case:
    quarter = PERIODS[degrees] / 4.0

    def check(scene: Scene, truth: Trajectory) -> None:
        assert f"{PERIODS[degrees]:.7f}" in scene.about
        fastest = math.sqrt(2.0 * G * (1.0 - math.cos(math.radians(degrees))))
        # At the bottom after a quarter of a period that is known to half of its seventh decimal.
        assert abs(truth.position[-1, 0, 0]) < fastest * 0.25 * 5e-8
        assert np.hypot(*truth.velocity[-1, 0]) == pytest.approx(fastest, rel=1e-12)  # a few roundings

    ways = (f"world.duration={quarter!r}", f"solver.dt={quarter / 100.0!r}")
    return Case(4, f"pendulum_{degrees}", "closed_form", check, ways)


def double(scene: Scene, truth: Trajectory) -> None:
    total = energies(truth, scene).total
    assert np.abs(total - total[0]).max() < 1e-4 * 2.0 * G  # RATTLE's band, of what falls by 1 m


def orbit(_: Scene, truth: Trajectory) -> None:
    x, v = truth.position[:, 0], truth.velocity[:, 0]
    assert x[-1] == pytest.approx(x[0], abs=1e-14)  # roundings, after one period
    assert 0.5 * (v**2).sum(axis=1) - 1.0 / np.hypot(*x.T) == pytest.approx(-0.5, abs=1e-14)  # likewise
    assert x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0] == pytest.approx(math.sqrt(0.75), abs=1e-14)  # likewise


def bounces(_: Scene, truth: Trajectory) -> None:
    assert truth.contact_time[0] == pytest.approx(1.0096376, abs=5e-8)  # the digits given
    height = truth.position[:, 0, 1] - 0.5
    flights = np.split(height, np.searchsorted(truth.time, truth.contact_time))
    # A frame is at most half a millisecond from the top: ½·g·(0.5 ms)² below it.
    assert [each.max() for each in flights[1:4]] == pytest.approx([3.2, 2.048, 1.31072], abs=1.3e-6)
    over = np.searchsorted(truth.time, 9.0867380)
    assert height[over - 1] > 0.0
    assert not height[over:].any()


def keeps_energy(scene: Scene, truth: Trajectory) -> None:
    total = energies(truth, scene).total
    assert total == pytest.approx(np.full(len(total), total[0]), rel=1e-12)  # 110 bounces round the phase of each
    assert len(truth.contact_time) == 1 + int((100.0 - math.sqrt(2.0 / G)) / math.sqrt(8.0 / G))


def rests(scene: Scene, truth: Trajectory) -> None:
    still(scene, truth)
    assert truth.contact_impulse[0] == pytest.approx([0.0, -G * 2.0], rel=1e-15)  # its weight, 2 s
    with pytest.raises(SceneError, match="restitution"):
        load(find("rest_depth"), ["ball.ball.restitution=1.01"])


def part(mass: float) -> Check:
    def check(_: Scene, truth: Trajectory) -> None:
        right = [(mass - 0.5) * 4.0 / (mass + 1.0), 1.5 * mass * 4.0 / (mass + 1.0)]
        assert truth.velocity[-1, :, 0] == pytest.approx(right, rel=1e-15, abs=1e-15)  # a rounding

    return check


def square(_: Scene, truth: Trajectory) -> None:
    one, other = truth.velocity[-1]
    assert abs(float(one @ other)) < 1e-15  # a rounding
    assert [np.hypot(*one), np.hypot(*other)] == pytest.approx([0.5, math.sqrt(0.75)], rel=1e-14)  # a grazing root


def passed_on(count: int) -> Check:
    def check(_: Scene, truth: Trajectory) -> None:
        assert truth.velocity[-1, :, 0] == pytest.approx([0.0] * (5 - count) + [1.0] * count, abs=1e-15)  # a rounding

    return check


def slides(_: Scene, truth: Trajectory) -> None:
    assert way(truth) == pytest.approx(0.5 * G * (SIN - 0.3 * COS) * truth.time**2, abs=1e-14)  # of 5 m


def stops(_: Scene, truth: Trajectory) -> None:
    assert truth.position[-1, 0, 0] == pytest.approx(2.5484, abs=5e-5)  # the digits given
    stopped = truth.time[np.flatnonzero(truth.velocity[:, 0, 0] == 0.0)[0]]
    assert stopped == pytest.approx(1.01937, abs=1e-3)  # a frame
    assert truth.velocity[-1].tolist() == [[0.0, 0.0]]


def rolls(_: Scene, truth: Trajectory) -> None:
    a = 2.0 / 3.0 * G * SIN
    assert way(truth) == pytest.approx(0.5 * a * truth.time**2, abs=1e-14)  # of 6.5 m
    assert truth.angular_velocity[-1, 0] == pytest.approx(-13.08, abs=1e-13)  # roundings


def slips(_: Scene, truth: Trajectory) -> None:
    # Just below μ = tanθ/3, where it still slips.
    assert way(truth) == pytest.approx(0.5 * G * (SIN - 0.192 * COS) * truth.time**2, abs=1e-14)  # of 6.5 m
    assert abs(truth.angular_velocity[-1, 0]) * 0.5 < np.hypot(*truth.velocity[-1, 0])


def slips_then_rolls(_: Scene, truth: Trajectory) -> None:
    slip = truth.velocity[:, 0, 0] + 0.3 * truth.angular_velocity[:, 0]
    first = truth.time[np.flatnonzero(slip == 0.0)[0]]
    assert 0.0 <= first - 3.0 / (3.0 * 0.2 * G) < 1e-3  # a frame
    assert truth.velocity[-1, 0].tolist() == pytest.approx([2.0, 0.0], rel=1e-15)  # ⅔ of 3 m/s


def bears(count: int, mass: float) -> Check:
    def check(scene: Scene, truth: Trajectory) -> None:
        still(scene, truth)
        down = truth.contact_impulse[(truth.contact_pair == -1).any(axis=1)]
        assert down == pytest.approx(np.array([[0.0, -count * mass * G * scene.world.duration]]), rel=1e-13)  # 20 sums

    return check


def hangs(_: Scene, truth: Trajectory) -> None:
    rods = np.hypot(*np.moveaxis(np.diff(truth.position, axis=1), 2, 0))
    assert rods == pytest.approx(0.1, abs=1e-5)  # a tenth of the tolerance to which it is refined
    assert truth.position[-1, 10:, 0].max() < truth.position[0, 10:, 0].max()  # it falls


def hits(_: Scene, truth: Trajectory) -> None:
    assert truth.contact_time.tolist() == pytest.approx([(1.0 - 0.02 - 0.05) / 100.0], rel=1e-14)  # roundings
    assert truth.velocity[-1].tolist() == [[-50.0, 0.0]]


def conserves(scene: Scene, truth: Trajectory) -> None:
    kinetic, mass = energies(truth, scene).kinetic, scene.bodies.mass
    assert (np.diff(kinetic) <= 1e-12 * kinetic[0]).all()  # roundings of one impact or a few
    if not scene.planes:
        momentum = np.einsum("n,tnk->tk", mass, truth.velocity)
        assert momentum - momentum[0] == pytest.approx(0.0, abs=1e-14)  # of 0.85 kg m/s
    else:
        assert kinetic == pytest.approx(np.full(len(kinetic), kinetic[0]), rel=1e-11)  # e = 1: thousands of roundings
    numbers = np.triu_indices(len(mass), 1)
    for frame in truth.position[::10]:
        apart = np.hypot(*(frame[numbers[0]] - frame[numbers[1]]).T)
        assert apart.min() >= 2.0 * scene.bodies.radius[0] - 1e-12  # no overlap but by rounding


SHORT = ("world.duration=0.1",)

CASES = (
    Case(1, "projectile", "closed_form", thrown),
    Case(2, "spring", "closed_form", swings(2.0 * math.pi, 1.0)),
    Case(3, "stiff_spring", "closed_form", swings(1990.0, 10.0)),
    Case(3, "stiff_spring_beyond", "closed_form", swings(2010.0, 10.0)),
    *(pendulum(degrees) for degrees in PERIODS),
    Case(5, "double_pendulum", "refined", double, SHORT),
    Case(6, "kepler", "closed_form", orbit, (f"world.duration={2 * math.pi!r}", f"solver.dt={2 * math.pi / 100!r}")),
    Case(7, "bounce_to_rest", "closed_form", bounces),
    Case(8, "elastic_ball", "closed_form", keeps_energy),
    Case(9, "rest_depth", "closed_form", rests),
    *(Case(10, "two_balls", "closed_form", part(mass), (f"ball.heavy.mass={mass!r}",)) for mass in (3.0, 1e-12, 1e12)),
    Case(11, "oblique", "closed_form", square),
    Case(12, "newtons_cradle", "closed_form", passed_on(1)),
    Case(12, "newtons_cradle", "closed_form", passed_on(2), ("ball.b.velocity=[1.0, 0.0]",)),
    Case(13, "box_sticks", "closed_form", still),
    Case(13, "box_slides", "closed_form", slides),
    Case(14, "slide_to_stop", "closed_form", stops),
    Case(15, "incline", "closed_form", rolls),
    Case(15, "incline", "closed_form", slips, ("plane.slope.friction=0.192",)),
    Case(15, "slide_to_roll", "closed_form", slips_then_rolls),
    Case(16, "tower", "closed_form", bears(20, 1.0)),
    Case(16, "pyramid", "closed_form", still),
    *(
        Case(17, "heavy_on_light", "closed_form", bears(1, 1.0 + mass), (f"box.heavy.mass={mass!r}",))
        for mass in (10.0, 100.0, 1e4)
    ),
    Case(18, "chain_of_20", "refined", hangs, SHORT),
    Case(19, "bullet", "exact", hits),
    Case(20, "break_shot", "exact", conserves),
    Case(20, "gas", "exact", conserves, ("world.duration=12.0", "solver.dt=0.02")),
)


def truth_for(case: Case) -> tuple[Scene, Truth]:
    scene = load(find(case.scene), case.overrides)
    truth = truth_of(scene, scene.solver, default_tolerance(scene))
    assert truth is not None
    return scene, truth


def test_every_case_has_a_scene() -> None:
    assert sorted({case.number for case in CASES}) == list(range(1, 21))


@pytest.mark.parametrize("case", CASES, ids=[f"{c.number}-{c.scene}-{k}" for k, c in enumerate(CASES)])
def test_truth_has_the_figures_that_are_known(case: Case) -> None:
    scene, truth = truth_for(case)
    assert truth.kind == case.kind
    case.check(scene, truth.trajectory)
    # What 225 balls do after some seconds hangs on the last digits of their start; all else is known to its end.
    assert (truth.trusted_until < scene.world.duration) == (case.scene == "gas")
