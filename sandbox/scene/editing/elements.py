"""Elements of a scene as an editor addresses them: by table and index, and how they refer to each other by name."""

from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from sandbox.scene.compile.bodies import Bodies, start_pose
from sandbox.scene.compile.generators import count_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.actions import Actuate, Timed
from sandbox.scene.description.base import BodySpec, Part
from sandbox.scene.description.bodies import Attached, Compound
from sandbox.scene.description.forces import Attraction
from sandbox.scene.description.joints import Joined
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.description.world import Pair
from sandbox.scene.errors import Location
from sandbox.scene.files.toml_changes import Change, RemoveElement, RemoveValue, SetValue

FIELD_OF = {str(field.alias): name for name, field in Scene.model_fields.items() if field.alias is not None}
"""Attribute of a scene, by the heading of its list of tables"""
STATIC_TABLES = ("plane", "wall", "post", "zone", "pocket", "sensor")


@dataclass(frozen=True, order=True)
class ElementKey:
    """Address of an element in a scene file."""

    table: str
    """heading of its list of tables, such as `ball`"""
    index: int
    """index in that list, from 0"""

    @property
    def location(self) -> tuple[str | int, ...]:
        """Location of its table in the document."""
        return self.table, self.index


def element_at(scene: SceneDescription, key: ElementKey) -> Part:
    """Return an element.

    Raises:
        IndexError: there is no such element.
    """
    found: Part = getattr(scene, FIELD_OF[key.table])[key.index]
    return found


def elements_of_table(scene: SceneDescription, table: str) -> Sequence[Part]:
    """Return the elements of a list of tables."""
    found: Sequence[Part] = getattr(scene, FIELD_OF[table])
    return found


def all_elements(scene: SceneDescription) -> Iterator[tuple[ElementKey, Part]]:
    """Yield all elements with their addresses, table by table."""
    for table in FIELD_OF:
        for index, element in enumerate(elements_of_table(scene, table)):
            yield ElementKey(table, index), element


def exists(scene: SceneDescription, key: ElementKey) -> bool:
    """Return whether a scene has an element."""
    return 0 <= key.index < len(elements_of_table(scene, key.table))


def with_elements(scene: Scene, replaced: Mapping[ElementKey, Part]) -> Scene:
    """Return a scene with some elements replaced, without validation; for previews."""
    tables: dict[str, list[Part]] = {}
    for key, element in replaced.items():
        tables.setdefault(key.table, list(elements_of_table(scene, key.table)))[key.index] = element
    return scene.model_copy(update={FIELD_OF[table]: tuple(parts) for table, parts in tables.items()})


def with_moved_bodies(scene: Scene, replaced: Mapping[ElementKey, BodySpec]) -> Scene:
    """Return a scene with bodies at other places and angles, without compiling the others again; for previews.

    Args:
        scene: the scene.
        replaced: the moved bodies; only their position and angle may differ.
    """
    before, preview = scene.bodies, with_elements(scene, replaced)
    position, angle, elements = before.position.copy(), before.angle.copy(), list(before.elements)
    for key, body in replaced.items():
        (index,) = bodies_of(scene, key)
        position[index], angle[index] = start_pose(body)
        elements[before.element[index]] = body
    moved = replace(before, position=position, angle=angle, elements=tuple(elements))
    for name in ("round", "all_round", "shapes", "number_of"):  # they depend on shapes and names only
        vars(moved)[name] = getattr(before, name)
    vars(preview)["bodies"], vars(preview)[BODY_RANGES] = moved, body_ranges(scene)
    return preview


def differ_in_poses_only(scene: Scene, other: Scene) -> bool:
    """Return whether two scenes have the same bodies and static elements, but for the places and angles of bodies.

    It recognises scenes of `with_moved_bodies`, by identity.
    """
    static = ("planes", "walls", "posts", "pockets", "zones", "sensors", "surface", "play")
    same_static = all(getattr(scene, name) is getattr(other, name) for name in static)
    return same_static and scene.bodies.shapes is other.bodies.shapes


def name_of(scene: SceneDescription, key: ElementKey) -> str:
    """Return the name of an element; its default name if it has none."""
    name = getattr(element_at(scene, key), "name", None)
    return default_name(key.table, key.index) if name is None else str(name)


BODY_RANGES = "_body_ranges"
"""Attribute of a scene that keeps its `BodyRanges`"""


class BodyRanges(NamedTuple):
    """Which bodies belong to which element."""

    of: Mapping[ElementKey, range]
    """indices of the bodies of each element that has bodies"""
    keys: tuple[ElementKey, ...]
    """these elements, in the order of their bodies"""
    ends: tuple[int, ...]
    """index after the last body of each"""


def body_ranges(scene: Scene) -> BodyRanges:
    """Return which bodies belong to which element, at the start of a scene; computed once for a scene."""
    known = vars(scene).get(BODY_RANGES)
    if isinstance(known, BodyRanges):
        return known
    of: dict[ElementKey, range] = {}
    begin = 0
    for table, sources in scene.kinds.items():
        for index, source in enumerate(sources):
            end = begin + count_of(source)
            of[ElementKey(table, index)] = range(begin, end)
            begin = end
    found = BodyRanges(of, tuple(of), tuple(bodies.stop for bodies in of.values()))
    vars(scene)[BODY_RANGES] = found  # beside the values that pydantic keeps, as cached properties are
    return found


def bodies_of(scene: Scene, key: ElementKey) -> range:
    """Return the indices of the bodies of an element; empty if it has none."""
    return body_ranges(scene).of.get(key, range(0))


def element_of_body(scene: Scene, body: int) -> ElementKey:
    """Return the element that a body belongs to.

    Raises:
        IndexError: there is no such body.
    """
    ranges = body_ranges(scene)
    return ranges.keys[bisect_right(ranges.ends, body)]


def body_names(scene: Scene, key: ElementKey) -> set[str]:
    """Return the names of the bodies of an element."""
    bodies: Bodies = scene.bodies
    return {bodies.names[k] for k in bodies_of(scene, key)}


def all_names(scene: Scene) -> set[str]:
    """Return the names of all bodies, static elements, materials, joints and other elements."""
    found = set(scene.bodies.names) | set(scene.fixed_names)
    return found | {name_of(scene, key) for key, element in all_elements(scene) if hasattr(element, "name")}


def unique_name(stem: str, taken: Collection[str]) -> str:
    """Return a name that is not taken: the stem itself, or with the first free number, such as `a 2`."""
    if stem and stem not in taken:
        return stem
    base, _, number = stem.rpartition(" ")
    base = base if base and number.isdecimal() else stem
    k = 2
    while f"{base} {k}" in taken:
        k += 1
    return f"{base} {k}"


def body_references(element: Part) -> Iterator[tuple[Location, str]]:
    """Yield where an element names a body, as a path within its table, and the name."""
    if isinstance(element, Joined):
        yield from ((("between", k), name) for k, name in enumerate(element.between))
    if isinstance(element, Attraction) and isinstance(element.toward, str):
        yield ("toward",), element.toward
    for key in ("body", "ball"):
        name = getattr(element, key, None)
        if isinstance(name, str):
            yield (key,), name
    tie = getattr(element, "tie", None)
    for end in () if tie is None else ("start", "end"):
        if getattr(tie, end) is not None:
            yield ("tie", end), getattr(tie, end)


def bodies_referred_to(element: Part) -> tuple[str, ...]:
    """Return the names of the bodies that an element refers to."""
    return tuple(name for _, name in body_references(element))


_TABLES_OF_REFERENCE = {
    "joint": ("joint",),
    "thrust": ("thrust",),
    "tyre": ("tyre",),
    "drive": ("drive",),
    "thing": ("wall", "post"),
}
"""Tables of the elements that an event names by a key"""


def _event_references(element: Part) -> Iterator[tuple[Location, tuple[str, ...], str]]:
    """Yield where an event names an element that is no body: path within the event, tables it can be in, and name."""
    if isinstance(element, Actuate):
        yield from ((("levels", name), ("joint",), name) for name in element.levels)
    elif isinstance(element, Timed):
        for key, tables in _TABLES_OF_REFERENCE.items():
            name = getattr(element, key, None)
            if isinstance(name, str):
                yield (key,), tables, name


def _material_references(element: Part) -> Iterator[tuple[Location, str]]:
    """Yield where an element names a material, as `body_references` does."""
    material = getattr(element, "material", None)
    if material is not None:
        yield ("material",), material
    if isinstance(element, Compound):
        for kind in ("balls", "boxes", "capsules", "polygons"):
            heading = str(Compound.model_fields[kind].alias)
            parts: Sequence[Attached] = getattr(element, kind)
            yield from (
                ((heading, k, "material"), part.material) for k, part in enumerate(parts) if part.material is not None
            )
    if isinstance(element, Pair):
        yield from ((("between", k), name) for k, name in enumerate(element.between))


def _play_references(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Yield where `[play]` names an element or a body, as a path in the document, and the name."""
    for key in ("arrows", "relaunch"):
        name = getattr(scene.play, key)
        if name is not None:
            yield ("play", key), name
    yield from ((("play", "part", k, "name"), part.name) for k, part in enumerate(scene.play.parts))


def removal_changes(scene: Scene, keys: Collection[ElementKey]) -> list[Change]:
    """Return the changes that remove elements, and with their bodies all elements that refer to them."""
    gone = set(keys)
    names = {name for key in keys for name in (*body_names(scene, key), name_of(scene, key))}
    while True:
        more = {
            key for key, element in all_elements(scene) if key not in gone and names & set(bodies_referred_to(element))
        }
        if not more:
            break
        gone |= more
        names |= {name for key in more for name in (*body_names(scene, key), name_of(scene, key))}
    removed, levels = {(key.table, name_of(scene, key)) for key in gone}, list[Change]()
    for key, element in all_elements(scene):
        references = list(_event_references(element))
        lost = [path for path, tables, name in references if any((table, name) in removed for table in tables)]
        if lost and len(lost) == len(references):
            gone.add(key)
        else:  # the other levels of the event remain
            levels += [RemoveValue((*key.location, *path)) for path in lost]
    roles = [RemoveValue(path[:3]) for path, name in _play_references(scene) if name in names]  # parts, or single keys
    return [*roles, *levels, *_kept_names(scene, gone), *(RemoveElement(key.table, key.index) for key in sorted(gone))]


def _kept_names(scene: Scene, gone: Collection[ElementKey]) -> Iterator[Change]:
    """Yield the changes that write default names which a removal would change, in tables where it matters.

    It matters where such a name is referred to, or could become that of an element whose name is in the file.
    """
    referred = {name for _, element in all_elements(scene) for name in bodies_referred_to(element)}
    referred |= {name for _, name in _play_references(scene)}
    referred |= {name for _, element in all_elements(scene) for _, _, name in _event_references(element)}
    for table in {key.table for key in gone}:
        first = min(key.index for key in gone if key.table == table)
        kept = [ElementKey(table, k) for k in range(len(elements_of_table(scene, table)))]
        kept = [key for key in kept if key not in gone]
        stated = {name for key in kept if (name := getattr(element_at(scene, key), "name", None)) is not None}
        defaults = {default_name(table, k) for k in range(len(kept))}
        renamed = [key for key in kept if key.index > first and _has_default_name(scene, key)]
        names = {name for key in renamed for name in (name_of(scene, key), *body_names(scene, key))}
        if names & referred or stated & defaults:
            yield from (SetValue((*key.location, "name"), name_of(scene, key)) for key in renamed)


def _has_default_name(scene: Scene, key: ElementKey) -> bool:
    element = element_at(scene, key)
    return "name" in type(element).model_fields and getattr(element, "name", None) is None


def renaming_changes(scene: Scene, key: ElementKey, name: str) -> list[Change]:
    """Return the changes that rename an element with its bodies, and the references to them."""
    before, is_material = name_of(scene, key), key.table == "material"
    references = _material_references if is_material else body_references
    renamed = {before: name} | {body: name + body.removeprefix(before) for body in body_names(scene, key)}
    changes: list[Change] = [SetValue((*key.location, "name"), name)]
    for other, element in all_elements(scene):
        found = [(path, renamed[name]) for path, name in references(element) if name in renamed]
        changes += [SetValue((*other.location, *path), new) for path, new in found]
        for path, tables, each in _event_references(element):
            if key.table in tables and each == before:
                where = (*other.location, *path)
                if isinstance(element, Actuate):  # the name is a key
                    changes += [RemoveValue(where), SetValue((*where[:-1], name), element.levels[each])]
                else:
                    changes.append(SetValue(where, name))
    roles = () if is_material else _play_references(scene)
    return [*changes, *(SetValue(path, renamed[each]) for path, each in roles if each in renamed)]


def naming_changes(scene: Scene, body: int) -> list[Change]:
    """Return the changes that write the name of the element of a body, for a new reference to the body.

    They are empty if the file has the name. Default names change with the order of elements.
    """
    key = element_of_body(scene, body)
    is_named = getattr(element_at(scene, key), "name", None) is not None
    return [] if is_named else [SetValue((*key.location, "name"), name_of(scene, key))]


def material_users(scene: Scene, material: str) -> list[ElementKey]:
    """Return the elements that are of a material, and the pairs that name it."""
    return [
        key for key, element in all_elements(scene) if material in (name for _, name in _material_references(element))
    ]


def table_values(element: Part) -> dict[str, Any]:
    """Return the values of an element's table, without defaults."""
    return element.model_dump(mode="json", by_alias=True, exclude_defaults=True)


def describe_elements(keys: Sequence[ElementKey]) -> str:
    """Return the number of elements in words: `a ball`, `3 balls`, `4 elements`."""
    tables = {key.table for key in keys}
    word = tables.pop() if len(tables) == 1 else "element"
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}" if len(keys) == 1 else f"{len(keys)} {word}s"
