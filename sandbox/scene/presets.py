"""Presets: what of a document stands for other parts of it, written out before anything else is made of it."""

from collections.abc import Iterable
from typing import Any

from sandbox.scene.address import AddressError, assign, parse_path
from sandbox.scene.document import read_model, to_document
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene

KEYS = ("billiards", "pinball", "terrain", "artillery")
"""Their tables."""

Assignment = tuple[str, Any]

_LISTS = {field.alias for name, field in Scene.model_fields.items() if field.alias is not None}
"""Tables of which there are many: a preset may add to them."""


def has_preset(document: dict[str, Any], paths: Iterable[str] = ()) -> bool:
    """Tell whether a document has a preset, or gets one by what is set in it."""
    return any(key in document for key in KEYS) or any(path.startswith(KEYS) for path in paths)


def written_out(document: dict[str, Any]) -> dict[str, Any] | None:
    """Return the document of primitives that one with presets stands for; None where it has faults."""
    from sandbox.scene.expanding import expanded, faults_of  # few scenes need it

    try:
        scene = read_model(document)
    except (RecursionError, ValueError):  # told, with all others, by who reads it next
        return None
    return None if any(faults_of(scene)) else to_document(expanded(scene))


def set_first(
    document: dict[str, Any], assignments: list[Assignment]
) -> tuple[dict[str, Any], set[Location], list[Assignment], list[str]]:
    """Set what a preset is made by, or is outranked by.

    Returns:
        The document, what was set in it, the assignments that are of what a preset may yet write out, and why others,
        which are of a preset itself, lead nowhere.
    """
    wrong: list[str] = []
    changed: set[Location] = set()
    later: list[Assignment] = []
    for path, value in assignments:
        try:
            if parse_path(path)[0] in _LISTS:
                raise AddressError(path)
            document, location = assign(document, path, value)
            changed.add(location)
        except AddressError as error:
            if any(key in document and _begins(path, key) for key in KEYS):
                wrong.append(str(error))
            else:
                later.append((path, value))
    return document, changed, later, wrong


def _begins(path: str, key: str) -> bool:
    """Tell whether a path leads into a table."""
    return path == key or path.startswith((f"{key}.", f"{key}["))


def place_of(location: Location, document: dict[str, Any], stated: dict[str, Any]) -> Location:
    """Return where in a stated document stands what a location of the written one is of.

    That is the location itself, but of what a preset wrote: then it is the preset, or its element.
    """
    if not _is_written(location, stated):
        return location
    if "pinball" not in stated:
        return (next((key for key in KEYS if key in stated), KEYS[0]),)
    from sandbox.scene.pinball.expanding import origins

    those, number = document.get(str(location[0])), location[1] if len(location) > 1 else None
    name = those[number].get("name") if isinstance(those, list) and isinstance(number, int) else None
    return origins(read_model(stated)).get(str(name), ("pinball",))


def _is_written(location: Location, stated: dict[str, Any]) -> bool:
    """Tell whether a location is of what a preset wrote into a document, not of what was stated in it."""
    if not location:
        return False
    here = stated.get(str(location[0]))
    if isinstance(here, list) and len(location) > 1 and isinstance(location[1], int):
        return location[1] >= len(here)
    return here is None
