"""Table of landing errors: closed forms, the order of each integrator, and refusals."""

import math

import numpy as np
import pytest

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Refusal
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.games.artillery.ballistics import ShellImpact
from sandbox.measure import landing_error as miss
from sandbox.measure.landing_error import landing_error_table
from sandbox.scene.description.world import Settings, World
from tests.games.artillery.grounds import G, world

pytestmark = pytest.mark.fail_slow(60)  # long runs

DTS = 0.1, 0.05, 0.025


def test_euler_lands_one_step_late_or_early_in_vacuum() -> None:
    """The heights of explicit Euler are those of v_y + g h/2, so it flies h too long and v_x h too far."""
    found = landing_error_table(world(), 50.0, math.radians(45.0), DTS)
    vx = 50.0 * math.cos(math.radians(45.0))
    for row in found.rows:
        sign = {"explicit_euler": 1.0, "semi_implicit_euler": -1.0, None: 1.0 if row.engine == "pymunk" else 0.0}
        sign |= dict.fromkeys(("velocity_verlet", "leapfrog", "rk4"), 0.0)
        # The cubic through two frames uses Euler's velocities, off by g h/2: an error of at most 4/27 of h g h/2.
        euler = sign[row.integrator] != 0.0
        if row.engine == "box2d":
            assert row.time_error == pytest.approx(-row.dt, abs=1e-3)  # semi-implicit Euler; 32-bit numbers
            continue
        tolerance = 2.0 * 4.0 / 27.0 * 0.5 * G * row.dt**2 / vx if euler else 1e-11
        assert row.time_error == pytest.approx(sign[row.integrator] * row.dt, abs=tolerance)
        assert row.range_error == pytest.approx(sign[row.integrator] * row.dt * vx, abs=vx * tolerance)
    assert found.range == pytest.approx(2500.0 / G, abs=1e-9)
    assert not found.refused


@pytest.mark.parametrize(("drags", "damping"), [((0.2, 0.0), 1.0), ((0.0, 0.01), 1.0), ((0.0, 0.01), 0.8)])
def test_landing_errors_converge_with_the_order_of_each_integrator(drags: tuple[float, float], damping: float) -> None:
    dts = tuple(0.2 * 2.0 ** (-k / 2) for k in range(7))
    air = world(*drags, -8.0).model_copy(update={"damping": damping})
    found = landing_error_table(air, 50.0, math.radians(45.0), dts)
    for name, integrator in INTEGRATORS.items():
        errors = [abs(row.range_error) for row in found.rows if (row.engine, row.integrator) == ("reference", name)]
        slope = np.polyfit(np.log(dts), np.log(errors), 1)[0]
        # The landing point within the last step varies, and so does the contribution of the cubic to the error.
        assert slope == pytest.approx(integrator.order, abs=0.35)
    # pymunk: drag and damping together
    assert {engine for engine, _ in found.refused} == ({"exact"} if damping == 1.0 else {"exact", "pymunk"})


def test_shot_that_never_lands_is_refused() -> None:
    rising = world().model_copy(update={"gravity": (0.0, 0.0)})
    with pytest.raises(ValueError, match="does not come down within"):
        landing_error_table(rising, 50.0, 1.0, (0.1,))


def test_refusal_of_one_integrator_keeps_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    def fly(world: World, velocity: FloatArray, engine: str, settings: Settings) -> ShellImpact:
        if settings.integrator == "rk4" or engine == "exact":
            raise Refusal(engine, ("not this one",), ())
        return ShellImpact(1.0, (1.0, 0.0))

    monkeypatch.setattr(miss, "simulated_landing", fly)
    found = landing_error_table(world(), 50.0, math.radians(45.0), DTS)
    assert {row.integrator for row in found.rows} == {*INTEGRATORS, None} - {"rk4"}
    assert [engine for engine, _ in found.refused].count("exact") == 1
