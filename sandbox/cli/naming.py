"""Naming: several things in one option, `NAME,NAME`, such as engines."""

import difflib
from collections.abc import Sequence

from sandbox.cli.reading import gathering
from sandbox.engines.registry import UnknownEngineError, able, engine_named
from sandbox.scene.faults import Fault
from sandbox.scene.model import Scene


def names_in(text: str) -> list[str]:
    """Return the names in `NAME,NAME`, each once."""
    return list(dict.fromkeys(name.strip() for name in text.split(",")))


def meant_or_known(name: str, known: Sequence[str], most: int = 5) -> str:
    """Return what a name that is none was likely meant to be, or else the first of those that there are."""
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"did you mean {close[0]!r}?"
    return f"there are {', '.join(map(repr, known[:most])) or 'none'}{' …' if len(known) > most else ''}"


def with_other_engine(scene: Scene) -> str:
    """Return what to add to a command whose engine refuses a scene; nothing where no engine can run it."""
    names = able(scene)
    return f"; add --engine {names[0]}" if names else ""


def plural(count: int, noun: str) -> str:
    """Return a count with its noun: `1 foul`, `2 fouls`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def engines_in(text: str | None, faults: list[Fault]) -> list[str] | None:
    """Return the engines that `--engine` names, None where it is left out; unknown ones are added to the faults."""
    names = None if text is None else names_in(text)
    for name in names or ():
        with gathering(faults, "--engine", (UnknownEngineError,)):
            engine_named(name)
    return names
