"""Switches: contacts that count as hits, by their speed of approach; coils: launches that vary by the seed only."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Move
from sandbox.games.contract import StepInfo
from sandbox.games.pinball.devices import CoilVariation
from sandbox.games.pinball.events import Switches
from sandbox.games.pinball.playfield import Playfield
from tests.games.pinball.pinball_by_hand import MASS, Table, contacts, is_launch, table

SCENE = table()
BOARD = Playfield.of(SCENE, SCENE.bodies)
FRAME = Table(SCENE).frame()


def index_of(name: str) -> int:
    return -1 - SCENE.fixed_names.index(name)


def hit_names(switches: Switches, *rows: tuple[float, tuple[int, int], float]) -> list[str]:
    return [hit.element.name for hit in switches.read(StepInfo(0.0, FRAME, contacts(rows), ()))]


@pytest.mark.parametrize(("name", "threshold"), [("bumper a", 0.054), ("sling", 0.054), ("standup 1", 0.108)])
@given(factor=st.floats(0.1, 10.0))
def test_switch_closes_above_its_threshold_of_approach(name: str, threshold: float, factor: float) -> None:
    if abs(factor - 1.0) < 1e-9:
        factor = 2.0  # at the threshold itself rounding decides
    impulse = MASS * (1.0 + 0.5) * threshold * factor  # m(1 + e)v
    assert hit_names(Switches(BOARD), (0.0, (0, index_of(name)), impulse)) == ([name] if factor > 1.0 else [])


def test_threshold_depends_on_kick_and_falloff_of_the_element() -> None:
    scene = table().model_copy(update={"posts": tuple(_kicking(post) for post in table().posts)})
    board = Playfield.of(scene, scene.bodies)
    bumper = next(each for each in board.elements if each.name == "bumper a")
    assert bumper.min_closing_speed == pytest.approx(
        0.2 * (1.0 + 0.5 / (1.0 + 3.0 * 0.2)), rel=1e-15
    )  # rounding of three factors


def _kicking(post):
    from sandbox.scene.description.world import Kick

    return post.model_copy(update={"kick": Kick(speed=0.8, threshold=0.2), "restitution_falloff": 3.0})


def test_persistent_contact_is_one_hit() -> None:
    switches, row = Switches(BOARD), (0.5, (0, index_of("bumper a")), 1.0)
    assert hit_names(switches, row) == ["bumper a"]
    assert hit_names(switches, row) == []
    assert hit_names(switches, (0.7, *row[1:])) == ["bumper a"]


def test_impulse_over_two_steps_counts_but_resting_contact_does_not() -> None:
    least = MASS * 1.5 * 0.054
    switches, half = Switches(BOARD), (0.5, (0, index_of("bumper a")), 0.6 * least)
    assert hit_names(switches, half) == []
    assert hit_names(switches, half) == ["bumper a"]
    leaning = (0.9, (0, index_of("bumper a")), 0.3 * least)
    assert [hit_names(switches, leaning) for _ in range(20)] == [[]] * 20


def test_zones_close_without_impulse() -> None:
    assert hit_names(Switches(BOARD), (0.0, (0, index_of("lane 1")), 0.0)) == ["lane 1"]


def test_elements_without_a_part_are_no_switches() -> None:
    switches = Switches(BOARD)
    assert hit_names(switches, (0.0, (0, index_of("frame")), 1.0), (0.0, (0, 1), 1.0)) == []


@given(st.integers(0, 2**63 - 1), st.floats(-5.0, 5.0), st.floats(0.1, 5.0))
def test_launch_is_along_the_stated_velocity_and_never_faster(seed: int, x: float, y: float) -> None:
    velocity = CoilVariation(seed, 0).throw((x, y))
    assert is_launch(Move(time=0.0, body="a", position=(0.0, 0.0), velocity=velocity), (x, y))


def test_coils_have_independent_random_streams() -> None:
    velocities = {(seed, stream): CoilVariation(seed, stream).throw((0.0, 1.0)) for seed in (1, 2) for stream in (0, 1)}
    assert len(set(velocities.values())) == 4
    assert CoilVariation(1, 0).throw((0.0, 1.0)) == velocities[1, 0]
