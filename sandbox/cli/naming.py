"""Naming: several things in one option, `NAME,NAME`, such as engines."""

from sandbox.cli.reading import gathering
from sandbox.engines.registry import UnknownEngineError, engine_named
from sandbox.scene.faults import Fault


def names_in(text: str) -> list[str]:
    """Return the names in `NAME,NAME`, each once."""
    return list(dict.fromkeys(name.strip() for name in text.split(",")))


def engines_in(text: str | None, faults: list[Fault]) -> list[str] | None:
    """Return the engines that `--engine` names, None where it is left out; unknown ones are added to the faults."""
    names = None if text is None else names_in(text)
    for name in names or ():
        with gathering(faults, "--engine", (UnknownEngineError,)):
            engine_named(name)
    return names
