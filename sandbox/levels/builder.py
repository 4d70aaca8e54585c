"""Builds a scene from the shapes of a level: names, roles, keys, the text with its comments, and faults by element."""

import difflib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

from sandbox.echo import MAX_NAMED, printable, short_repr, shorten
from sandbox.levels.merging import merge_boxes
from sandbox.levels.outlines import (
    CircleShape,
    LevelShape,
    LineShape,
    PolygonShape,
    RectangleShape,
    is_straight,
    without_repeats,
)
from sandbox.levels.scene_text import LevelBlock, LevelElement, clean_text, compose_scene, toml_text
from sandbox.levels.tables import (
    MODELS,
    PART_MODELS,
    LengthRounding,
    LevelRole,
    bounds_of,
    colour_values,
    keys_of,
    parse_value,
    table_of,
)
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import MAX_POSITION, Part, Point
from sandbox.scene.description.bodies import (
    MAX_CORNERS,
    MAX_PARTS,
)
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.geometry.polygon import outline_fault

ROLES: tuple[str, ...] = get_args(LevelRole)

Origin = Literal["lower-left", "upper-left", "centre"]
"""Point of the page, or of the map, at (0, 0) of the scene."""
ORIGINS: tuple[Origin, ...] = get_args(Origin)

MAX_SHAPES = 20_000
"""Shapes of a level, after the expansion of copies."""
MAX_POINTS = 100_000
"""Corners of all shapes of a level; as TOML they take some 3 MiB."""


@dataclass(frozen=True, kw_only=True)
class LevelOptions:
    """How a level becomes a scene."""

    scale: float = 0.01
    """m for each user unit of a drawing, or for each pixel of a map"""
    tolerance: float = 0.25
    """largest distance of a polygon from the curve that it replaces, in user units or pixels"""
    gravity: tuple[float, float] | None = None
    """m/s²; default: the level's own, else (0, −9.81)"""
    origin: Origin = "lower-left"
    """point of the page, or of the map, at (0, 0) of the scene"""

    def faults(self) -> list[Fault]:
        """Return the faults of the values, named as options of the command."""
        found = []
        for name, value, most in (("scale", self.scale, 1e9), ("tolerance", self.tolerance, 1e9)):
            if not 1e-9 <= value <= most:  # also refuses NaN
                found.append(Fault.of(f"--{name}", f"must be between 1e-9 and {most:g}, is {value:g}"))
        if self.gravity is not None and not all(abs(each) <= 1e9 for each in self.gravity):
            found.append(Fault.of("--gravity", "must be two numbers between -1e9 and 1e9, m/s²"))
        if self.origin not in ORIGINS:
            message = f"must be one of {', '.join(ORIGINS)}; is {short_repr(self.origin)}"
            found.append(Fault.of("--origin", message))
        return found


@dataclass(frozen=True)
class ImportedLevel:
    """Result of an import."""

    scene: Scene
    text: str
    """the scene as TOML, with comments that name the elements of the level"""
    warnings: tuple[Fault, ...]
    """parts of the level that the scene does not have, or has only approximately"""
    counts: Mapping[str, int]
    """number of elements by table of the scene"""


@dataclass(frozen=True)
class ShapeKeys:
    """Keys that an element, and the groups around it, give to its shapes."""

    own: Mapping[str, str] = field(default_factory=dict)
    inherited: Mapping[str, str] = field(default_factory=dict)

    def inner(self, own: Mapping[str, str]) -> "ShapeKeys":
        """Return the keys of a child with keys of its own, which take precedence."""
        return ShapeKeys(own, self.all)

    @property
    def all(self) -> dict[str, str]:
        """The keys in force."""
        return {**self.inherited, **self.own}


class LevelPiece(NamedTuple):
    """One shape with its keys."""

    shape: LevelShape
    keys: ShapeKeys
    colour: str | None
    element: LevelElement


_SYNONYMS = {"color": "colour", "bounce": "restitution", "bounciness": "restitution", "elasticity": "restitution"}
"""Keys of a scene by the words of other programs."""


def normal_key(text: str) -> str:
    """Return the key of a scene for the name of an attribute or property, such as `surface_speed` for Surface-Speed."""
    key = text.strip().lower().replace("-", "_").replace(" ", "_")
    return _SYNONYMS.get(key, key)


def role_of_words(text: str) -> str | None:
    """Return the role that one of the words of a label, class or layer names; None if none does, or if several differ.

    `compound` is a role of groups.
    """
    known = {"sensor": "zone", "trigger": "zone", **{role: role for role in (*ROLES, "compound")}}
    words = {known[word] for word in re.findall(r"[a-z]+", text.lower()) if word in known}
    return words.pop() if len(words) == 1 else None


class LevelBuilder:
    """Collects the shapes of a level in metres, and makes the scene.

    Faults are collected, so that all of them are reported at once.
    """

    def __init__(self, file: str, options: LevelOptions, unit: str) -> None:
        self.file = file
        self.options = options
        self.title = ""
        self.about = ""
        self.gravity: tuple[float, float] | None = None
        """the level's own, m/s²"""
        self.warnings: list[Fault] = []
        self.faults: list[Fault] = []
        self._unit = unit
        self._blocks: list[LevelBlock] = []
        self._names: set[str] = set()
        self._copies: Counter[str] = Counter()
        self._materials: dict[str, None] = {}
        self._points = self._shapes = 0
        self._rounding = LengthRounding(options.scale)

    def warn(self, element: LevelElement, message: str) -> None:
        """Note a part of the level that the scene has not, or only approximately."""
        self.warnings.append(Fault(element.file or self.file, element.line, element.path, message))

    def fault(self, element: LevelElement, message: str) -> None:
        """Note a fault; `build` raises it."""
        self.faults.append(Fault(element.file or self.file, element.line, element.path, message))

    def warn_unknown(self, keys: ShapeKeys, element: LevelElement) -> None:
        """Note own keys of a group that no table has."""
        known = set[str]().union(*map(keys_of, MODELS.values()))
        for key in keys.own:
            if key not in known:
                close = difflib.get_close_matches(key, known, n=1)
                hint = f"did you mean {close[0]!r}?" if close else "it has no effect"
                self.warn(element, f"{short_repr(key)} is no key of a scene; {hint}")

    def add(
        self, pieces: Sequence[LevelPiece], role: LevelRole, name: str, keys: ShapeKeys, body_element: LevelElement
    ) -> None:
        """Add shapes: static objects and zones one by one, the shapes of a dynamic element as one rigid body.

        Args:
            pieces: the shapes.
            role: what they become.
            name: label of the element; becomes unique.
            keys: keys of a body of several shapes.
            body_element: element of such a body.
        """
        if role == "ignore":
            return
        good = [piece for piece in map(self._checked, pieces) if piece is not None]
        if role == "dynamic" and len(good) > 1:
            self._add_compound(good, name, keys, body_element)
            return
        for shape, piece_keys, colour, element in good:
            if role == "dynamic" and isinstance(shape, LineShape):
                self.fault(element, "a line has no area and cannot be a dynamic body; close it, or make it static")
                continue
            table, values = table_of(shape, role, self._rounding)
            if table == "zone" and values.get("thickness") == 0.0:
                self.fault(element, "a line has no area and cannot be a zone; close it, or give it a stroke width")
                continue
            known = self._values(piece_keys, table, element)
            named = {"name": self._unique(name or table)}
            self._blocks.append(LevelBlock(table, named | values | colour_values(colour) | known, element))

    def _add_compound(self, pieces: Sequence[LevelPiece], name: str, keys: ShapeKeys, element: LevelElement) -> None:
        """Add a rigid body of several shapes, with its position at the centre of their bounding box."""
        lines = [piece.element for piece in pieces if isinstance(piece.shape, LineShape)]
        for line in lines:
            self.fault(line, "a line has no area and cannot be part of a dynamic body; close it, or make it static")
        if len(pieces) > MAX_PARTS:
            self.fault(element, f"the body has {len(pieces):,} shapes; the limit is {MAX_PARTS:,}")
        if lines or len(pieces) > MAX_PARTS:
            return
        corners = [corner for piece in pieces for corner in bounds_of(piece.shape)]
        (x0, y0), (x1, y1) = (tuple(map(f, zip(*corners, strict=True))) for f in (min, max))
        centre = self._rounding.point((0.5 * (x0 + x1), 0.5 * (y0 + y1)), max(x1 - x0, y1 - y0))
        values: dict[str, Any] = {"name": self._unique(name or "body"), "position": centre}
        values |= self._values(keys, "body", element)
        parts: dict[str, list[dict[str, Any]]] = {"ball": [], "box": [], "polygon": []}
        for shape, part_keys, colour, part_element in pieces:
            table, part = table_of(shape, "dynamic", self._rounding)
            x, y = part["position"]
            part["position"] = self._rounding.point((x - centre[0], y - centre[1]), max(x1 - x0, y1 - y0))
            own = ShapeKeys({key: text for key, text in part_keys.all.items() if keys.all.get(key) != text})
            known = self._values(own, table, part_element, PART_MODELS[table])
            parts[table].append(part | colour_values(colour) | known)
        self._blocks.append(LevelBlock("body", values | {key: those for key, those in parts.items() if those}, element))

    def _checked(self, piece: LevelPiece) -> LevelPiece | None:
        """Return a piece with a shape that a scene accepts, or None after a note of its fault."""
        shape, element = piece.shape, piece.element
        self._shapes += 1
        points: Sequence[Point] = shape.points if isinstance(shape, PolygonShape | LineShape) else (shape.centre,)
        self._points += len(points)
        if self._shapes > MAX_SHAPES or self._points > MAX_POINTS:
            shapes, corners = f"{MAX_SHAPES:,} shapes; split it", f"{MAX_POINTS:,} corners; use a larger --tolerance"
            self.fault(element, f"the level has more than {shapes if self._shapes > MAX_SHAPES else corners}")
            raise SceneError(self.faults)
        numbers = [each for point in points for each in point]
        if isinstance(shape, CircleShape):
            numbers.append(shape.radius)
        elif isinstance(shape, RectangleShape):
            numbers += (*shape.size, shape.radius)
        elif isinstance(shape, LineShape):
            numbers.append(shape.thickness)
        if not all(abs(each) <= MAX_POSITION for each in numbers):  # also finds NaN
            self.fault(element, f"has a coordinate that is not a number, or beyond {MAX_POSITION:g} m")
            return None
        if isinstance(shape, CircleShape | RectangleShape):
            sizes = (shape.radius,) if isinstance(shape, CircleShape) else shape.size
            if min(sizes) <= 0.0:
                self.warn(element, "has no area and is left out")
                return None
            return piece
        closed = isinstance(shape, PolygonShape) or shape.closed
        points = without_repeats(points, closed)
        if len(points) < 2 or (closed and (len(points) < 3 or is_straight(points))):
            self.warn(element, "has no length and is left out" if len(points) < 2 else "has no area and is left out")
            return None
        shape = shape._replace(points=points)
        if isinstance(shape, PolygonShape) and (message := self._outline_message(points)):
            self.fault(element, message)
            return None
        return piece._replace(shape=shape)

    def _outline_message(self, points: tuple[Point, ...]) -> str | None:
        """Return the fault of an outline, with its position in the scene."""
        if len(points) > MAX_CORNERS:
            return (
                f"its outline has {len(points):,} corners; the limit is {MAX_CORNERS:,}: use a larger --tolerance, "
                "simplify the path, or split it"
            )
        found = outline_fault(points)
        if found is None:
            return None
        index, message = found
        if index is None:
            return message
        x, y = points[index]
        reason = "turns straight back" if "straight back" in message else "crosses or touches itself"
        return f"its outline {reason} near ({x:.6g}, {y:.6g}) m of the scene; separate the edges there"

    def _values(
        self, keys: ShapeKeys, table: str, element: LevelElement, model: type[Part] | None = None
    ) -> dict[str, Any]:
        """Return the values of the keys that a table has; own keys that it does not have are noted."""
        model = model or MODELS[table]
        known = keys_of(model)
        values = {key: parse_value(key, text) for key, text in keys.inherited.items() if key in known}
        for key, text in keys.own.items():
            if key in known:
                values[key] = parse_value(key, text)
            else:
                close = difflib.get_close_matches(key, known, n=1)
                hint = f"did you mean {close[0]!r}?" if close else "it has no effect"
                self.warn(element, f"{short_repr(key)} is no key of a [[{table}]]; {hint}")
        material = values.get("material")
        if isinstance(material, str) and material:
            self._materials.setdefault(material)
        return values

    def _unique(self, label: str) -> str:
        """Return a name that no other element of the scene has: a label, if necessary with a number."""
        base = "".join(sign if sign.isprintable() else " " for sign in label).strip()[:180] or "element"
        name = base
        while name in self._names:
            self._copies[base] += 1
            name = f"{base} {self._copies[base] + 1}"
        self._names.add(name)
        return name

    def merge_boxes(self) -> None:
        """Merge static boxes that share a whole side, and note it."""
        self._blocks, merged = merge_boxes(self._blocks, self.options.scale)
        for first, *others in merged:
            names = shorten(", ".join(short_repr(block.values["name"]) for block in others), MAX_NAMED)
            self.warn(
                first.element,
                f"is one box with {names}, as bodies would stop at the seams; another colour or key keeps boxes apart",
            )

    def build(self, title: str) -> ImportedLevel:
        """Return the scene.

        Args:
            title: title of a level without one.

        Raises:
            SceneError: with all faults of the level, by its elements.
        """
        if self.faults:
            raise SceneError(self.faults)
        level = LevelElement("", None)
        if not self._blocks:
            self.fault(level, "contains no shape that can be imported")
            raise SceneError(self.faults + self.warnings)
        order = {table: k for k, table in enumerate(MODELS)}
        blocks = sorted(self._blocks, key=lambda block: order[block.table])
        for material in self._materials:
            self.warn(level, f"material {short_repr(material)} has no coefficients yet; add them under [[material]]")
        scene, text = compose_scene(self._head(title), blocks, self.file)
        if all(getattr(body, "fixed", False) for body in scene.body_sources):
            self.warn(level, 'nothing moves: mark dynamic bodies, see "sandbox import --help"')
        return ImportedLevel(scene, text, tuple(dict.fromkeys(self.warnings)), Counter(block.table for block in blocks))

    def _head(self, title: str) -> list[str]:
        """Return the lines of the scene before its shapes."""
        options = self.options
        gravity = options.gravity or self.gravity or (0.0, -9.81)
        corner = {"lower-left": "lower left corner", "upper-left": "upper left corner", "centre": "centre"}
        lines = [
            f"# Imported from {shorten(printable(self.file), MAX_NAMED)} by `sandbox import`.",
            f"# 1 {self._unit} is {options.scale:g} m; (0, 0) is the {corner[options.origin]}; y points up.",
            f"# Curves are polygons within {options.tolerance:g} {self._unit}s.",
            "",
            f"title = {toml_text(clean_text(self.title)[:200] or clean_text(title)[:200])}",
        ]
        if self.about:
            lines.append(f"about = {toml_text(clean_text(self.about)[:2000])}")
        lines += ["", "[world]", f"gravity = {toml_text(list(gravity))}"]
        for material in self._materials:
            lines += ["", "[[material]]", f"name = {toml_text(material)}"]
        return lines
