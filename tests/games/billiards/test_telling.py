"""Shot events: contacts of an engine converted to named events."""

import numpy as np

from sandbox.games.billiards.referee import shot_events, touching_pairs
from sandbox.games.billiards.rules.base import BallEvent
from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.trajectory import Contacts
from tests.games.billiards.tables_by_hand import match_with_balls_at, table

POOL = TableGeometry.of(table("9-ball"))
FIXED = POOL.scene.fixed_names


def contacts(*rows: tuple[float, int, int]) -> Contacts:
    none = np.zeros((len(rows), 2))
    times, pairs = np.array([row[0] for row in rows]), np.array([row[1:] for row in rows]).reshape(-1, 2)
    return Contacts(times, pairs, none, none, none)


def test_balls_cushions_jaws_and_pockets_are_named() -> None:
    jaw, pocket = FIXED.index("right pocket jaw 1"), FIXED.index("right pocket")
    events = shot_events(POOL, contacts((3.0, 0, 1), (3.1, 1, -1), (3.2, 1, -1 - jaw), (3.3, 1, -1 - pocket)), 2.5)
    assert events == (
        BallEvent(0.5, "cue", "ball", "1"),
        BallEvent(3.1 - 2.5, "1", "cushion", FIXED[0]),
        BallEvent(3.2 - 2.5, "1", "cushion", "right pocket jaw 1"),
        BallEvent(3.3 - 2.5, "1", "pocket", "right pocket"),
    )


def test_contacts_before_the_stroke_are_left_out() -> None:
    assert shot_events(POOL, contacts((2.0, 0, -1)), 2.5) == ()


def test_initial_contacts_count_only_after_separation() -> None:
    touching = frozenset({(0, 1), (2, -1)})
    rows = contacts((0.0, 0, 1), (1e-4, 2, -1), (0.0, 0, 3), (0.3, 0, 2), (0.7, 2, -1), (0.8, 0, 1))
    events = shot_events(POOL, rows, 0.0, touching)
    expected = [("cue", "3"), ("cue", "2"), ("2", FIXED[0]), ("cue", "1")]
    assert [(each.ball, each.other) for each in events] == expected


def test_ball_frozen_to_a_cushion_and_pressed_into_it_is_not_driven_to_it() -> None:
    touching = frozenset({(2, -1), (2, 3), (3, -2)})  # the 2 and the 3 touch each other and one cushion each
    rows = contacts((0.659, 0, 2), (0.6591, 2, -1), (0.66, 3, -2), (0.9, 3, -2), (0.95, 2, -2), (1.2, 2, -1))
    events = shot_events(POOL, rows, 0.0, touching, "cue")
    driven = [(each.time, each.ball) for each in events if each.kind == "cushion"]
    assert driven == [(0.9, "3"), (0.95, "2"), (1.2, "2")]


def test_struck_ball_frozen_to_a_cushion_counts_after_it_returns() -> None:
    rows = contacts((1e-3, 0, -1), (0.4, 0, 1), (0.402, 0, -1))
    events = shot_events(POOL, rows, 0.0, frozenset({(0, -1)}), "cue")
    assert [each.kind for each in events] == ["ball", "cushion"]


def test_touching_balls_cushions_and_jaws_are_found() -> None:
    radius = POOL.radius[0]
    post = POOL.scene.posts[0]
    by_jaw = (post.position[0] + 0.6 * (post.radius + radius), post.position[1] + 0.8 * (post.radius + radius))
    match = match_with_balls_at(
        "9-ball",
        {"1": (0.5, 1.0), "2": (0.5 + 2.0 * radius, 1.0), "3": (0.5, 1.0 + 2.0 * radius + 1e-5),
         "4": (0.6, radius), "5": by_jaw},
    )  # fmt: skip
    number = match.layout.number
    lower, jaw = FIXED.index("lower cushion"), len(POOL.scene.walls)
    expected = {(number["1"], number["2"]), (number["4"], -1 - lower), (number["5"], -1 - jaw)}
    found = touching_pairs(POOL, match.position)
    assert expected <= found
    assert not any(number["3"] in pair for pair in found)  # 1e-5 m apart, ten times the tolerance of touching
