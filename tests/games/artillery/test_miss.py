"""The table of misses: closed forms where there are, the order of each integrator, and refusals."""

import math

import numpy as np
import pytest

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Refusal
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.games.artillery import landing_error as miss
from sandbox.games.artillery.ballistics import ShellImpact
from sandbox.games.artillery.landing_error import landing_error_table
from sandbox.scene.description.world import Settings, World
from tests.games.artillery.grounds import G, world

DTS = 0.1, 0.05, 0.025


def test_euler_misses_by_one_step_in_vacuum() -> None:
    """Explicit Euler's heights are those of v_y + g h/2, so that it flies h too long, and v_x h too far."""
    found = landing_error_table(world(), 50.0, math.radians(45.0), DTS)
    far = 50.0 * math.cos(math.radians(45.0))
    for row in found.rows:
        sign = {"explicit_euler": 1.0, "semi_implicit_euler": -1.0, None: 1.0 if row.engine == "pymunk" else 0.0}
        sign |= dict.fromkeys(("velocity_verlet", "leapfrog", "rk4"), 0.0)
        # The cubic through two frames takes Euler's velocities, g h/2 off its way: that is 4/27 of h g h/2 at most.
        euler = sign[row.integrator] != 0.0
        reach = 2.0 * 4.0 / 27.0 * 0.5 * G * row.dt**2 / far if euler else 1e-11
        assert row.late == pytest.approx(sign[row.integrator] * row.dt, abs=reach)
        assert row.off == pytest.approx(sign[row.integrator] * row.dt * far, abs=far * reach)
    assert found.range == pytest.approx(2500.0 / G, abs=1e-9)
    assert not found.refused


@pytest.mark.parametrize("drags", [(0.2, 0.0), (0.0, 0.01)])
def test_misses_fall_with_each_integrators_order(drags: tuple[float, float]) -> None:
    dts = tuple(0.2 * 2.0 ** (-k / 2) for k in range(7))
    found = landing_error_table(world(*drags, -8.0), 50.0, math.radians(45.0), dts)
    for name, integrator in INTEGRATORS.items():
        offs = [abs(row.off) for row in found.rows if row.integrator == name]
        slope = np.polyfit(np.log(dts), np.log(offs), 1)[0]
        # Where in the last step it comes down differs, and with it the cubic's share of the error.
        assert slope == pytest.approx(integrator.order, abs=0.35)
    assert {engine for engine, _ in found.refused} == {"exact"}


def test_what_never_comes_down_is_told() -> None:
    rising = world().model_copy(update={"gravity": (0.0, 0.0)})
    with pytest.raises(ValueError, match="does not come down within"):
        landing_error_table(rising, 50.0, 1.0, (0.1,))


def test_refusal_of_one_integrator_leaves_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    def fly(world: World, velocity: FloatArray, engine: str, settings: Settings) -> ShellImpact:
        if settings.integrator == "rk4" or engine == "exact":
            raise Refusal(engine, ("not this one",), ())
        return ShellImpact(1.0, (1.0, 0.0))

    monkeypatch.setattr(miss, "simulated_landing", fly)
    found = landing_error_table(world(), 50.0, math.radians(45.0), DTS)
    assert {row.integrator for row in found.rows} == {*INTEGRATORS, None} - {"rk4"}
    assert [engine for engine, _ in found.refused].count("exact") == 1
