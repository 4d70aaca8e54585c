"""Switches: which contacts are hits, and how hard they were."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.games.contract import StepInfo
from sandbox.games.pinball.events import Switches
from sandbox.games.pinball.playfield import Playfield
from tests.games.pinball.pinball_by_hand import MASS, Table, contacts, table

SCENE = table()
BOARD = Playfield.of(SCENE, SCENE.bodies)
FRAME = Table(SCENE).frame()


def number(name: str) -> int:
    return -1 - SCENE.fixed_names.index(name)


def names(switches: Switches, *rows: tuple[float, tuple[int, int], float]) -> list[str]:
    return [hit.element.name for hit in switches.read(StepInfo(0.0, FRAME, contacts(rows), ()))]


@pytest.mark.parametrize(("name", "threshold"), [("bumper a", 0.054), ("sling", 0.054), ("standup 1", 0.108)])
@given(share=st.floats(0.1, 10.0))
def test_switch_closes_above_its_threshold_of_approach(name: str, threshold: float, share: float) -> None:
    if abs(share - 1.0) < 1e-9:
        return
    given_ = MASS * (1.0 + 0.5) * threshold * share  # m(1 + e)v
    assert names(Switches(BOARD), (0.0, (0, number(name)), given_)) == ([name] if share > 1.0 else [])


def test_kick_and_falloff_of_the_thing_decide() -> None:
    scene = table().model_copy(update={"posts": tuple(_kicking(post) for post in table().posts)})
    board = Playfield.of(scene, scene.bodies)
    bumper = next(each for each in board.elements if each.name == "bumper a")
    assert bumper.least == pytest.approx(0.2 * (1.0 + 0.5 / (1.0 + 3.0 * 0.2)), rel=1e-15)  # rounding of three factors


def _kicking(post):
    from sandbox.scene.description.world import Kick

    return post.model_copy(update={"kick": Kick(speed=0.8, threshold=0.2), "restitution_falloff": 3.0})


def test_contact_that_lasts_is_one_hit() -> None:
    switches, row = Switches(BOARD), (0.5, (0, number("bumper a")), 1.0)
    assert names(switches, row) == ["bumper a"]
    assert names(switches, row) == []
    assert names(switches, (0.7, *row[1:])) == ["bumper a"]


def test_hit_whose_impulse_spans_two_steps_counts_but_leaning_does_not() -> None:
    least = MASS * 1.5 * 0.054
    switches, half = Switches(BOARD), (0.5, (0, number("bumper a")), 0.6 * least)
    assert names(switches, half) == []
    assert names(switches, half) == ["bumper a"]
    leaning = (0.9, (0, number("bumper a")), 0.3 * least)
    assert [names(switches, leaning) for _ in range(20)] == [[]] * 20


def test_zones_close_without_impulse() -> None:
    assert names(Switches(BOARD), (0.0, (0, number("lane 1")), 0.0)) == ["lane 1"]


def test_what_plays_no_part_is_no_switch() -> None:
    switches = Switches(BOARD)
    assert names(switches, (0.0, (0, number("frame")), 1.0), (0.0, (0, 1), 1.0)) == []
