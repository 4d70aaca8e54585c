"""Presets: tables of games that are expanded into primitive elements before the scene is read."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part
from sandbox.scene.description.game_tables import PRESETS, GameTable, game_table
from sandbox.scene.description.world import Pair
from sandbox.scene.errors import LocatedMessage, Location, PartError
from sandbox.scene.files.document import read_model, to_document
from sandbox.scene.files.overrides import AddressError, assign, parse_path


@dataclass(frozen=True, kw_only=True)
class Preset(GameTable):
    """Table of a game that expands to elements. Two tables that expand together have the same functions."""

    faults_of: Callable[[Scene], Iterable[LocatedMessage]]
    """returns the reasons why a scene with the table cannot be expanded"""
    expanded: Callable[[Scene], Scene]
    """returns a scene, which has no faults, with the table replaced by its elements"""
    origins: Callable[[Scene], dict[str, Location]] | None = None
    """returns the location within the table of the origin of each element, by the name of the element"""
    excludes: tuple[str, ...] = ()
    """tables of other presets that cannot occur in the same scene"""


Assignment = tuple[str, Any]

_LISTS = {field.alias for name, field in Scene.model_fields.items() if field.alias is not None}
"""Tables that may occur several times, to which a preset may add."""


def expanded_document(document: dict[str, Any]) -> dict[str, Any] | None:
    """Return a document with its presets expanded; None if it has faults."""
    try:
        scene = read_model(document)
        return None if any(stated_faults_of(scene)) else to_document(expanded(scene))
    except ValueError:  # `from_document` reports it with all other faults
        return None


def apply_preset_overrides(
    document: dict[str, Any], assignments: list[Assignment]
) -> tuple[dict[str, Any], set[Location], list[Assignment], list[tuple[str, str]]]:
    """Apply the overrides of presets and of values that take precedence over presets.

    Returns:
        The document; the locations that were set; the assignments to elements that a preset may create; path and
        message of each other assignment, whose path into a preset does not exist.
    """
    wrong: list[tuple[str, str]] = []
    changed: set[Location] = set()
    later: list[Assignment] = []
    for path, value in assignments:
        try:
            if parse_path(path)[0] in _LISTS:
                raise AddressError(path)
            document, location = assign(document, path, value)
            changed.add(location)
        except AddressError as error:
            if any(key in document and _is_within(path, key) for key in PRESETS):
                wrong.append((path, str(error)))
            else:
                later.append((path, value))
    return document, changed, later, wrong


def _is_within(path: str, key: str) -> bool:
    """Return whether a path leads into a table."""
    return path == key or path.startswith((f"{key}.", f"{key}["))


def stated_location(location: Location, document: dict[str, Any], stated: dict[str, Any]) -> Location:
    """Return the location in the stated document for a location in the expanded one.

    It is the same location, except for an element that a preset created: then it is that of the preset or of its part.
    """
    if not _is_created(location, stated):
        return location
    presets = presets_of(stated)
    for key, preset in presets.items():
        if preset.origins is not None:
            elements, index = document.get(str(location[0])), location[1] if len(location) > 1 else None
            name = elements[index].get("name") if isinstance(elements, list) and isinstance(index, int) else None
            return preset.origins(read_model(stated)).get(str(name), (key,))
    return (next(iter(presets), PRESETS[0]),)


def _is_created(location: Location, stated: dict[str, Any]) -> bool:
    """Return whether a location is of an element that a preset created."""
    if not location:
        return False
    elements = stated.get(str(location[0]))
    if isinstance(elements, list) and len(location) > 1 and isinstance(location[1], int):
        return location[1] >= len(elements)
    return elements is None


def faults_of(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the reasons why presets of a scene cannot be expanded."""
    found = False
    for fault in stated_faults_of(scene):
        found = True
        yield fault
    if not found:
        try:
            expanded(scene)
        except PartError as error:
            preset = next(iter(presets_of(_stated(scene))))
            for wrong in error.faults:
                path = f"{wrong.file.lower()}.{wrong.path}"
                yield (preset,), f"one of its parts is out of range: {path}: {wrong.message}"


def stated_faults_of(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of presets that are found without expanding them."""
    presets = presets_of(_stated(scene))
    for key, preset in presets.items():
        for other in preset.excludes:
            if other in presets:
                yield (key,), f"cannot be combined with [{other}]; remove one of the two"
    for find in dict.fromkeys(preset.faults_of for preset in presets.values()):
        yield from find(scene)


def expanded(scene: Scene) -> Scene:
    """Return the scene with valid presets expanded into primitives; a scene without presets unchanged.

    Raises:
        PartError: values that are valid by themselves lead to an invalid primitive.
    """
    for expand in dict.fromkeys(preset.expanded for preset in presets_of(_stated(scene)).values()):
        scene = expand(scene)
    return scene


def presets_of(keys: Iterable[str]) -> dict[str, Preset]:
    """Return the presets among the keys of a document, in the order of expansion. Their games are imported."""
    stated = set(keys)
    tables = {key: game_table(key) for key in PRESETS if key in stated}
    return {key: table for key, table in tables.items() if isinstance(table, Preset)}


def _stated(scene: Scene) -> list[str]:
    """Return the keys of the presets that a scene has."""
    return [key for key in PRESETS if getattr(scene, key) is not None]


Stated = TypeVar("Stated", bound=Part)


def stated(part: Stated, values: dict[str, Any]) -> Stated:
    """Return a part with values for the keys that it does not state itself."""
    return part.model_copy(update={key: value for key, value in values.items() if key not in part.model_fields_set})


def added(elements: Sequence[Any], preset_elements: Sequence[Any]) -> tuple[Any, ...]:
    """Return the scene's own elements, and those of a preset that have other names."""
    taken = {each.name for each in elements}
    return (*elements, *(each for each in preset_elements if each.name not in taken))


def paired(pairs: Sequence[Pair], preset_pairs: Iterable[Pair]) -> tuple[Pair, ...]:
    """Return the scene's own pairs of materials, and those of a preset for other pairs."""
    taken = {frozenset(pair.between) for pair in pairs}
    return (*pairs, *(pair for pair in preset_pairs if frozenset(pair.between) not in taken))
