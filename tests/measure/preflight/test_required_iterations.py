"""Settings that give the iterations per second that stacks, joints and unequal masses need."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.preflight import run_preflight
from sandbox.measure.preflight.diagnostic import required_iterations
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import loads

CHAIN = """
[world]
gravity = [0, -9.81]
[solver]
dt = 0.02
iterations = 5
[[rope]]
start = [0, 0]
end = [12, 0]
links = 24
fix = ["start"]
"""


@given(st.floats(1.0, 1e6), st.floats(1e-4, 0.1), st.integers(1, 20), st.integers(1, 100))
def test_each_of_both_reaches_the_required_rate(needed: float, dt: float, substeps: int, iterations: int) -> None:
    settings = Settings(dt=dt, substeps=substeps, iterations=iterations)
    more, shorter = required_iterations(needed, settings)
    assert more / settings.h >= needed * (1.0 - 1e-6)  # a margin for rounding
    assert iterations / (shorter / substeps) == pytest.approx(needed)


def test_advised_dt_of_a_chain_is_enough_and_not_much_too_short() -> None:
    scene = loads(CHAIN)
    (found,) = [each for each in run_preflight(scene, cover=0).warnings if each.kind == "chain"]
    dt = float(found.details["safe_dt"])

    def kinds(factor: float) -> set[str]:
        varied = loads(CHAIN.replace("dt = 0.02", f"dt = {factor * dt}"))
        return {each.kind for each in run_preflight(varied, cover=0).warnings}

    assert "chain" not in kinds(0.999)
    assert "chain" in kinds(1.2)
