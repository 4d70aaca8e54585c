"""Changes of a draft that the property panel makes: keys set and removed, tables added and removed."""

from collections.abc import Collection, Mapping
from itertools import combinations_with_replacement
from typing import Any

from sandbox.scene.compile.scene import Scene
from sandbox.scene.editing.elements import (
    ElementKey,
    all_names,
    exists,
    material_users,
    name_of,
    renaming_changes,
    unique_name,
)
from sandbox.scene.errors import Location, SceneError
from sandbox.scene.files.toml_changes import AddElement, Change, RemoveElement, RemoveValue, SetValue
from sandbox.window.editor.joint_tools import PlacementError


def element_changes(
    scene: Scene, document: Mapping[str, Any], keys: Collection[ElementKey], name: str, value: Any
) -> list[Change]:
    """Return the changes that set a key of elements.

    Args:
        scene: the scene.
        document: its file as parsed TOML.
        keys: the elements.
        name: the key; of a table within the element with a dot, such as `kick.speed`.
        value: the new value; None removes the key.
    """
    changes, taken = _new_material(scene, name, value), all_names(scene)
    for key in keys:
        if name == "name" and value is not None:
            own = value if len(keys) == 1 else unique_name(value, taken)
            taken.add(own)
            changes += renaming_changes(scene, key, own)
        else:
            changes.append(_setting(document, key.location, name, value))
    return changes


def table_changes(scene: Scene, document: Mapping[str, Any], location: Location, name: str, value: Any) -> list[Change]:
    """Return the changes that set a key of a table at a location; an empty location is the scene itself."""
    if len(location) == 2 and isinstance(location[1], int):
        return element_changes(scene, document, [ElementKey(str(location[0]), location[1])], name, value)
    return [*_new_material(scene, name, value), _setting(document, location, name, value)]


def _new_material(scene: Scene, name: str, value: Any) -> list[Change]:
    """Return the change that adds a material if a key names one that the scene does not have."""
    known = {material.name for material in scene.materials}
    return [AddElement("material", {"name": value})] if name == "material" and value not in {None, *known} else []


def _setting(document: Mapping[str, Any], location: Location, name: str, value: Any) -> Change:
    """Return the change that sets a key, or removes it, with a table within the table that has no other key."""
    path = (*location, *name.split("."))
    if value is not None:
        return SetValue(path, value)
    table: Any = document
    for key in path[:-1]:
        table = table.get(key, {}) if isinstance(table, Mapping) else table[key]
    is_last = len(path) > len(location) + 1 and set(table) <= {path[-1]}
    return RemoveValue(path[:-1] if is_last else path)


def table_removal(scene: Scene, location: Location) -> list[Change]:
    """Return the changes that remove a table, such as `[surface]`, a part of a rigid body, or a material.

    They are empty if there is no such element.

    Raises:
        PlacementError: it is a material that something has.
    """
    if len(location) != 2 or not isinstance(location[1], int):
        also = [RemoveValue(("contact_models",))] if location == ("surface",) else []
        return [RemoveValue(location), *also]
    key = ElementKey(str(location[0]), location[1])
    if not exists(scene, key):
        return []
    users = material_users(scene, name_of(scene, key)) if key.table == "material" else []
    if users:
        more = f" and {len(users) - 1} more" if len(users) > 1 else ""
        user = f"{users[0].table} {name_of(scene, users[0])}"
        raise PlacementError(f"material {name_of(scene, key)} is used by {user}{more}")
    return [RemoveElement(key.table, key.index)]


def new_material(scene: Scene) -> AddElement:
    """Return the change that adds a material with a new name."""
    return AddElement("material", {"name": unique_name("material", all_names(scene))})


def new_pair(scene: Scene) -> AddElement:
    """Return the change that adds coefficients of two materials, or of one with itself, that have none yet.

    Raises:
        PlacementError: all pairs have coefficients.
    """
    known = {frozenset(pair.between) for pair in scene.pairs}
    pairs = combinations_with_replacement([each.name for each in scene.materials], 2)
    free = [(one, other) for one, other in pairs if frozenset((one, other)) not in known]
    if not free:
        raise PlacementError("all pairs of materials have coefficients")
    unlike = [(one, other) for one, other in free if one != other]
    return AddElement("pair", {"between": list((unlike or free)[0])})


def fault_text(error: SceneError, field: str = "") -> str:
    """Return the messages of at most two faults, with the path of each that is not at the edited field."""
    texts = [
        fault.message if not field or fault.path.endswith(field) else f"{fault.path}: {fault.message}"
        for fault in error.faults
    ]
    return "; ".join(list(dict.fromkeys(texts))[:2])
