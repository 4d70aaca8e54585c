"""Billiard shots as scenes: balls right after the strike, cloth, cushions and tables."""

import math
from collections.abc import Callable

from tools.oracles.shot_parts import CAROM, POOL, SNOOKER, Pair, Shot, Triple, ball, heading, rack, rail, scene, turning


def on_cloth() -> list[Shot]:
    """Return shots of single balls without collisions."""
    slow, oblique = heading(1.0, 53.0), heading(1.5, 30.0)
    singles: list[tuple[str, str, str, Pair, Triple, float, int]] = [
        (
            "roll",
            "Straight roll",
            "A ball that rolls from the start, to rest.",
            slow,
            turning(POOL, slow, 1.0),
            0.25,
            44,
        ),
        ("stun", "Stun", "A ball without spin slides, then rolls.", oblique, turning(POOL, oblique, 0.0), 0.05, 240),
        (
            "draw",
            "Draw",
            "Backspin, so much that the ball comes back.",
            oblique,
            turning(POOL, oblique, -4.0),
            0.05,
            160,
        ),
        ("follow", "Follow", "Overspin speeds the ball up.", oblique, turning(POOL, oblique, 2.5), 0.05, 450),
        ("swerve", "Swerve", "Spin across the path bends it into a parabola.", oblique, (60.0, 90.0, -40.0), 0.05, 350),
    ]
    shots = [
        Shot(name, scene(title, about, [ball(POOL, "cue", (0.0, 0.0), velocity, spin)], dt, frames))
        for name, title, about, velocity, spin, dt, frames in singles
    ]
    side = [
        ball(POOL, "rolling", (0.0, 0.0), (0.4, 0.3), turning(POOL, (0.4, 0.3), 1.0, 60.0)),
        ball(POOL, "spinning", (0.0, 1.0), spin=(0.0, 0.0, -35.0)),
    ]
    about = "Side spin alone: it bends no path and outlasts the roll; one ball only spins."
    return [*shots, Shot("side", scene("Side spin", about, side, 0.05, 120))]


def of_two() -> list[Shot]:
    """Return collisions of two balls."""
    start, r = (0.0, -0.2), POOL.radius
    half = (r, r * 2.0 * math.sqrt(0.75))
    straight = (0.0, 2.0)
    shots = []
    for name, models, restitution in (("elastic", "elastic", 1.0), ("frictional", "frictional", None)):
        about = f"Stun, full on: {models}, e = {0.95 if restitution is None else restitution}."
        balls = [ball(POOL, "cue", start, straight), ball(POOL, "object", (0.0, 2.0 * r))]
        shots.append(
            Shot(
                f"full_{name}",
                scene(
                    f"Full ball, {name}",
                    about,
                    balls,
                    0.05,
                    270,
                    models=(models, "simple"),
                    restitution=restitution,
                ),
            )
        )
    for name in ("elastic", "frictional"):
        balls = [
            ball(POOL, "cue", start, straight, turning(POOL, straight, 1.0)),
            ball(POOL, "object", half),
        ]
        about = f"A rolling ball cuts another by about 30°: {name}, e = 0.95."
        shots.append(
            Shot(f"half_{name}", scene(f"Half ball, {name}", about, balls, 0.05, 260, models=(name, "simple")))
        )
    spun = [
        ball(POOL, "cue", start, (0.0, 1.2), turning(POOL, (0.0, 1.2), 0.3, 45.0)),
        ball(POOL, "object", (0.0, 2.0 * r)),
    ]
    about = "Full on with side spin: the object ball is thrown aside."
    shots.append(Shot("throw", scene("Throw", about, spun, 0.05, 140)))
    return shots


def at_cushions() -> list[Shot]:
    """Return shots of one ball at one cushion."""
    shots = []
    for model in ("simple", "han2005"):
        for degrees in (45, 20):
            for side in (0.0, -40.0):
                velocity = heading(1.6, 90.0 - degrees)  # the angle is that between path and cushion
                spin = turning(POOL, velocity, 1.0, side)
                start = (0.5 - velocity[0] * 0.3, -velocity[1] * 0.3)
                side_text = f", {abs(side):g} rad/s of side" if side else ""
                about = f"Rolling into a cushion at {degrees}°{side_text}: {model}."
                name = f"cushion_{degrees}_{model}{'_side' if side else ''}"
                wall = rail((0.5, -4.0), (0.5, 16.0))
                balls = [ball(POOL, "cue", start, velocity, spin)]
                title = f"Cushion, {degrees}°"
                shots.append(Shot(name, scene(title, about, balls, 0.05, 315, models=("frictional", model), wall=wall)))
    along = math.radians(25.0)
    wall = rail((-8.0 * math.cos(along), -8.0 * math.sin(along)), (8.0 * math.cos(along), 8.0 * math.sin(along)))
    velocity = heading(1.8, -30.0)
    balls = [ball(POOL, "cue", (-0.4, 0.2), velocity, turning(POOL, velocity, -0.5, 55.0))]
    about = "Backspin and side into a cushion that lies askew: han2005."
    return [*shots, Shot("cushion_askew", scene("Cushion askew", about, balls, 0.05, 240, wall=wall))]


def on_tables() -> list[Shot]:
    """Return shots on tables and of several balls."""
    corner = (0.9906, 1.9812)
    straight = heading(1.5, 45.0)
    potted = [
        ball(POOL, "cue", (corner[0] - 0.5, corner[1] - 0.5), straight, turning(POOL, straight, 1.0)),
        ball(POOL, "object", (corner[0] - 0.25, corner[1] - 0.25)),
    ]
    pot = scene("Straight pot", "The object ball goes into the corner, the cue ball after it.", potted, 0.02, 70)
    aim = heading(2.5, 59.2)
    rattled = [ball(POOL, "cue", (0.74, 1.66), aim, turning(POOL, aim, 1.0))]
    about = "From jaw to jaw of the corner pocket, by both of its facings."
    rattle = scene("Jaw rattle", about, rattled, 0.01, 300)
    plain = scene("Jaw rattle, simple", about, rattled, 0.01, 300, models=("elastic", "simple"))
    row = [
        ball(POOL, "cue", (0.0, -0.15), (0.0, 1.5)),
        ball(POOL, "first", (0.0, 0.0)),
        ball(POOL, "second", (0.0, 2.0 * POOL.radius + 1e-3)),
        ball(POOL, "third", (0.0, 4.0 * POOL.radius + 2e-3)),
    ]
    lined = scene("Three in a row", "Balls 1 mm apart, hit along their line.", row, 0.02, 500)

    fast, slow = heading(1.0, 37.0), heading(0.6, 37.0)
    chase = [
        ball(POOL, "fast", (0.0, 0.0), fast, turning(POOL, fast, 1.0)),
        ball(POOL, "slow", (0.14, 0.10), slow, turning(POOL, slow, 1.0)),
    ]
    about = "Two balls roll one way and slow alike, until the fast one catches up: their distance is a quadratic."
    alike = scene("Equal accelerations", about, chase, 0.05, 180)
    return [
        three_cushions(0.05, 140),
        Shot("pot", pot, "SEVEN_FOOT_SHOWOOD"),
        Shot("rattle", rattle, "SEVEN_FOOT_SHOWOOD"),
        Shot("rattle_simple", plain, "SEVEN_FOOT_SHOWOOD"),
        Shot("row", lined),
        Shot("alike", alike),
        nine_ball(0.02, 100),
    ]


def nine_ball(dt: float, frames: int) -> Shot:
    """Return a 9-ball break on the 7-foot table."""
    names = ["1", "2", "3", "4", "9", "5", "6", "7", "8"]
    balls = [
        ball(POOL, "cue", (0.52, 0.46), heading(8.0, 91.48)),
        *rack(POOL, (1, 2, 3, 2, 1), (0.4953, 1.4859), names, seed=9),
    ]
    document = scene("9-ball break", "Nine balls, loosely racked, struck at 8 m/s.", balls, dt, frames)
    return Shot("nine_ball_break", document, "SEVEN_FOOT_SHOWOOD")


def eight_ball(dt: float, frames: int) -> Shot:
    """Return an 8-ball break on the 7-foot table."""
    names = ["1", "9", "2", "10", "8", "3", "11", "4", "12", "5", "6", "13", "14", "7", "15"]
    balls = [
        ball(POOL, "cue", (0.55, 0.46), heading(8.0, 93.152)),
        *rack(POOL, (1, 2, 3, 4, 5), (0.4953, 1.4859), names, seed=8),
    ]
    document = scene("8-ball break", "Fifteen balls, loosely racked, struck at 8 m/s.", balls, dt, frames)
    return Shot("eight_ball_break", document, "SEVEN_FOOT_SHOWOOD")


def snooker(dt: float, frames: int) -> Shot:
    """Return a break-off on the snooker table, thin on the end red."""
    width, length = 1.7465, 3.5445
    apex = (width / 2.0, 0.75 * length + 2.0 * SNOOKER.radius * 1.002)
    reds = rack(SNOOKER, (1, 2, 3, 4, 5), apex, [f"red {k}" for k in range(1, 16)], seed=15)
    spots = {
        "yellow": (width / 3.0, 0.2),
        "green": (width * 2.0 / 3.0, 0.2),
        "brown": (width / 2.0, 0.2),
        "blue": (width / 2.0, 0.5),
        "pink": (width / 2.0, 0.75),
        "black": (width / 2.0, 10.0 / 11.0),
    }
    colours = [ball(SNOOKER, name, (x, y * length)) for name, (x, y) in spots.items()]
    start = (width * 7.0 / 12.0, 0.2 * length)
    velocity = heading(3.6, 89.967)
    balls = [ball(SNOOKER, "white", start, velocity, turning(SNOOKER, velocity, 0.5, 35.0)), *reds, *colours]
    about = "Twenty-two balls: thin on the end red."
    return Shot("snooker_break", scene("Break-off", about, balls, dt, frames, kit=SNOOKER), "SNOOKER_GENERIC")


def three_cushions(dt: float, frames: int) -> Shot:
    """Return a shot on the carom table, over four cushions to the second ball."""
    velocity = heading(4.0, 58.0)
    balls = [
        ball(CAROM, "white", (0.9, 0.3), velocity, turning(CAROM, velocity, 0.6, 30.0)),
        ball(CAROM, "yellow", (0.30, 0.60)),
        ball(CAROM, "red", (0.71, 2.13)),
    ]
    about = "Around the carom table with running side, by four cushions onto the yellow."
    return Shot("three_cushions", scene("Three cushions", about, balls, dt, frames, kit=CAROM), "BILLIARD_WIP")


TO_COMPARE: tuple[Callable[[], list[Shot]], ...] = (on_cloth, of_two, at_cushions, on_tables)
"""Functions that return the shots that are compared with the oracle."""


def full() -> list[Shot]:
    """Return the shots that are timed from the strike to rest."""
    return [nine_ball(0.02, 2000), eight_ball(0.02, 2000), snooker(0.02, 2000), three_cushions(0.02, 2000)]
