"""ENGINES: every engine by name."""

from sandbox.engines.contract import Engine, Refusal, Simulation
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.native.engine import PymunkEngine
from sandbox.engines.reference.engine import ReferenceEngine
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings

ENGINES: dict[str, Engine] = {
    "pymunk": PymunkEngine(),
    "exact": ExactEngine(),
    "reference": ReferenceEngine(),
}


USUAL = "pymunk"
"""The engine of whoever does not say."""


class UnknownEngineError(ValueError):
    """No engine has that name."""


def engine_named(name: str) -> Engine:
    """Return an engine by name.

    Raises:
        UnknownEngineError: with the names there are.
    """
    try:
        return ENGINES[name]
    except KeyError:
        raise UnknownEngineError(f"no engine {name!r}; engines: {', '.join(ENGINES)}") from None


def usual(scene: Scene) -> str:
    """Return the engine that a scene is played on where nobody has said: of a table the one that is exact."""
    bends = scene.surface is not None and scene.surface.curl != 0.0  # which has no parabolas
    return "exact" if scene.surface is not None and not bends else USUAL


def able(scene: Scene, settings: Settings | None = None) -> tuple[str, ...]:
    """Return the names of the engines that can run a scene."""
    settings = scene.solver if settings is None else settings
    return tuple(name for name, each in ENGINES.items() if not each.missing(scene, settings))


def start(scene: Scene, engine: str = "pymunk", settings: Settings | None = None) -> Simulation:
    """Start a scene on an engine.

    Raises:
        UnknownEngineError: no engine has that name.
        Refusal: the engine lacks something, with the engines that do not.
    """
    settings = scene.solver if settings is None else settings
    chosen = engine_named(engine)
    missing = chosen.missing(scene, settings)
    if missing:
        raise Refusal(engine, missing, able(scene, settings))
    return chosen.start(scene, settings)
