"""Bodies that attract each other: the figure of eight returns, and momentum is kept."""

import numpy as np
import pytest

import sandbox

PERIOD = 6.32591398  # s, for G = m = 1: C. Simó, Contemp. Math. 292 (2002) 209


@pytest.mark.parametrize(
    ("engine", "settings", "error"),
    [
        # m after two periods at 2 ms: order 1 for explicit steps with drift by the old velocity, then 2, then 4
        ("pymunk", {}, 6e-3),
        ("box2d", {}, 6e-3),
        ("reference", {"integrator": "velocity_verlet"}, 5e-5),
        ("reference", {"integrator": "rk4"}, 2e-7),
    ],
    ids=str,
)
@pytest.mark.fail_slow(60)  # kernels compile
def test_figure_of_eight_returns_to_its_start(engine: str, settings: dict[str, str], error: float) -> None:
    scene = sandbox.load("figure_eight")
    assert scene.world.duration == pytest.approx(2.0 * PERIOD, rel=1e-9)
    run = sandbox.run(scene, engine, **settings)
    end = run.position[-1] + (2.0 * PERIOD - run.time[-1]) * run.velocity[-1]  # whole steps end beyond the duration
    assert np.abs(end - run.position[0]).max() < error
    # each pair pulls equally on both; kg·m/s, rounding of 32 bits for box2d
    momentum = run.velocity.sum(axis=1)
    assert np.abs(momentum - momentum[0]).max() < (1e-4 if engine == "box2d" else 1e-10)


def test_bodies_change_places_after_a_third_of_the_period() -> None:
    """All three follow one curve: each is where another one was a third of the period before."""
    scene = sandbox.load("figure_eight").with_duration(PERIOD / 3.0)
    run = sandbox.run(scene, "reference", integrator="rk4", dt=PERIOD / 3000.0)
    places = run.position[-1][[1, 2, 0]], run.position[-1][[2, 0, 1]]
    assert min(np.abs(each - run.position[0]).max() for each in places) < 1e-6  # m, digits of the start values
