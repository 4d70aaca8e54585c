"""Situation of the cue ball, and contacts of an engine converted to named events of a shot."""

import numpy as np

from sandbox.games.billiards.referee import shot_events, situation_of, touching_pairs
from sandbox.games.billiards.rules.base import BallEvent, Situation
from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.trajectory import Contacts
from tests.games.billiards.tables_by_hand import match_with_balls_at, table

R = 0.025
CUE = (0.0, 0.0, R)
RED = {"red": (0.0, 1.0, R)}
ON = frozenset({"red"})


def situation_with(**others: tuple[float, float]) -> Situation:
    return situation_of([CUE], RED | {name: (*at, R) for name, at in others.items()}, ON, placed=False)


def test_open_path_is_no_snooker() -> None:
    assert situation_with() == Situation()
    assert situation_with(blue=(0.2, 0.5)) == Situation()
    assert situation_with(blue=(0.0, 1.2)) == Situation()  # behind the target


def test_ball_in_the_path_to_one_edge_snookers() -> None:
    assert situation_with(blue=(0.0, 0.5)) == Situation(snookered=True, by=("blue",))
    # The path to the left edge of the target passes R to the left of the centre line at half the distance.
    # A ball blocks it up to 2 R from that path: 2.9 R to the left it does, 3.1 R to the left it does not.
    assert situation_with(blue=(-2.9 * R, 0.5)) == Situation(snookered=True, by=("blue",))
    assert situation_with(blue=(-3.1 * R, 0.5)) == Situation()


def test_nearest_of_several_blocking_balls_is_reported() -> None:
    assert situation_with(pink=(0.0, 0.7), blue=(0.01, 0.4)).by == ("blue",)


def test_balls_on_do_not_snooker_and_one_open_path_is_enough() -> None:
    others = {"red": (0.0, 1.0, R), "near": (0.0, 0.5, R), "blue": (0.5, 0.5, R)}
    assert situation_of([CUE], others, frozenset({"red", "near"}), placed=False) == Situation()


def test_different_blocking_balls_are_not_reported() -> None:
    others = {"one": (0.0, 1.0, R), "two": (1.0, 0.0, R), "blue": (0.0, 0.5, R), "pink": (0.5, 0.0, R)}
    assert situation_of([CUE], others, frozenset({"one", "two"}), placed=False) == Situation(snookered=True)


def test_touching_balls_are_reported_and_touching_is_no_snooker() -> None:
    touched = {"red": (0.0, 2.0 * R, R), "blue": (0.0, -2.0 * R, R)}
    assert situation_of([CUE], touched, ON, placed=False) == Situation(touching=("red", "blue"))
    assert situation_of([CUE], touched, frozenset({"none"}), placed=False) == Situation(touching=("red", "blue"))


def test_ball_in_hand_is_snookered_only_from_every_position() -> None:
    others = RED | {"blue": (0.0, 0.5, R)}
    assert situation_of([CUE, (0.5, 0.0, R)], others, ON, placed=True) == Situation()
    assert situation_of([CUE, (0.01, 0.0, R)], others, ON, placed=True).snookered
    assert situation_of([], others, ON, placed=True) == Situation()


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


def test_visits_of_sensors_are_no_events() -> None:
    """Their indices follow those of the pockets."""
    rows = contacts((3.0, 0, 1), (3.1, 0, -1 - len(FIXED)), (3.2, 1, -2 - len(FIXED)))
    assert [each.kind for each in shot_events(POOL, rows, 2.5)] == ["ball"]


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
