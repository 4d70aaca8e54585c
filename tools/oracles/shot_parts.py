"""Parts of billiard shots: balls and cloth by game, spins, racks, cushions, and complete scenes."""

import math
import random
from collections.abc import Iterable
from typing import Any, NamedTuple

Document = dict[str, Any]
Pair = tuple[float, float]
Triple = tuple[float, float, float]


class Kit(NamedTuple):
    """Balls and cloth of a game, in SI units; coefficients are dimensionless."""

    radius: float
    mass: float
    sliding: float
    cushion_friction: float
    restitution: float = 0.95
    rolling: float = 0.01


POOL = Kit(0.028575, 0.170097, 0.2, 0.2)
SNOOKER = Kit(0.02619375, 0.140, 0.5, 0.5)
CAROM = Kit(0.03075, 0.210, 0.2, 0.15)


class Shot(NamedTuple):
    """A shot: its scene without the table, and the name of the table."""

    name: str
    document: Document
    furniture: str | None = None
    """name of the table of pooltool whose cushions, jaws and pockets are used"""


def ball(kit: Kit, name: str, position: Pair, velocity: Pair = (0.0, 0.0), spin: Triple = (0.0, 0.0, 0.0)) -> Document:
    """Return a ball; velocity and spin are omitted if zero."""
    table: Document = {"name": name, "position": [*position]}
    if any(velocity):
        table["velocity"] = [*velocity]
    if any(spin):
        table["spin"] = [*spin]
    return {**table, "radius": kit.radius, "mass": kit.mass, "material": "phenolic"}


def heading(speed: float, degrees: float) -> Pair:
    """Return a velocity from its magnitude and its angle from the x axis, degrees."""
    return speed * math.cos(math.radians(degrees)), speed * math.sin(math.radians(degrees))


def turning(kit: Kit, velocity: Pair, fraction: float, side: float = 0.0) -> Triple:
    """Return a spin of `fraction` of natural roll (1 rolls, 0 is stun, −1 draws), and `side` rad/s about z."""
    return -fraction * velocity[1] / kit.radius, fraction * velocity[0] / kit.radius, side


def scene(
    title: str,
    about: str,
    balls: Iterable[Document],
    dt: float,
    frames: int,
    *,
    kit: Kit = POOL,
    models: tuple[str, str] = ("frictional", "han2005"),
    restitution: float | None = None,
    **furniture: list[Document],
) -> Document:
    """Return a scene of a shot with a duration of `frames` steps of dt, s."""
    return {
        "title": title,
        "about": about,
        "world": {"duration": round(dt * frames, 12)},
        "solver": {"dt": dt},
        "surface": {
            "gravity": 9.81,
            "sliding_friction": kit.sliding,
            "rolling_friction": kit.rolling,
            "spinning_friction": kit.radius * 4.0 / 9.0,
        },
        "contact_models": {"ball_ball": models[0], "cushion": models[1]},
        "material": [
            {"name": "phenolic"},
            {"name": "rail", "restitution": 0.85, "friction": kit.cushion_friction},
        ],
        "pair": [
            {
                "between": ["phenolic", "phenolic"],
                "restitution": kit.restitution if restitution is None else restitution,
            }
        ],
        **furniture,
        "ball": list(balls),
    }


def rail(a: Pair, b: Pair, height: float = 0.036576) -> list[Document]:
    """Return a single cushion."""
    return [{"name": "cushion", "points": [[*a], [*b]], "height": height, "material": "rail"}]


def rack(
    kit: Kit, rows: Iterable[int], apex: Pair, names: Iterable[str], seed: int, gap: float = 1e-3
) -> list[Document]:
    """Return balls in rows along y, each randomly off its position by up to `gap` radii."""
    generator, remaining_names, balls = random.Random(seed), iter(names), []
    pitch = 2.0 * kit.radius * (1.0 + gap)
    for row, count in enumerate(rows):
        for column in range(count):
            angle, offset = generator.uniform(0.0, 2.0 * math.pi), generator.uniform(0.0, gap * kit.radius)
            x = apex[0] + (column - (count - 1) / 2.0) * pitch + offset * math.cos(angle)
            y = apex[1] + row * pitch * math.sqrt(0.75) + offset * math.sin(angle)
            balls.append(ball(kit, next(remaining_names), (x, y)))
    return balls
