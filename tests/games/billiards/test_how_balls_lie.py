"""Lying: what touches, and what is snookered."""

from sandbox.games.billiards.referee import situation_of
from sandbox.games.billiards.rules.base import Situation

R = 0.025
CUE = (0.0, 0.0, R)
RED = {"red": (0.0, 1.0, R)}
ON = frozenset({"red"})


def lie(**others: tuple[float, float]) -> Situation:
    return situation_of([CUE], RED | {name: (*at, R) for name, at in others.items()}, ON, placed=False)


def test_open_way_is_no_snooker() -> None:
    assert lie() == Situation()
    assert lie(blue=(0.2, 0.5)) == Situation()
    assert lie(blue=(0.0, 1.2)) == Situation()  # behind the target


def test_ball_in_the_way_of_one_edge_snookers() -> None:
    assert lie(blue=(0.0, 0.5)) == Situation(snookered=True, by=("blue",))
    # The way to the left edge passes 0.5·2R to the left at half the way: a ball 2.9 R beside that covers none of it.
    assert lie(blue=(-2.9 * R, 0.5)) == Situation(snookered=True, by=("blue",))
    assert lie(blue=(-3.1 * R, 0.5)) == Situation()


def test_nearest_of_several_in_the_way_is_the_one() -> None:
    assert lie(pink=(0.0, 0.7), blue=(0.01, 0.4)).by == ("blue",)


def test_balls_on_hide_nothing_and_one_that_is_free_is_enough() -> None:
    others = {"red": (0.0, 1.0, R), "near": (0.0, 0.5, R), "blue": (0.5, 0.5, R)}
    assert situation_of([CUE], others, frozenset({"red", "near"}), placed=False) == Situation()


def test_different_balls_in_the_ways_are_none_that_snookers() -> None:
    others = {"one": (0.0, 1.0, R), "two": (1.0, 0.0, R), "blue": (0.0, 0.5, R), "pink": (0.5, 0.0, R)}
    assert situation_of([CUE], others, frozenset({"one", "two"}), placed=False) == Situation(snookered=True)


def test_ball_that_touches_is_told_and_frees_if_it_is_on() -> None:
    touched = {"red": (0.0, 2.0 * R, R), "blue": (0.0, -2.0 * R, R)}
    assert situation_of([CUE], touched, ON, placed=False) == Situation(touching=("red", "blue"))
    assert situation_of([CUE], touched, frozenset({"none"}), placed=False) == Situation(touching=("red", "blue"))


def test_ball_in_hand_is_snookered_only_from_everywhere() -> None:
    others = RED | {"blue": (0.0, 0.5, R)}
    assert situation_of([CUE, (0.5, 0.0, R)], others, ON, placed=True) == Situation()
    assert situation_of([CUE, (0.01, 0.0, R)], others, ON, placed=True).snookered
    assert situation_of([], others, ON, placed=True) == Situation()
