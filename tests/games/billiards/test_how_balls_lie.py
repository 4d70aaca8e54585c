"""Situation of the cue ball: touching balls and snookers."""

from sandbox.games.billiards.referee import situation_of
from sandbox.games.billiards.rules.base import Situation

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
