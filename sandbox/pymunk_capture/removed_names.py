"""Errors of games that use a name that their version of pymunk had and pymunk 7 has not."""

import linecache
import re
import traceback
from collections.abc import KeysView
from pathlib import Path

import pymunk

from sandbox.scene.errors import Fault

OPTION = "--pymunk6"
"""Option of commands that run a game, which gives it the names of pymunk 6"""

HANDLERS = ("add_collision_handler", "add_wildcard_collision_handler", "add_default_collision_handler")

VIEWS = re.compile(r"\b\w+\.(shapes|bodies|constraints)\b")
"""Attributes that are lists or sets in pymunk 6, and views in pymunk 7"""

OLDER_VECTOR_NAMES = {
    "get_length": "Vec2d.length",
    "get_angle": "Vec2d.angle",
    "get_angle_degrees": "Vec2d.angle_degrees",
    "rotate": "Vec2d.rotated",
    "rotate_degrees": "Vec2d.rotated_degrees",
    "normalize_return_length": "Vec2d.normalized_and_length",
}
"""Names that pymunk 6 removed already, and what it has in their place; from the changelog of pymunk 6.0.0"""

OLDER_MODULE_NAMES = {"inf": 'float("inf")', "constraint": "pymunk.constraints"}
"""As above, of the module"""

_CHANGES_VECTOR = "it changes a Vec2d, as before pymunk 6; make another in its place"
_PASSES_CALLBACKS = (
    "it passes callbacks to Space.add_collision_handler, which takes two types in pymunk 6; set the callbacks of the "
    "handler that it returns"
)
OLDER_USES = {
    "Vec2d.__new__() missing": "it makes a Vec2d of one value or none, as before pymunk 6; use Vec2d(x, y)",
    "'Vec2d' object has no setter": _CHANGES_VECTOR,
    "'Vec2d' object does not support item assignment": _CHANGES_VECTOR,
    "Unsupported type  <class 'list'>": "it adds or removes a list, as before pymunk 6; use space.add(*objects)",
    "add_collision_handler() got an unexpected keyword": _PASSES_CALLBACKS,
    "add_collision_handler() takes 3 positional": _PASSES_CALLBACKS,
}
"""Parts of the messages of errors that uses from before pymunk 6 cause, and what the program does"""


def removed_name(error: BaseException, game: str) -> Fault | None:
    """Return where and why a program has failed because of a name of an earlier pymunk; None if it has not.

    Args:
        error: the exception that ended the program.
        game: file of the program, as the user named it.

    Returns:
        The line that uses the name, and what to do. Other files than the game are named from the working folder.
    """
    others = ("<frozen", str(Path(pymunk.__file__).parent), str(Path(__file__).parents[1]))  # the import system
    frames = [each for each in traceback.extract_tb(error.__traceback__) if not each.filename.startswith(others)]
    if not frames:
        return None
    file, line = frames[-1].filename, frames[-1].lineno or 0
    sentence = _missing_attribute(error) or _missing_import(error) or _older_use(error)
    sentence = sentence or _missing_list(error, file, line)
    if sentence is None:
        return None
    path, folder = Path(file).resolve(), Path.cwd()
    if path == Path(game).resolve():
        file = game
    elif path.is_relative_to(folder):
        file = str(path.relative_to(folder))
    return Fault(file, line, "", sentence)


def _missing_attribute(error: BaseException) -> str | None:
    if not isinstance(error, AttributeError) or error.name is None:
        return None
    owner, name = error.obj, error.name
    if name in HANDLERS and (isinstance(owner, pymunk.Space) or _is_class(owner, pymunk.Space)):
        return _dropped(f"Space.{name}", "Space.on_collision")
    if owner is pymunk and name in ("CollisionHandler", "collision_handler"):
        return _dropped(f"pymunk.{name}", "Space.on_collision")
    if owner is pymunk and name in OLDER_MODULE_NAMES:
        return _older(f"pymunk.{name}", OLDER_MODULE_NAMES[name])
    if name in OLDER_VECTOR_NAMES and (isinstance(owner, pymunk.Vec2d) or _is_class(owner, pymunk.Vec2d)):
        return _older(f"Vec2d.{name}", OLDER_VECTOR_NAMES[name])
    return None


def _is_class(owner: object, base: type) -> bool:
    return isinstance(owner, type) and issubclass(owner, base)


def _missing_import(error: BaseException) -> str | None:
    if not isinstance(error, ImportError):
        return None
    if error.name == "pymunk.collision_handler":
        return _dropped("pymunk.collision_handler", "Space.on_collision")
    if error.name == "pymunk" and "'CollisionHandler'" in str(error):
        return _dropped("pymunk.CollisionHandler", "Space.on_collision")
    if error.name == "pymunk.constraint" or (error.name == "pymunk" and "'constraint'" in str(error)):
        return _older("pymunk.constraint", OLDER_MODULE_NAMES["constraint"])
    return None


def _older_use(error: BaseException) -> str | None:
    text = str(error)
    for begin, sentence in OLDER_USES.items():
        if begin in text:
            return sentence
    return None


def _missing_list(error: BaseException, file: str, line: int) -> str | None:
    """Return the sentence on a view of pymunk 7 that is used as the list or set of pymunk 6.

    Python's errors do not name the attribute, so that the line of the program does.
    """
    is_view = (isinstance(error, AttributeError) and isinstance(error.obj, KeysView)) or (
        isinstance(error, TypeError) and ("dict_keys" in str(error) or "KeysView" in str(error))
    )
    changes = isinstance(error, RuntimeError) and "changed size during iteration" in str(error)
    found = VIEWS.search(linecache.getline(file, line))
    if found is None or not (is_view or changes):
        return None
    return f"it uses {found[0]} as a list or set, which is a view in pymunk 7; add {OPTION}, or use list({found[0]})"


def _dropped(name: str, successor: str) -> str:
    return f"it uses {name}, which pymunk 7 dropped; add {OPTION}, or use {successor}"


def _older(name: str, successor: str) -> str:
    return f"it uses {name}, which pymunk 6 dropped already; use {successor}"
