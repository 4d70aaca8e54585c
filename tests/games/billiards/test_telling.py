"""Telling: contacts of engines as happenings by names."""

import numpy as np

from sandbox.games.billiards.referee import shot_events, touching_pairs
from sandbox.games.billiards.rules.base import BallEvent
from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.trajectory import Contacts
from tests.games.billiards.tables_by_hand import lying, table

POOL = TableGeometry.of(table("9-ball"))
FIXED = POOL.scene.fixed_names


def contacts(*rows: tuple[float, int, int]) -> Contacts:
    none = np.zeros((len(rows), 2))
    times, pairs = np.array([row[0] for row in rows]), np.array([row[1:] for row in rows]).reshape(-1, 2)
    return Contacts(times, pairs, none, none, none)


def test_balls_cushions_jaws_and_pockets_are_named() -> None:
    jaw, pocket = FIXED.index("right pocket jaw 1"), FIXED.index("right pocket")
    told = shot_events(POOL, contacts((3.0, 0, 1), (3.1, 1, -1), (3.2, 1, -1 - jaw), (3.3, 1, -1 - pocket)), 2.5)
    assert told == (
        BallEvent(0.5, "cue", "ball", "1"),
        BallEvent(3.1 - 2.5, "1", "cushion", FIXED[0]),
        BallEvent(3.2 - 2.5, "1", "cushion", "right pocket jaw 1"),
        BallEvent(3.3 - 2.5, "1", "pocket", "right pocket"),
    )


def test_what_began_before_the_stroke_is_left_out() -> None:
    assert shot_events(POOL, contacts((2.0, 0, -1)), 2.5) == ()


def test_what_touches_from_the_start_counts_once_it_was_left() -> None:
    against = frozenset({(0, 1), (2, -1)})
    rows = contacts((0.0, 0, 1), (1e-4, 2, -1), (0.0, 0, 3), (0.3, 0, 2), (0.7, 2, -1), (0.8, 0, 1))
    told = shot_events(POOL, rows, 0.0, against)
    expected = [("cue", "3"), ("cue", "2"), ("2", FIXED[0]), ("cue", "1")]
    assert [(each.ball, each.other) for each in told] == expected


def test_ball_frozen_to_a_cushion_and_pressed_into_it_is_not_driven_there() -> None:
    against = frozenset({(2, -1), (2, 3), (3, -2)})  # the 2 and the 3 touch each other, and a cushion each
    rows = contacts((0.659, 0, 2), (0.6591, 2, -1), (0.66, 3, -2), (0.9, 3, -2), (0.95, 2, -2), (1.2, 2, -1))
    told = shot_events(POOL, rows, 0.0, against, "cue")
    assert [(each.time, each.ball) for each in told if each.kind == "cushion"] == [(0.9, "3"), (0.95, "2"), (1.2, "2")]


def test_struck_ball_frozen_to_a_cushion_counts_there_once_it_comes_back() -> None:
    rows = contacts((1e-3, 0, -1), (0.4, 0, 1), (0.402, 0, -1))
    told = shot_events(POOL, rows, 0.0, frozenset({(0, -1)}), "cue")
    assert [each.kind for each in told] == ["ball", "cushion"]


def test_touching_balls_cushions_and_jaws_are_found() -> None:
    radius = POOL.radius[0]
    post = POOL.scene.posts[0]
    by_jaw = (post.position[0] + 0.6 * (post.radius + radius), post.position[1] + 0.8 * (post.radius + radius))
    match = lying(
        "9-ball",
        {"1": (0.5, 1.0), "2": (0.5 + 2.0 * radius, 1.0), "3": (0.5, 1.0 + 2.0 * radius + 1e-5),
         "4": (0.6, radius), "5": by_jaw},
    )  # fmt: skip
    number = match.layout.number
    lower, jaw = FIXED.index("lower cushion"), len(POOL.scene.walls)
    expected = {(number["1"], number["2"]), (number["4"], -1 - lower), (number["5"], -1 - jaw)}
    found = touching_pairs(POOL, match.position)
    assert expected <= found
    assert not any(number["3"] in pair for pair in found)  # 1e-5 m apart, ten times what counts as touching
