"""SVG drawings, as Inkscape, Illustrator and Figma write them, to scenes.

A walk of the drawing gives each element a transform, a style, a role and keys, and turns its geometry into shapes.
Shapes are static unless the element, or a group around it, is marked as dynamic.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sandbox.echo import short_repr
from sandbox.levels.builder import (
    ROLES,
    ImportedLevel,
    LevelBuilder,
    LevelOptions,
    LevelPiece,
    ShapeKeys,
    normal_key,
    role_of_words,
)
from sandbox.levels.level_files import read_text, refuse
from sandbox.levels.outlines import (
    Affine,
    LevelShape,
    LineShape,
    PolygonShape,
    RectangleShape,
    contains_point,
    ellipse_shape,
    outline_of,
    rectangle_shape,
    translation,
)
from sandbox.levels.safe_xml import MAX_XML_ELEMENTS, XmlNode, parse_xml
from sandbox.levels.scene_text import LevelElement
from sandbox.levels.svg_paths import PathError, Subpath, subpaths
from sandbox.levels.svg_values import (
    IGNORED,
    ElementError,
    EmptyElementError,
    StyleSheet,
    inherit,
    length_of,
    parse_colour,
    parse_length,
    parse_numbers,
    parse_viewport,
    size_of,
    transform_of,
)
from sandbox.levels.tables import LevelRole
from sandbox.scene.errors import SceneError
from sandbox.scene.geometry.polygon import signed_area

NEEDS_SVGELEMENTS = 'svg files need the `import` extra: pip install -e ".[import]"'

MAX_PATH_TEXT = 1_000_000
"""Characters of all path data of a drawing; they are parsed in up to 5 s."""

MAX_COPIED_TEXT = 32 * 2**20
"""Characters of the attributes of all elements, those of each copy again; they are read in some seconds."""
MAX_COPIED_DEPTH = 150
"""Nested elements after the expansion of copies; each level takes three frames of the stack."""
MAX_HOLE_WORK = 3_000_000
"""Subpaths times corners of one path that are searched for holes; a second."""

_GROUPS = frozenset({"g", "a", "svg", "switch"})
_SHAPES = frozenset({"rect", "circle", "ellipse", "line", "polyline", "polygon", "path"})
_WITHOUT_SHAPE = frozenset(
    {"defs", "style", "title", "desc", "metadata", "symbol", "linearGradient", "radialGradient", "pattern", "clipPath"}
    | {"mask", "filter", "marker", "view"}
)
"""Elements that draw nothing by themselves."""
_OTHER_DATA = frozenset({"name", "body"})


@dataclass(frozen=True)
class _Context:
    """What an element inherits from the groups around it."""

    transform: Affine
    style: Mapping[str, str]
    role: LevelRole
    keys: ShapeKeys
    depth: int = 0
    """nested elements, also by copies"""
    uses: tuple[str, ...] = ()
    """ids of the elements that are being copied by `<use>`"""
    instance: LevelElement | None = None
    """outermost `<use>`"""
    label: str = ""
    """label of that `<use>`"""
    parts: list[LevelPiece] | None = None
    """shapes of the compound body around the element"""


def import_svg(source: str | Path, options: LevelOptions | None = None, **changes: Any) -> ImportedLevel:
    """Return an SVG drawing as a scene.

    Args:
        source: path of the file, or its text.
        options: how it becomes a scene.
        changes: fields of `LevelOptions`, in place of `options`, such as `scale=0.02`, m for each user unit.

    Returns:
        The scene, its text, and the warnings.

    Raises:
        SceneError: the drawing or an option is invalid, or svgelements is not installed; the error has every fault.
    """
    options = replace(options or LevelOptions(), **changes)
    if faults := options.faults():
        raise SceneError(faults)
    is_text = isinstance(source, str) and "<" in source
    file = "<svg>" if is_text else str(source)
    text = str(source) if is_text else read_text(Path(source), file)
    root = parse_xml(text, file)
    if root.tag != "svg":
        refuse(file, f"is no SVG drawing: its root element is <{root.tag}>, not <svg>", root.line)
    try:
        import svgelements  # noqa: F401, tests for the package
    except ImportError:
        refuse(file, NEEDS_SVGELEMENTS)
    return _Drawing(root, file, options).imported("Drawing" if is_text else Path(source).stem)


class _Drawing:
    """A drawing while it is read."""

    def __init__(self, root: XmlNode, file: str, options: LevelOptions) -> None:
        self._root = root
        self._builder = LevelBuilder(file, options, "user unit")
        self._options = options
        self._by_id: dict[str, XmlNode] = {}
        self._sheet = StyleSheet()
        self._visited = self._path_text = self._text = 0
        stack = [root]
        while stack:
            node = stack.pop()
            stack += reversed(node.children)
            if (name := node.attributes.get("id")) is not None:
                self._by_id.setdefault(name, node)
            if node.tag == "style":
                self._sheet.add(node.text)

    def imported(self, title: str) -> ImportedLevel:
        """Return the scene of the drawing."""
        root, builder = self._root, self._builder
        for name in ("title", "desc"):
            node = root.find(name)
            if node is not None:
                setattr(builder, "title" if name == "title" else "about", node.text)
        for selector in dict.fromkeys(self._sheet.unsupported):
            builder.warn(LevelElement("style", None), f"the CSS selector {short_repr(selector)} is not supported")
        transform = self._page_transform()
        own = dict(_data(root))
        if (gravity := own.pop("gravity", None)) is not None:
            builder.gravity = self._gravity(gravity)
        try:
            transform = transform.after(transform_of(root))
            style = inherit({}, self._sheet.of(root))
            context = _Context(transform, style, _role_of(root) or "static", ShapeKeys().inner(own))
        except ElementError as error:
            refuse(builder.file, str(error), root.line, "svg")
        self._walk_children(root, context)
        builder.merge_boxes()
        return builder.build(title)

    def _gravity(self, text: str) -> tuple[float, float] | None:
        """Return the gravity that the root states, m/s²."""
        try:
            x, y = (float(word) for word in re.split(r"[\s,]+", text.strip()))
        except ValueError:
            x = y = math.nan
        if not (abs(x) <= 1e9 and abs(y) <= 1e9):
            self._builder.fault(self._element(self._root), f"data-gravity must be two numbers, is {short_repr(text)}")
            return None
        return x, y

    def _page_transform(self) -> Affine:
        """Return the map from user units of the drawing to metres."""
        element, scale = self._element(self._root), self._options.scale
        view = self._root.attributes.get("viewBox")
        page: tuple[float, ...] | None = None
        try:
            if view is not None:
                page = parse_numbers(view, (4,))
            elif {"width", "height"} <= self._root.attributes.keys() and "%" not in (
                self._root.attributes["width"] + self._root.attributes["height"]
            ):
                page = (0.0, 0.0, length_of(self._root, "width", 0.0), length_of(self._root, "height", 0.0))
        except ElementError as error:
            refuse(self._builder.file, f"viewBox: {error}", element.line, element.path)
        if page is None:
            if self._options.origin != "upper-left":
                self._builder.warn(element, "has no page size; (0, 0) of the scene is the origin of the drawing")
            page = (0.0, 0.0, 0.0, 0.0)
        x, y, width, height = page
        if self._options.origin == "lower-left":
            y += height
        elif self._options.origin == "centre":
            x, y = x + 0.5 * width, y + 0.5 * height
        return Affine(scale, 0.0, 0.0, -scale, -scale * x, scale * y)

    def _walk_children(self, node: XmlNode, context: _Context) -> None:
        children = node.children
        if node.tag == "switch":  # the first one that a program can draw
            children = [each for each in children if each.tag in _SHAPES | _GROUPS | {"use"}][:1]
        for child in children:
            self._walk(child, context)

    def _walk(self, node: XmlNode, context: _Context) -> None:
        """Import an element and everything in it."""
        self._visited += 1
        self._text += sum(map(len, node.attributes.values()))
        if self._visited > MAX_XML_ELEMENTS or self._text > MAX_COPIED_TEXT or context.depth > MAX_COPIED_DEPTH:
            self._builder.fault(self._element(node, context), "the drawing has too many copies of copies")
            raise SceneError(self._builder.faults)
        if node.tag in _WITHOUT_SHAPE or node.tag.startswith("{") or ":" in node.tag:
            return
        own = self._sheet.of(node)
        if own.get("display") == "none":
            return
        element = self._element(node, context)
        if node.tag not in _SHAPES | _GROUPS | {"use"}:
            self._builder.warn(element, f"<{node.tag}> is not imported")
            return
        for key in IGNORED:
            if own.get(key, "none") != "none":
                self._builder.warn(element, f"its {key} is ignored")
        try:
            role, parts = _role_of(node), context.parts
            if role == "compound":
                if node.tag in _SHAPES:
                    raise ElementError("only a group can be a compound")
                role, parts = "dynamic", []
            inner = replace(
                context,
                transform=context.transform.after(transform_of(node)),
                depth=context.depth + 1,
                style=inherit(context.style, own),
                role=role or context.role,
                keys=context.keys.inner(dict(_data(node))),
                parts=parts,
            )
            if inner.role == "ignore":
                return
            if inner.role == "zone" and inner.parts is not None:
                raise ElementError("a zone cannot be part of a compound body; move it out of the group")
            if node.tag not in _SHAPES:
                self._builder.warn_unknown(inner.keys, element)
            if node.tag in _SHAPES:
                if inner.style["visibility"] in ("hidden", "collapse"):
                    return
                self._add_shape(node, inner, element)
            elif node.tag == "use":
                self._walk_copy(node, inner, element)
            else:
                self._walk_group(node, inner)
        except ElementError as error:
            self._builder.fault(element, str(error))
            return
        except EmptyElementError as error:
            self._builder.warn(element, f"{error} and is left out")
            return
        if parts is not None and parts is not context.parts and parts:
            self._builder.add(parts, "dynamic", inner.label or _label(node), inner.keys, element)

    def _walk_group(self, node: XmlNode, context: _Context) -> None:
        if node.tag == "svg":
            context = replace(context, transform=context.transform.after(parse_viewport(node, node)))
        self._walk_children(node, context)

    def _walk_copy(self, node: XmlNode, context: _Context, element: LevelElement) -> None:
        """Import the element that a `<use>` copies."""
        address = node.attributes.get("href", "")
        if not address.startswith("#"):
            raise ElementError(f"copies {short_repr(address)}, which is not in this file; nothing is fetched")
        name = address[1:]
        target = self._by_id.get(name)
        if target is None:
            raise ElementError(f"copies #{name}, which does not exist")
        if name in context.uses:
            raise ElementError(f"copies #{name}, which contains this copy itself")
        shift = translation(length_of(node, "x", 0.0), length_of(node, "y", 0.0))
        inner = replace(
            context,
            transform=context.transform.after(shift),
            uses=(*context.uses, name),
            instance=context.instance or element,
            label=context.label or _label(node),
        )
        if target.tag != "symbol":
            self._walk(target, inner)
            return
        if "viewBox" in target.attributes:
            inner = replace(inner, transform=inner.transform.after(parse_viewport(target, node)))
        style = inherit(inner.style, self._sheet.of(target))
        self._walk_children(target, replace(inner, style=style, role=_checked_role(target) or inner.role))

    def _add_shape(self, node: XmlNode, context: _Context, element: LevelElement) -> None:
        """Add the shapes of a drawn element to the scene, or to the compound body around it."""
        if not context.transform.is_finite:
            raise ElementError("its transform overflows")
        if context.transform.mean_scale == 0.0:
            raise EmptyElementError("is scaled to nothing")
        shapes = list(self._painted(self._shapes_of(node, context, element), context))
        colour = self._colour(context.style, any(isinstance(each, LineShape) for each in shapes), element)
        pieces = [LevelPiece(shape, context.keys, colour, element) for shape in shapes]
        if context.parts is not None:
            context.parts.extend(pieces)
        else:
            self._builder.add(pieces, context.role, context.label or _label(node), context.keys, element)

    def _painted(self, shapes: Iterator[LevelShape], context: _Context) -> Iterator[LevelShape]:
        """Yield shapes: static ones without a fill as walls along their outlines, rounded zones as polygons."""
        style = context.style
        is_hollow = style["fill"] == "none" and style["stroke"] != "none" and context.role == "static"
        for shape in shapes:
            if context.role == "zone" and isinstance(shape, RectangleShape) and shape.radius:
                yield PolygonShape(outline_of(shape, self._tolerance))
            elif not is_hollow or isinstance(shape, LineShape):
                yield shape
            else:
                yield LineShape(outline_of(shape, self._tolerance), _stroke_width(context), closed=True)

    @property
    def _tolerance(self) -> float:
        """Distance of polygons from curves, m."""
        return self._options.tolerance * self._options.scale

    def _shapes_of(self, node: XmlNode, context: _Context, element: LevelElement) -> Iterator[LevelShape]:
        """Yield the shapes of a drawn element, m."""
        transform, tolerance = context.transform, self._tolerance
        match node.tag:
            case "rect":
                corner = length_of(node, "x", 0.0), length_of(node, "y", 0.0)
                size = size_of(node, "width"), size_of(node, "height")
                yield rectangle_shape(corner, size, transform, tolerance, _corner_radii(node, size))
            case "circle" | "ellipse":
                centre = length_of(node, "cx", 0.0), length_of(node, "cy", 0.0)
                names = ("r", "r") if node.tag == "circle" else ("rx", "ry")
                shape = ellipse_shape(centre, (size_of(node, names[0]), size_of(node, names[1])), transform, tolerance)
                if isinstance(shape, PolygonShape):
                    self._builder.warn(
                        element,
                        f"an ellipse becomes a polygon of {len(shape.points)} corners, within "
                        f"{self._options.tolerance:g} user units",
                    )
                yield shape
            case "line":
                a, b = ((length_of(node, f"x{k}", 0.0), length_of(node, f"y{k}", 0.0)) for k in "12")
                yield LineShape((transform.apply(*a), transform.apply(*b)), _stroke_width(context))
            case "polyline" | "polygon":
                numbers = parse_numbers(self._path_data(node, "points", element))
                if len(numbers) % 2:
                    raise ElementError("points must be pairs of numbers, and the last one has no y")
                points = list(zip(numbers[::2], numbers[1::2], strict=True))
                if len(points) < 2:
                    raise EmptyElementError("has no length")
                closed = node.tag == "polygon" or (len(points) > 3 and points[0] == points[-1])
                yield from self._path_shapes([Subpath(tuple(points), closed)], context, element)
            case _:
                text = self._path_data(node, "d", element)
                try:
                    found = subpaths(text, tolerance / transform.scale_factors[0])
                except PathError as error:
                    raise ElementError(str(error)) from None
                if not found:
                    raise EmptyElementError("has no length")
                yield from self._path_shapes(found, context, element)

    def _path_data(self, node: XmlNode, key: str, element: LevelElement) -> str:
        """Return the coordinates of a path or polygon, of which a drawing may have a certain amount."""
        text = node.attributes.get(key, "")
        self._path_text += len(text)
        if self._path_text > MAX_PATH_TEXT:
            self._builder.fault(element, f"the drawing has more than {MAX_PATH_TEXT:,} characters of path data")
            raise SceneError(self._builder.faults)
        return text

    def _path_shapes(self, found: list[Subpath], context: _Context, element: LevelElement) -> Iterator[LevelShape]:
        """Yield closed subpaths as polygons, full circles as circles, open ones as lines, m.

        Subpaths inside others are holes, which polygons do not have: the outlines of such a static path become walls.
        """
        transform = context.transform
        has_holes = _has_holes([each for each in found if each.closed], context)
        if has_holes and context.role != "static":
            raise ElementError(
                "the path has a hole, which a body or zone cannot have; cut it into pieces (in Inkscape: Path > "
                "Division), or make it static"
            )
        if has_holes:
            self._builder.warn(element, "the path has a hole: its outlines become walls, and its inside is not solid")
        for each in found:
            if each.closed and each.circle is not None and not has_holes:
                centre, radius = each.circle
                yield ellipse_shape(centre, (radius, radius), transform, self._tolerance)
                continue
            points = tuple(transform.apply(*point) for point in each.points)
            if each.closed and not has_holes:
                yield PolygonShape(points[:-1] if points[0] == points[-1] else points)
            else:
                if each.closed and points[0] == points[-1]:
                    points = points[:-1]
                yield LineShape(points, _stroke_width(context), each.closed)

    def _colour(self, style: Mapping[str, str], is_line: bool, element: LevelElement) -> str | None:
        """Return the colour of a shape, `#rrggbb`: of its fill, and of its stroke for a line, or without a fill."""
        names = ("stroke", "fill") if is_line else ("fill", "stroke")
        paint = next((style[name] for name in names if style[name] != "none"), "")
        if not paint:
            return None
        if paint.lower() == "currentcolor":
            paint = style.get("color", "black")
        if paint.startswith("url("):
            self._builder.warn(element, "a gradient or pattern is not imported; the shape has no colour")
            return None
        found = parse_colour(paint)
        if found is None:
            self._builder.warn(element, f"the colour {short_repr(paint)} is unknown")
        return found

    def _element(self, node: XmlNode, context: _Context | None = None) -> LevelElement:
        """Return an element as messages name it; of a copy, its `<use>` comes first."""
        name = node.attributes.get("id")
        path = node.tag if name is None else f"{node.tag}#{name}"
        if context is not None and context.instance is not None:
            return LevelElement(f"{context.instance.path} > {path}", context.instance.line)
        return LevelElement(path, node.line)


def _stroke_width(context: _Context) -> float:
    """Return the thickness of a line, m; 0 without a stroke."""
    if context.style["stroke"] == "none":
        return 0.0
    return max(parse_length(context.style["stroke-width"], "stroke-width"), 0.0) * context.transform.mean_scale


def _corner_radii(node: XmlNode, size: tuple[float, float]) -> tuple[float, float]:
    """Return the radii of the rounded corners of a rectangle; one that is left out equals the other."""
    given = {key: size_of(node, key) for key in ("rx", "ry") if node.attributes.get(key, "auto") != "auto"}
    rx = given.get("rx", given.get("ry", 0.0))
    ry = given.get("ry", rx)
    return min(rx, 0.5 * size[0]), min(ry, 0.5 * size[1])


def _has_holes(closed: list[Subpath], context: _Context) -> bool:
    """Return whether a closed subpath lies in another one and is not filled."""
    if len(closed) < 2:
        return False
    if len(closed) * sum(len(each.points) for each in closed) > MAX_HOLE_WORK:
        raise ElementError("the path has too many parts; break it apart (in Inkscape: Path > Break Apart)")
    evenodd = context.style["fill-rule"] == "evenodd"
    return any(
        contains_point(outer.points, inner.points[0])
        and (evenodd or (signed_area(inner.points) > 0.0) != (signed_area(outer.points) > 0.0))
        for inner in closed
        for outer in closed
        if inner is not outer
    )


def _data(node: XmlNode) -> Iterator[tuple[str, str]]:
    """Yield the keys that the `data-` attributes of an element give."""
    for name, text in node.attributes.items():
        if name.startswith("data-") and (key := normal_key(name[5:])) not in _OTHER_DATA:
            yield key, text


def _role_of(node: XmlNode) -> Any:
    """Return the role that an element states itself, or None.

    Raises:
        ElementError: `data-body` is no role.
    """
    stated = node.attributes.get("data-body")
    if stated is not None:
        role = role_of_words(stated)
        if role is None:
            raise ElementError(f"data-body must be one of {', '.join(ROLES)}, compound; is {short_repr(stated)}")
        return role
    names = ("class", "inkscape:label", "data-name", "id")
    roles = (role_of_words(node.attributes.get(name, "")) for name in names)
    role = next(filter(None, roles), None)
    return None if role == "compound" and node.tag in _SHAPES else role


def _checked_role(node: XmlNode) -> Any:
    role = _role_of(node)
    return "dynamic" if role == "compound" else role


def _label(node: XmlNode) -> str:
    """Return the name that the author gave an element, or its id, or its tag."""
    title = node.find("title")
    names = (
        node.attributes.get("inkscape:label"),
        node.attributes.get("data-name"),
        title.text if title is not None else None,
        node.attributes.get("id"),
    )
    return next((name.strip() for name in names if name and name.strip()), node.tag)
