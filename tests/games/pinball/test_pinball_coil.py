"""Coils vary the launch velocity, by the seed only."""

from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Move
from sandbox.games.pinball.devices import CoilVariation
from tests.games.pinball.pinball_by_hand import is_launch


@given(st.integers(0, 2**63 - 1), st.floats(-5.0, 5.0), st.floats(0.1, 5.0))
def test_launch_is_along_the_stated_velocity_and_never_faster(seed: int, x: float, y: float) -> None:
    velocity = CoilVariation(seed, 0).throw((x, y))
    assert is_launch(Move(time=0.0, body="a", position=(0.0, 0.0), velocity=velocity), (x, y))


def test_coils_have_independent_random_streams() -> None:
    velocities = {(seed, stream): CoilVariation(seed, stream).throw((0.0, 1.0)) for seed in (1, 2) for stream in (0, 1)}
    assert len(set(velocities.values())) == 4
    assert CoilVariation(1, 0).throw((0.0, 1.0)) == velocities[1, 0]
