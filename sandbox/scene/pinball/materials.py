"""Materials of a table: what the ball meets, as in Visual Pinball's default materials; falloff in s/m."""

from sandbox.scene.model import Material, Pair

BALL = "steel"

MATERIALS = (
    Material(name=BALL),
    Material(name="wall", restitution=0.3, friction=0.3),
    Material(name="rubber", restitution=0.8, restitution_falloff=0.3, friction=0.6),
    Material(name="target", restitution=0.35, restitution_falloff=0.5, friction=0.2),
    Material(name="post", restitution=0.9, restitution_falloff=0.1, friction=0.3),
    Material(name="flipper", restitution=0.8, restitution_falloff=0.43, friction=0.6),
)
"""The ball's own has no figures: of a contact, those of the other side hold."""


def pairs(ball_restitution: float) -> tuple[Pair, ...]:
    """Return the coefficients of what meets its own kind."""
    return (Pair(between=(BALL, BALL), restitution=ball_restitution, friction=0.2),)
