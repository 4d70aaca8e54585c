"""Conversion of scenes to pooltool, so that both engines simulate the same shot, table and models.

Requires `pooltool-billiards`, which writes into the home folder: set `HOME` and `NUMBA_CACHE_DIR` before the import.
No file of that package is changed; `correct` replaces functions and a constant at run time, and `engine` the law of
friction between balls.
"""

import math
from collections.abc import Collection
from typing import Any

import numba
import numpy as np
import pooltool as pt
from pooltool import constants
from pooltool.objects.table.components import (
    CircularCushionSegment,
    CushionDirection,
    CushionSegments,
    LinearCushionSegment,
    Pocket,
)
from pooltool.physics.engine import PhysicsEngine
from pooltool.physics.resolve.ball_ball import FrictionalInelastic, FrictionlessElastic
from pooltool.physics.resolve.ball_ball.core import CoreBallBallCollision
from pooltool.physics.resolve.ball_ball.friction import AlciatoreBallBallFriction
from pooltool.physics.resolve.ball_cushion import Han2005Circular, Han2005Linear, UnrealisticCircular, UnrealisticLinear
from pooltool.physics.resolve.ball_pocket import CanonicalBallPocket
from pooltool.physics.resolve.resolver import Resolver
from pooltool.physics.resolve.stick_ball.instantaneous_point import InstantaneousPoint
from pooltool.physics.resolve.transition import CanonicalTransition
from pooltool.ptmath.roots import quartic

Document = dict[str, Any]

NEGLIGIBLE = 1e-24
"""m²/s⁴; square of a relative acceleration of two balls that moves them by 1e-10 m in ten seconds."""

SPACER = 1e-12
"""m, by which a corrected pooltool separates bodies after a collision, so that they do not collide again at once."""

CORRECTIONS = {
    "quadratic": "no relative acceleration: the quadratic is solved where the quartic's leading coefficient vanishes",
    "friction": "friction between balls is Coulomb's, mu (1 + e)/2 v_n, instead of mu e v_n",
    "touching": "resolve_continually_touching off",
    "spacer": f"bodies that met are parted by {SPACER:g} m instead of 1e-06 m",
}
"""Name of each correction, and what it changes. The first and third are of faults, the others choices of a model."""

_plain_quartic = quartic.solve


@numba.njit(cache=False)
def _roots(a: float, b: float, c: float, d: float, e: float) -> np.ndarray:
    """Return the four roots; for a quadratic its two roots, and −1, which counts as past, for the others."""
    if abs(a) > NEGLIGIBLE:
        return _plain_quartic(a, b, c, d, e)
    found = np.full(4, complex(-1.0, 0.0))
    discriminant = d * d - 4.0 * c * e
    if c > 0.0 and discriminant >= 0.0:
        q = -0.5 * (d + math.copysign(math.sqrt(discriminant), d))
        found[0] = complex(q / c, 0.0)
        if q != 0.0:
            found[1] = complex(e / q, 0.0)
    return found


def correct(corrections: Collection[str] = tuple(CORRECTIONS), spacer: float = SPACER) -> None:
    """Apply corrections except for "friction", which `engine` applies, before the first shot of the process.

    Args:
        corrections: keys of `CORRECTIONS`.
        spacer: distance that the correction "spacer" sets, m.
    """
    if "quadratic" in corrections:
        quartic.solve = _roots
    if "touching" in corrections:
        CoreBallBallCollision.resolve_continually_touching = lambda self, ball1, ball2: (ball1, ball2)  # noqa: ARG005
    if "spacer" in corrections:
        constants.MIN_DIST = spacer


class Coulomb(AlciatoreBallBallFriction):
    """Coefficient that turns pooltool's impulse μ·e·v_n into Coulomb's μ(1 + e)/2·v_n, with its slip condition."""

    def calculate_friction(self, ball1: pt.Ball, ball2: pt.Ball) -> float:
        """Return μ(1 + e)/(2e)."""
        e = (ball1.params.e_b + ball2.params.e_b) / 2.0
        return super().calculate_friction(ball1, ball2) * (1.0 + e) / (2.0 * e)


class Frictionless(AlciatoreBallBallFriction):
    """Balls without friction."""

    def calculate_friction(self, ball1: pt.Ball, ball2: pt.Ball) -> float:  # noqa: ARG002
        """Return 0."""
        return 0.0


def engine(document: Document, corrections: Collection[str] = tuple(CORRECTIONS)) -> PhysicsEngine:
    """Return pooltool's physics with the models of a scene, and its own law of friction unless it is corrected."""
    models = document["contact_models"]
    if models["ball_ball"] == "frictional":
        ball_ball = FrictionalInelastic(
            friction=Coulomb() if "friction" in corrections else AlciatoreBallBallFriction()
        )
    elif _restitution(document) == 1.0:
        ball_ball = FrictionlessElastic()
    else:
        ball_ball = FrictionalInelastic(friction=Frictionless())
    if models["cushion"] == "han2005":
        linear, circular = Han2005Linear(), Han2005Circular()
    else:
        linear = UnrealisticLinear(restitution=True)
        circular = UnrealisticCircular(restitution=True)
    return PhysicsEngine(
        resolver=Resolver(
            ball_ball=ball_ball,
            ball_linear_cushion=linear,
            ball_circular_cushion=circular,
            ball_pocket=CanonicalBallPocket(),
            stick_ball=InstantaneousPoint(),
            transition=CanonicalTransition(),
        )
    )


def _restitution(document: Document) -> float:
    """Return the restitution of two balls, which is the same for all pairs."""
    (pair,) = document["pair"]
    return float(pair["restitution"])


def system(document: Document) -> pt.System:
    """Return pooltool's balls and table of a scene right after the strike."""
    floor = document["surface"]
    rail = next((m for m in document["material"] if m["name"] == "rail"), {"restitution": 0.85, "friction": 0.2})
    balls = {}
    for ball in document["ball"]:
        radius = ball["radius"]
        converted = pt.Ball.create(
            ball["name"],
            xy=ball["position"],
            m=ball["mass"],
            R=radius,
            u_s=floor["sliding_friction"],
            u_r=floor["rolling_friction"],
            u_sp_proportionality=floor["spinning_friction"] / radius,
            e_b=_restitution(document),
            e_c=rail["restitution"],
            f_c=rail["friction"],
            g=floor["gravity"],
        )
        velocity, spin = ball.get("velocity", [0.0, 0.0]), ball.get("spin", [0.0, 0.0, 0.0])
        converted.state.rvw[1, :2], converted.state.rvw[2] = velocity, spin
        converted.state.s = motion(velocity, spin, radius)
        balls[ball["name"]] = converted
    return pt.System(cue=pt.Cue(cue_ball_id=document["ball"][0]["name"]), table=_table(document), balls=balls)


def motion(velocity: list[float], spin: list[float], radius: float) -> int:
    """Return pooltool's number of the motion state of a ball."""
    slip = math.hypot(velocity[0] - radius * spin[1], velocity[1] + radius * spin[0])
    if slip > 1e-9:
        return constants.sliding
    if any(velocity):
        return constants.rolling
    return constants.spinning if spin[2] else constants.stationary


def _table(document: Document) -> pt.Table:
    """Return the table of walls with two points, posts and pockets.

    Walls are one-sided, as in pooltool's own tables, because this is faster. The side is that of the middle of the
    table, or of a nearby pocket.
    """
    walls = document.get("wall", [])
    ends = np.array([wall["points"] for wall in walls]).reshape(-1, 2)
    middle = (ends.min(axis=0) + ends.max(axis=0)) / 2.0 if len(ends) else np.zeros(2)
    linear = {}
    for wall in walls:
        (ax, ay), (bx, by) = wall["points"]
        segment = LinearCushionSegment(
            wall["name"], p1=np.array([ax, ay, wall["height"]]), p2=np.array([bx, by, wall["height"]])
        )
        centre = (segment.p1 + segment.p2)[:2] / 2.0
        near = [
            p["position"] for p in document.get("pocket", []) if math.dist(p["position"], centre) < 2.0 * p["radius"]
        ]
        x, y = near[0] if near else middle
        side = segment.lx * x + segment.ly * y + segment.l0
        facing = CushionDirection.BOTH
        if abs(side) > 1e-9:  # otherwise it is the only wall, and both sides are needed
            facing = CushionDirection.SIDE1 if side < 0.0 else CushionDirection.SIDE2
        linear[wall["name"]] = LinearCushionSegment(wall["name"], p1=segment.p1, p2=segment.p2, direction=facing)
    circular = {
        post["name"]: CircularCushionSegment(
            post["name"], center=np.array([*post["position"], post["height"]]), radius=post["radius"]
        )
        for post in document.get("post", [])
    }
    pockets = {
        pocket["name"]: Pocket(pocket["name"], center=np.array([*pocket["position"], 0.0]), radius=pocket["radius"])
        for pocket in document.get("pocket", [])
    }
    kind = pt.TableType.POCKET if pockets else pt.TableType.BILLIARD
    return pt.Table(
        cushion_segments=CushionSegments(linear=linear, circular=circular), pockets=pockets, table_type=kind
    )


def furniture(name: str) -> Document:
    """Return the walls, posts and pockets of one of pooltool's tables as tables of a scene."""
    table = pt.Table.prebuilt(pt.objects.TableName[name])
    cushions = table.cushion_segments
    return {
        "wall": [
            {
                "name": f"cushion {key}",
                "points": [part.p1[:2].tolist(), part.p2[:2].tolist()],
                "height": float(part.height),
                "material": "rail",
            }
            for key, part in cushions.linear.items()
        ],
        "post": [
            {
                "name": f"jaw {key}",
                "position": part.center[:2].tolist(),
                "radius": float(part.radius),
                "height": float(part.height),
                "material": "rail",
            }
            for key, part in cushions.circular.items()
        ],
        "pocket": [
            {"name": f"pocket {key}", "position": part.center[:2].tolist(), "radius": float(part.radius)}
            for key, part in table.pockets.items()
        ],
    }
