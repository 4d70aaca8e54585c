"""Coils throw unevenly, by the seed alone."""

from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Move
from sandbox.games.pinball.devices import CoilVariation
from tests.games.pinball.pinball_by_hand import thrown


@given(st.integers(0, 2**63 - 1), st.floats(-5.0, 5.0), st.floats(0.1, 5.0))
def test_throw_is_along_the_stated_velocity_and_never_faster(seed: int, x: float, y: float) -> None:
    velocity = CoilVariation(seed, 0).throw((x, y))
    assert thrown(Move(time=0.0, body="a", position=(0.0, 0.0), velocity=velocity), (x, y))


def test_coils_have_chances_of_their_own() -> None:
    throws = {(seed, stream): CoilVariation(seed, stream).throw((0.0, 1.0)) for seed in (1, 2) for stream in (0, 1)}
    assert len(set(throws.values())) == 4
    assert CoilVariation(1, 0).throw((0.0, 1.0)) == throws[1, 0]
