"""The table of misses: closed forms where there are, the order of each integrator, and refusals."""

import math

import pytest
from grounds import G, world

from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.games.artillery.miss import miss_table

DTS = 0.1, 0.05, 0.025


def test_euler_misses_by_one_step_in_vacuum() -> None:
    """Explicit Euler's heights are those of v_y + g h/2, so that it flies h too long, and v_x h too far."""
    found = miss_table(world(), 50.0, math.radians(45.0), DTS)
    far = 50.0 * math.cos(math.radians(45.0))
    for row in found.rows:
        sign = {"explicit_euler": 1.0, "semi_implicit_euler": -1.0, None: 1.0 if row.engine == "pymunk" else 0.0}
        assert row.late == pytest.approx(sign.get(row.integrator, 0.0) * row.dt, abs=1e-9)  # rounding of the frames
        assert row.off == pytest.approx(sign.get(row.integrator, 0.0) * row.dt * far, abs=1e-8)
    assert found.range == pytest.approx(2500.0 / G, abs=1e-9)
    assert not found.refused


@pytest.mark.parametrize("drags", [(0.2, 0.0), (0.0, 0.01)])
def test_misses_fall_with_each_integrators_order(drags: tuple[float, float]) -> None:
    found = miss_table(world(*drags, -8.0), 50.0, math.radians(45.0), DTS)
    for name, integrator in INTEGRATORS.items():
        offs = [abs(row.off) for row in found.rows if row.integrator == name]
        slopes = [math.log2(a / b) for a, b in zip(offs, offs[1:], strict=False)]
        assert slopes[-1] == pytest.approx(integrator.order, abs=0.25)  # of the second halving, at steps of 50 ms
    assert {engine for engine, _ in found.refused} == {"exact"}


def test_what_never_comes_down_is_told() -> None:
    rising = world().model_copy(update={"gravity": (0.0, 0.0)})
    with pytest.raises(ValueError, match="never comes down"):
        miss_table(rising, 50.0, 1.0, (0.1,))
