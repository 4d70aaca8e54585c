"""ENGINES: every engine that is installed, by name."""

from sandbox.echo import short_repr
from sandbox.engines.box2d_adapter.engine import Box2DEngine
from sandbox.engines.box2d_adapter.requirements import is_installed
from sandbox.engines.contract import Engine, Refusal, Simulation
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.pymunk_adapter.engine import PymunkEngine
from sandbox.engines.reference.engine import ReferenceEngine
from sandbox.scene.compile.demands import demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings

ENGINES: dict[str, Engine] = {
    "pymunk": PymunkEngine(),
    **({"box2d": Box2DEngine()} if is_installed() else {}),
    "exact": ExactEngine(),
    "reference": ReferenceEngine(),
}


EXTRAS = {"box2d": "box2d"}
"""extra of the package that installs an engine, by the name of the engine"""

USUAL = "pymunk"
"""Default engine."""


class UnknownEngineError(ValueError):
    """No engine has that name."""


def engine_named(name: str) -> Engine:
    """Return an engine by name.

    Raises:
        UnknownEngineError: no engine has that name; the message lists the engines.
    """
    try:
        return ENGINES[name]
    except KeyError:
        if name in EXTRAS:
            needed = f"pip install -e '.[{EXTRAS[name]}]'"
            raise UnknownEngineError(f"the engine {name!r} is not installed; install it with: {needed}") from None
        raise UnknownEngineError(f"unknown engine {short_repr(name)}; engines: {', '.join(ENGINES)}") from None


def usual(scene: Scene) -> str:
    """Return the engine that the window uses by default.

    It is `exact` on a `[surface]` without curl, else `pymunk`, or the first engine that models a scene that pymunk does
    not.
    """
    has_curl = scene.surface is not None and scene.surface.curl != 0.0  # `exact` needs parabolic paths
    if scene.surface is not None and not has_curl:
        return "exact"
    return USUAL if demands(Setup.of(scene)) <= ENGINES[USUAL].capabilities else next(iter(able(scene)), USUAL)


def able(start: Scene | Setup, settings: Settings | None = None) -> tuple[str, ...]:
    """Return the names of the engines that can run a scene."""
    setup = Setup.of(start)
    settings = setup.scene.solver if settings is None else settings
    return tuple(name for name, each in ENGINES.items() if not each.missing(setup, settings))


def start(start: Scene | Setup, engine: str = "pymunk", settings: Settings | None = None) -> Simulation:
    """Start a scene on an engine, or continue from a setup.

    Raises:
        UnknownEngineError: no engine has that name.
        Refusal: the engine does not support something that the scene or a setting needs.
    """
    setup = Setup.of(start)
    settings = setup.scene.solver if settings is None else settings
    chosen = engine_named(engine)
    try:
        return chosen.start(setup, settings)
    except Refusal as refusal:
        others = tuple(name for name in able(setup, settings) if name != engine)
        raise Refusal(engine, refusal.reasons, others) from None
