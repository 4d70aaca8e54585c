"""Elements of a scene as an editor addresses them: by table and index, and how they refer to each other by name."""

from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from sandbox.scene.compile.bodies import Bodies, centre_of
from sandbox.scene.compile.generators import count_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Part
from sandbox.scene.description.bodies import Attached, Compound
from sandbox.scene.description.forces import Attraction
from sandbox.scene.description.joints import Joined
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.description.world import Pair
from sandbox.scene.errors import Location
from sandbox.scene.files.toml_changes import Change, RemoveElement, SetValue

FIELD_OF = {str(field.alias): name for name, field in Scene.model_fields.items() if field.alias is not None}
"""Attribute of a scene, by the heading of its list of tables"""
STATIC_TABLES = ("plane", "wall", "post", "zone", "pocket")


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
    """Tell whether a scene has an element."""
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
        position[index], angle[index] = centre_of(body), body.angle
        elements[before.element[index]] = body
    moved = replace(before, position=position, angle=angle, elements=tuple(elements))
    for name in ("round", "all_round", "shapes", "number_of"):  # they depend on shapes and names only
        vars(moved)[name] = getattr(before, name)
    vars(preview)["bodies"], vars(preview)[BODY_RANGES] = moved, body_ranges(scene)
    return preview


def differ_in_places_only(scene: Scene, other: Scene) -> bool:
    """Tell whether two scenes have the same bodies and static elements, but for the places and angles of bodies.

    It recognises scenes of `with_moved_bodies`, by identity.
    """
    static = ("planes", "walls", "posts", "pockets", "zones", "surface", "play")
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


def removal(scene: Scene, keys: Collection[ElementKey]) -> list[Change]:
    """Return the changes that remove elements, and with their bodies all elements that refer to them."""
    gone = set(keys)
    names = {name for key in keys for name in body_names(scene, key)}
    while True:
        more = {
            key for key, element in all_elements(scene) if key not in gone and names & set(bodies_referred_to(element))
        }
        if not more:
            break
        gone |= more
        names |= {name for key in more for name in body_names(scene, key)}
    return [RemoveElement(key.table, key.index) for key in sorted(gone)]


def renaming(scene: Scene, key: ElementKey, name: str) -> list[Change]:
    """Return the changes that rename an element, and the references to it."""
    before, references = name_of(scene, key), _material_references if key.table == "material" else body_references
    changes: list[Change] = [SetValue((*key.location, "name"), name)]
    for other, element in all_elements(scene):
        changes += [SetValue((*other.location, *path), name) for path, found in references(element) if found == before]
    return changes


def naming(scene: Scene, body: int) -> list[Change]:
    """Return the changes that write the name of a body, for a new reference to it; empty if the file has its name.

    Default names change with the order of elements.
    """
    key = element_of_body(scene, body)
    is_default = getattr(element_at(scene, key), "name", None) is None
    name = scene.bodies.names[body]
    return renaming(scene, key, name) if is_default and name == name_of(scene, key) else []


def material_users(scene: Scene, material: str) -> list[ElementKey]:
    """Return the elements that are of a material, and the pairs that name it."""
    return [
        key for key, element in all_elements(scene) if material in (name for _, name in _material_references(element))
    ]


def table_values(element: Part) -> dict[str, Any]:
    """Return the values of an element's table, without defaults."""
    return element.model_dump(mode="json", by_alias=True, exclude_defaults=True)
