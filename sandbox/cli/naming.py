"""Naming: several things in one option, `NAME,NAME`, such as engines."""

import difflib
from collections.abc import Sequence

from sandbox.cli.reading import gathering
from sandbox.echo import short_repr
from sandbox.engines.registry import ENGINES, UnknownEngineError, able, engine_named
from sandbox.scene.errors import Fault
from sandbox.scene.scene import Scene

MAX_UNKNOWN = 5
"""Unknown names of an option that are listed."""


def names_in(text: str) -> list[str]:
    """Return the names in `NAME,NAME`, each once."""
    return list(dict.fromkeys(name.strip() for name in text.split(",")))


def meant_or_known(name: str, known: Sequence[str], most: int = 5) -> str:
    """Return what a name that is none was likely meant to be, or else the first of those that there are."""
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"did you mean {short_repr(close[0])}?"
    return f"known names: {', '.join(map(repr, known[:most])) or 'none'}{' …' if len(known) > most else ''}"


def with_other_engine(scene: Scene, is_chosen: bool = False) -> str:
    """Return the option that makes a command work whose engine refuses a scene; empty if no engine can run it.

    Args:
        scene: the scene, with all values set.
        is_chosen: the command has an option --engine already.
    """
    names = able(scene)
    return f"; {'use' if is_chosen else 'add'} --engine {names[0]}" if names else ""


def plural(count: int, noun: str) -> str:
    """Return a count with its noun: `1 foul`, `2 fouls`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def engines_in(text: str | None, faults: list[Fault]) -> list[str] | None:
    """Return the engines that `--engine` names, None where it is left out; unknown ones are added to the faults."""
    names = None if text is None else names_in(text)
    unknown = [name for name in names or () if name not in ENGINES]
    for name in unknown[:MAX_UNKNOWN]:
        with gathering(faults, "--engine", (UnknownEngineError,)):
            engine_named(name)
    faults += further_unknown("--engine", len(unknown))
    return names


def further_unknown(option: str, count: int) -> list[Fault]:
    """Return the fault that stands for those names of an option beyond `MAX_UNKNOWN` that are unknown, if there are."""
    more = count - MAX_UNKNOWN
    return [Fault(option, None, "", f"{more:,} more names are unknown")] if more > 0 else []
