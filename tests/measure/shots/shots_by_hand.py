"""Tables with a shot whose outcome has a closed form: balls without friction, pockets without jaws."""

import sandbox
from sandbox.scene.compile.scene import Scene
from tests.toml_text import toml

R = 0.028575

FLOOR = (
    toml("world", seed=7)
    + toml("surface", gravity=9.81, sliding_friction=0.2, rolling_friction=0.01, spinning_friction=0.0127)
    + '[contact_models]\nball_ball = "elastic"\n'
    + toml("material", name="phenolic")
    + toml("pair", between=["phenolic", "phenolic"], restitution=1.0)
)


def ball(name: str, x: float, y: float = 0.0) -> str:
    """Return a ball at rest."""
    return toml("ball", name=name, position=[x, y], radius=R, mass=0.17, material="phenolic")


def pocket(name: str, x: float, y: float = 0.0, radius: float = 0.06) -> str:
    """Return a pocket."""
    return toml("pocket", name=name, position=[x, y], radius=radius)


def shot(aim: float = 0.0, speed: float = 2.0, side: float = 0.0, height: float = 0.0) -> str:
    """Return a shot at the cue ball."""
    return toml("shot", name="it", aim=aim, speed=speed, side=side, height=height)


def scene_with(*parts: str) -> Scene:
    """Return a scene with a cue ball at the origin."""
    return sandbox.loads(FLOOR + ball("cue", 0.0) + "".join(parts))


def straight_pot(d: float, far: float, speed: float = 2.0, aim: float = 0.0) -> Scene:
    """Return a straight pot: distance `d` between the centres of the balls, `far` from the ball to the pocket."""
    return scene_with(ball("object", d), pocket("hole", d + far), shot(aim, speed))
