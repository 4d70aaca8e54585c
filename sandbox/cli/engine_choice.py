"""The engine of a command that names none, where a setting of the solver leaves exactly one that can run it."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from sandbox.engines.registry import ENGINES, able
from sandbox.scene.description.world import COMMON
from sandbox.scene.files.overrides import AddressError, parse_assignment
from sandbox.scene.scene import Scene

_SOLVER = "solver."


class EngineChoice(NamedTuple):
    """An engine that was found, and one line that says why."""

    engine: str
    sentence: str


def only_engine(
    scenes: Sequence[Scene], overrides: Sequence[str], sweeps: Sequence[tuple[str, Sequence[Any]]] = ()
) -> EngineChoice | None:
    """Return the one engine that can run all scenes, where a setting that not all engines have is set or swept.

    Args:
        scenes: with all values set.
        overrides: `KEY=VALUE`, as given to `--set`.
        sweeps: keys and their values, as given to `--sweep`.

    Returns:
        None where no such setting is set or swept, where several engines can run all scenes, or none can.
    """
    asked = [*filter(None, map(_assignment, overrides)), *((key, list(values)) for key, values in sweeps)]
    special = {key.removeprefix(_SOLVER): values for key, values in asked if _is_special(key)}
    if not special or not scenes:
        return None
    engines = set(ENGINES).intersection(*(able(scene) for scene in scenes))
    if len(engines) != 1:
        return None
    (engine,) = engines
    has = " and ".join(f"{key.replace('_', ' ')} {', '.join(map(str, values))}" for key, values in special.items())
    return EngineChoice(engine, f"engine: {engine}, the only one that has {has}")


def _is_special(key: str) -> bool:
    return key.startswith(_SOLVER) and key.removeprefix(_SOLVER) not in COMMON


def _assignment(text: str) -> tuple[str, list[Any]] | None:
    try:
        key, value = parse_assignment(text)
    except AddressError:  # a fault of the command line, and reported as one
        return None
    return key, [value]
