"""Presets: what of a document stands for other parts of it, written out before anything else is made of it."""

from typing import Any

from sandbox.scene.address import AddressError, assign, parse_path
from sandbox.scene.document import read_model, to_document
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene

KEYS = ("billiards", "terrain", "artillery")
"""The tables that stand for others."""

Assignment = tuple[str, Any]

_LISTS = {field.alias for field in Scene.model_fields.values() if field.alias is not None}
"""Tables of which there are many: a preset may add to them."""


def written_out(document: dict[str, Any]) -> dict[str, Any] | None:
    """Return the document of primitives that one with a preset stands for; None where it has faults."""
    from sandbox.scene.expanding import expanded, faults_of  # few scenes need it

    try:
        scene = read_model(document)
    except (RecursionError, ValueError):  # told, with all others, by who reads it next
        return None
    return None if any(faults_of(scene)) else to_document(expanded(scene))


def set_first(
    document: dict[str, Any], assignments: list[Assignment]
) -> tuple[dict[str, Any], set[Location], list[Assignment]]:
    """Set what a preset is made by, or is outranked by.

    Returns:
        The document, what was set in it, and the assignments that are of what a preset may yet write out.
    """
    changed: set[Location] = set()
    later: list[Assignment] = []
    for path, value in assignments:
        try:
            if parse_path(path)[0] in _LISTS:
                raise AddressError(path)
            document, location = assign(document, path, value)
            changed.add(location)
        except AddressError:
            later.append((path, value))
    return document, changed, later


def has_presets(document: dict[str, Any], assignments: list[Assignment]) -> bool:
    """Tell whether a document has presets, or is to be given some."""
    return any(key in document or any(path.startswith(key) for path, _ in assignments) for key in KEYS)


def writer(stated: dict[str, Any]) -> Location:
    """Return where the preset stands that wrote into a document what was not stated in it."""
    return (next((key for key in KEYS if key in stated), KEYS[0]),)


def is_written(location: Location, stated: dict[str, Any]) -> bool:
    """Tell whether a location is of what a preset wrote into a document, not of what was stated in it."""
    if not location:
        return False
    here = stated.get(str(location[0]))
    if isinstance(here, list) and len(location) > 1 and isinstance(location[1], int):
        return location[1] >= len(here)
    return here is None
