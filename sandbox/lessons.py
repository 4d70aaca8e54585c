"""Exercises of the lessons: answers are checked, and usual mistakes are named.

    from sandbox.lessons import check

    check("bounce-3", 19.2)  # right
    check("bounce-3", 9.6)  # not right: half of the answer

The answers are computed from the formulas of the lessons. `exercises()` lists the questions.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

G = 9.81
"""m/s², gravity of the scenes"""
RIGHT = 0.005
"""Largest relative error of a right answer: three digits"""
NEAR = 0.05
"""Largest relative error of an answer that is nearly right"""
MISTAKES: Mapping[str, float] = {
    "the sign is wrong": -1.0,
    "it is twice the answer": 2.0,
    "it is half of the answer": 0.5,
    "it is four times the answer": 4.0,
    "it is a quarter of the answer": 0.25,
    "it looks like degrees in the place of radians": 180.0 / math.pi,
    "it looks like radians in the place of degrees": math.pi / 180.0,
    "it is π times the answer": math.pi,
    "it is the answer divided by π": 1.0 / math.pi,
    "it is 1,000 times the answer: look at the unit": 1e3,
    "it is the answer divided by 1,000: look at the unit": 1e-3,
    "it is 100 times the answer: look at the unit": 1e2,
    "it is the answer divided by 100: look at the unit": 1e-2,
}
"""Factors between a wrong answer and the right one; each mistake by what to say of it"""


@dataclass(frozen=True)
class Exercise:
    """Question of a lesson whose answer is a number."""

    question: str
    unit: str
    """"" for a count or a ratio"""
    answer: Callable[[], float] = field(repr=False)
    mistakes: Mapping[str, Callable[[], float]] = field(default_factory=dict, repr=False)
    """answers that a mistake of this exercise gives, by what to say of it"""
    is_count: bool = field(default=False, repr=False)
    """whether the answer is a whole number"""


@dataclass(frozen=True)
class MarkedAnswer:
    """Result of checking an answer."""

    result: Literal["right", "nearly", "wrong"]
    hint: str
    """kind of mistake; "" if the answer is right, or if the mistake is not known"""

    def __bool__(self) -> bool:
        return self.result == "right"

    def __repr__(self) -> str:
        words = {"right": "right", "nearly": "nearly right", "wrong": "not right"}
        return words[self.result] + (f": {self.hint}" if self.hint else "")


def _time_of_rest(restitution: float) -> float:
    """Return when a ball that falls 5 m has bounced infinitely often, s."""
    first = math.sqrt(2.0 * 5.0 / G)
    return first * (1.0 + restitution) / (1.0 - restitution)


def _first_overlap(new_velocity: bool) -> tuple[int, float]:
    """Return the first step of 0.01 s that ends in overlap, of a fall of 5 m by Euler's method, and the depth, m."""
    height, velocity, step, n = 5.0, 0.0, 0.01, 0
    while height >= 0.0:
        before, velocity, n = velocity, velocity - G * step, n + 1
        height += step * (velocity if new_velocity else before)
    return n, -height


def _largest_error(step: float) -> float:
    """Return the largest error of semi-implicit Euler in the first second of a swing of 0.1 m and 1 Hz, m."""
    position, velocity, largest = 0.1, 0.0, 0.0
    for n in range(1, round(1.0 / step) + 1):
        velocity -= step * 4.0 * math.pi**2 * position
        position += step * velocity
        largest = max(largest, abs(position - 0.1 * math.cos(2.0 * math.pi * n * step)))
    return largest


_EXERCISES: Mapping[str, Exercise] = {
    "loop-1": Exercise(
        "After how many steps of 0.01 s is the first contact found?",
        "",
        lambda: _first_overlap(new_velocity=False)[0],
        {"that is the number with the new velocity": lambda: _first_overlap(new_velocity=True)[0]},
        is_count=True,
    ),
    "loop-2": Exercise("How deep is the ball in the ground at that time?", "m", lambda: _first_overlap(False)[1]),
    "ball-1": Exercise(
        "Which error do you expect at dt = 0.02?",
        "m",
        lambda: 0.5 * G * 0.02 * 1.0,
        {"that is the error at dt = 0.01": lambda: 0.5 * G * 0.01},
    ),
    "ball-4": Exercise(
        "How many steps make the error after 1 s at most 1 mm?",
        "",
        lambda: round(0.5 * G * 1.0 / 1e-3),
        {"that is the step, in s": lambda: 1e-3 / (0.5 * G)},
        is_count=True,
    ),
    "bounce-1": Exercise(
        "How many bounces are higher than 1 mm?",
        "",
        lambda: math.floor(math.log(5.0 / 1e-3) / -math.log(0.8**2)),
        {
            "each bounce loses height by the factor e², not e": lambda: math.floor(math.log(5e3) / -math.log(0.8)),
        },
        is_count=True,
    ),
    "bounce-2": Exercise(
        "How long is the whole way of the ball, up and down?",
        "m",
        lambda: 5.0 + 2.0 * 5.0 * 0.64 / 0.36,
        {
            "each bounce goes up and down": lambda: 5.0 + 5.0 * 0.64 / 0.36,
            "the first fall goes down only": lambda: 10.0 / 0.36,
        },
    ),
    "bounce-3": Exercise(
        "When does the ball come to rest for e = 0.9?",
        "s",
        lambda: _time_of_rest(0.9),
        {
            "that is the time for e = 0.8": lambda: _time_of_rest(0.8),
            "the time of the first fall is missing": lambda: _time_of_rest(0.9) - math.sqrt(10.0 / G),
        },
    ),
    "fireworks-1": Exercise("When is the highest possible spark at the top?", "s", lambda: 12.0 / G),
    "circle_half_plane-2": Exercise(
        "How far is the circle from the half-plane?",
        "m",
        lambda: (3.0 * 5.0 + 4.0 * 0.0) / 5.0 - 1.0,
        {
            "the normal must have length 1": lambda: 15.0 - 1.0,
            "the normal must have length 1, and the radius counts": lambda: 15.0,
            "that is the distance of the centre": lambda: 3.0,
        },
    ),
    "bisection-1": Exercise(
        "How many halvings does it take to know the time within 1 µs, starting from 0.1 s?",
        "",
        lambda: math.ceil(math.log2(0.1 / 1e-6) - 1.0),
        {"the middle of the interval is at most half of it away": lambda: math.ceil(math.log2(0.1 / 1e-6))},
        is_count=True,
    ),
    "bisection-4": Exercise(
        "When do the two balls touch?",
        "s",
        lambda: (3.0 - 2.0 * 0.5) / 4.0,
        {
            "that is when their centres meet": lambda: 3.0 / 4.0,
            "both radii count": lambda: 2.5 / 4.0,
        },
    ),
    "tunnelling-1": Exercise(
        "Which bullet speed is safe at 60 steps per second?",
        "m/s",
        lambda: (0.01 + 0.01) * 60.0,
        {"half of the wall and the radius count, not the wall alone": lambda: 0.01 * 60.0},
    ),
    "tunnelling-2": Exercise(
        "Which dt is safe for a ball of radius 0.1 m at 20 m/s and a wall of 0.1 m?",
        "s",
        lambda: (0.1 + 0.05) / 20.0,
        {"only half of the wall counts": lambda: 0.2 / 20.0},
    ),
    "tunnelling-3": Exercise(
        "Which dt is safe for two bullets that fly at each other at 100 m/s?",
        "s",
        lambda: 0.02 / 200.0,
        {"the relative speed counts": lambda: 0.02 / 100.0},
    ),
    "order-1": Exercise(
        "Which order does semi-implicit Euler have between 0.2 s and 0.1 s?",
        "",
        lambda: math.log2(_largest_error(0.2) / _largest_error(0.1)),
        {
            "the logarithm to base 2 is the order": lambda: _largest_error(0.2) / _largest_error(0.1),
            "that is the order for short steps": lambda: 1.0,
        },
    ),
    "kepler-1": Exercise(
        "Which speed at the start gives a circular orbit at radius 0.5?",
        "",
        lambda: math.sqrt(1.0 / 0.5),
        {"with that speed it escapes": lambda: math.sqrt(2.0 / 0.5), "that is the orbit of the scene": lambda: 3**0.5},
    ),
    "kepler-3": Exercise(
        "Which area does the line from the sun to the planet sweep in one step of 0.002 s?",
        "",
        lambda: 0.5 * math.sqrt(0.75) * 0.002,
        {"a triangle has half of base times height": lambda: math.sqrt(0.75) * 0.002},
    ),
    "stacks-1": Exercise(
        "Which force does the contact under box 10 transmit?",
        "N",
        lambda: 11 * G,
        {"box 10 is carried, too": lambda: 10 * G, "the contact carries the boxes above it": lambda: 9 * G},
    ),
    "billiards-1": Exercise(
        "How fast is the ball when it rolls?",
        "m/s",
        lambda: 2.0 * 5.0 / 7.0,
        {"that is the speed of a disc": lambda: 2.0 * 2.0 / 3.0},
    ),
    "springs-1": Exercise(
        "Which stiffness is stable for a mass of 0.1 kg at 240 steps a second?",
        "N/m",
        lambda: 4.0 * 0.1 * 240.0**2,
        {
            "the limit is at ω h = 2, not 1": lambda: 0.1 * 240.0**2,
            "the step counts squared": lambda: 4.0 * 0.1 * 240.0,
        },
    ),
    "springs-2": Exercise(
        "How many times √(k/m) is the ω of two equal masses on one spring?",
        "",
        lambda: math.sqrt(2.0),
        {"half the mass is twice ω², not ω": lambda: 2.0, "the reduced mass is half of m": lambda: math.sqrt(0.5)},
    ),
    "machines-1": Exercise(
        "Which mass of `pull` holds the load of the right pair in balance?",
        "kg",
        lambda: 2.0 / 2.0,
        {"the load hangs on two strands": lambda: 2.0},
    ),
    "machines-2": Exercise(
        "When does the rope of the left pair become taut, with 0.2 m of slack?",
        "s",
        lambda: math.sqrt(2.0 * 0.1 / G),
        {"both bodies fall, each by half of the slack": lambda: math.sqrt(2.0 * 0.2 / G)},
    ),
    "penalty-1": Exercise("How stiff must the spring be for a depth of 1 mm at rest?", "N/m", lambda: G / 1e-3),
    "penalty-2": Exercise(
        "Which is the longest step that has ten steps in a contact?",
        "s",
        lambda: math.pi / math.sqrt(G / 1e-3) / 10.0,
        {"a contact takes half an oscillation": lambda: 2.0 * math.pi / math.sqrt(G / 1e-3) / 10.0},
    ),
    "penalty-3": Exercise(
        "How deep is each of the four contacts of the car?",
        "m",
        lambda: 1e3 * G / (4.0 * G / 1e-3),
        {"four contacts share the weight": lambda: 1e3 * G / (G / 1e-3)},
    ),
    "ragdoll-1": Exercise(
        "How many degrees of freedom has the figure?",
        "",
        lambda: 15 * 3 - 14 * 2,
        {
            "a pivot takes two degrees of freedom, not one": lambda: 15 * 3 - 14,
            "a segment can turn, too": lambda: 15 * 2 - 14 * 2,
            "a limit takes none": lambda: 15 * 3 - 14 * 3,
        },
        is_count=True,
    ),
    "ragdoll-2": Exercise(
        "How fast do both discs turn after the limit, if the first had 10 rad/s, and the second has twice its radius "
        "and three times its mass?",
        "rad/s",
        lambda: 10.0 / (1.0 + 3.0 * 2.0**2),
        {
            "the moment of inertia grows with the square of the radius": lambda: 10.0 / (1.0 + 3.0 * 2.0),
            "that is the speed for equal radii": lambda: 10.0 / (1.0 + 3.0),
        },
    ),
    "ragdoll-3": Exercise(
        "How large may a step be so that a shank at 20 rad/s never passes the limit by more than 1°?",
        "s",
        lambda: math.radians(1.0) / 20.0,
        {"1° is 0.01745 rad": lambda: 1.0 / 20.0},
    ),
    "cloth-1": Exercise(
        "How much longer does a column of a cloth of 24 rows become?",
        "m",
        lambda: 0.002 * G / 100.0 * 23 * 24 / 2,
        {
            "the top row is fixed": lambda: 0.002 * G / 100.0 * 24 * 25 / 2,
            "the lower springs carry less than the first": lambda: 0.002 * G / 100.0 * 23**2,
        },
    ),
    "cloth-2": Exercise(
        "Which step is stable for springs of 400 N/m?",
        "s",
        lambda: math.sqrt(0.002 / 400.0),
        {
            "the highest frequency is twice that of one mass on one spring": lambda: 2.0 * math.sqrt(0.002 / 400.0),
            "the square root of the stiffness counts": lambda: math.sqrt(0.002 / 100.0) / 4.0,
        },
    ),
    "cloth-3": Exercise(
        "How heavy may a node be so that the cloth holds if it is loaded slowly?",
        "kg",
        lambda: 8.0 / (21 * G),
        {
            "the top row is fixed": lambda: 8.0 / (22 * G),
            "that is the mass for a sudden load": lambda: 4.0 / (21 * G),
        },
    ),
    "artillery-1": Exercise(
        "How far does the shell of 65 m/s fly at most without drag?",
        "m",
        lambda: 65.0**2 / G,
        {"that is the greatest height of a vertical shot": lambda: 65.0**2 / (2.0 * G)},
    ),
    "artillery-2": Exercise(
        "At which lower angle does it hit a target at 210 m without drag?",
        "degrees",
        lambda: math.degrees(math.asin(210.0 * G / 65.0**2)) / 2.0,
        {
            "that is twice the angle": lambda: math.degrees(math.asin(210.0 * G / 65.0**2)),
            "that is the higher angle": lambda: 90.0 - math.degrees(math.asin(210.0 * G / 65.0**2)) / 2.0,
        },
    ),
    "artillery-3": Exercise(
        "Which terminal velocity has a body in air with a drag of 0.2 1/s?",
        "m/s",
        lambda: G / 0.2,
        {"that is the velocity for 0.05 1/s": lambda: G / 0.05},
    ),
    "artillery-4": Exercise(
        "How far off is a shot of 65 m/s at 30° with explicit Euler and a step of 0.05 s?",
        "m",
        lambda: 0.05 * 65.0 * math.cos(math.radians(30.0)),
        {"the horizontal part of the velocity counts": lambda: 0.05 * 65.0},
    ),
    "newtons_cradle-2": Exercise(
        "Which speed has the heavy ball at the end?",
        "m/s",
        lambda: ((3.0 - 1.0) / (3.0 + 1.0)) ** 4,
        {"that is its speed after the first impact": lambda: 0.5},
    ),
    "newtons_cradle-3": Exercise(
        "Which speed has the last ball for e = 0.9?",
        "m/s",
        lambda: ((1.0 + 0.9) / 2.0) ** 4,
        {"each of four impacts gives (1 + e)/2 of the speed, not e": lambda: 0.9**4},
    ),
}


def exercises() -> dict[str, Exercise]:
    """Return the exercises by their names: the page of the lesson and the number of the question."""
    return dict(_EXERCISES)


def check(name: str, value: float) -> MarkedAnswer:
    """Check the answer to an exercise.

    Args:
        name: page and number, such as "bounce-3".
        value: the answer, in the unit of the exercise.

    Returns:
        Right within 0.5 %, or nearly right within 5 %; a count must be exact. Otherwise the kind of mistake, if known.

    Raises:
        ValueError: there is no such exercise.

    Example:
        >>> check("bounce-3", 19.2)
        right
        >>> check("bounce-3", 9.11)
        not right: that is the time for e = 0.8
    """
    try:
        exercise = _EXERCISES[name]
    except KeyError:
        raise ValueError(f"no exercise {name!r}; exercises: {', '.join(_EXERCISES)}") from None
    answer, value = exercise.answer(), float(value)
    if value == answer or (not exercise.is_count and _agrees(value, answer, RIGHT)):
        return MarkedAnswer("right", "")
    known = [text for text, mistaken in exercise.mistakes.items() if _agrees(value, mistaken(), RIGHT)]
    if known:
        return MarkedAnswer("wrong", known[0])
    if exercise.is_count and abs(value - answer) <= 1.0:
        return MarkedAnswer("nearly", "one more or less" if value.is_integer() else "it is a whole number")
    if not exercise.is_count and _agrees(value, answer, NEAR):
        return MarkedAnswer("nearly", "give three digits, and check the rounding on the way")
    factors = [text for text, factor in MISTAKES.items() if _agrees(value, factor * answer, RIGHT)]
    return MarkedAnswer("wrong", factors[0] if factors else "")


def _agrees(value: float, expected: float, tolerance: float) -> bool:
    return abs(value - expected) <= tolerance * abs(expected)
