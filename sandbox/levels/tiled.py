"""Maps of Tiled (.tmx, with tilesets .tsx, .tsj or .json) to scenes.

The files are read and checked here; pytmx then decodes layers, objects and properties from the checked elements, which
means that it opens no file. Object layers give objects; tile layers give the collision shapes of their tiles, which are
static; rectangles are merged.
"""

import logging
import math
import os
import re
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, cast
from xml.etree import ElementTree

from sandbox.echo import short_repr
from sandbox.levels.builder import (
    ImportedLevel,
    LevelBuilder,
    LevelOptions,
    LevelPiece,
    ShapeKeys,
    normal_key,
    role_of_words,
)
from sandbox.levels.level_files import read_text, refuse
from sandbox.levels.merging import TileRectangle, merge_rectangles
from sandbox.levels.outlines import (
    Affine,
    CircleShape,
    LevelShape,
    LineShape,
    PolygonShape,
    ellipse_shape,
    rectangle_shape,
    rotation,
    translation,
)
from sandbox.levels.safe_xml import XmlNode, parse_xml
from sandbox.levels.scene_text import LevelElement
from sandbox.levels.tables import LevelRole
from sandbox.levels.tiled_values import (
    NUMBER,
    TiledError,
    check_tile_data,
    colour_of,
    integer_of,
    is_true,
    keys_in,
    number_of,
    object_for_pytmx,
    stated_role,
    tile_size_of,
)
from sandbox.levels.tilesets import (
    FLIPPED_DIAGONALLY,
    FLIPPED_X,
    FLIPPED_Y,
    GID_MASK,
    Tile,
    Tileset,
    read_tileset,
)
from sandbox.scene.description.base import Point
from sandbox.scene.errors import SceneError

NEEDS_PYTMX = 'tmx files need the `import` extra: pip install -e ".[import]"'

MAX_TILES = 1_000_000
"""Tiles of all layers; they are read in a second."""
MAX_TILESETS = 100


@dataclass(frozen=True)
class _Layer:
    """What an object or tile inherits from the layers around it."""

    role: LevelRole = "static"
    keys: ShapeKeys = ShapeKeys()  # noqa: RUF009, frozen
    shift: Point = (0.0, 0.0)
    solid: bool = False
    colour: str | None = None


_KeyTexts = tuple[tuple[str, str], ...]
"""Keys and their texts, in order."""


class _TileSolid(NamedTuple):
    """The solid part of a tile of a tile layer."""

    tile: Tile
    keys: _KeyTexts
    rectangles: list[TileRectangle] | None
    """in pixels of the tile; None if its collision shapes are not upright rectangles"""


def import_tmx(path: str | Path, options: LevelOptions | None = None, **changes: Any) -> ImportedLevel:
    """Return a map of Tiled as a scene.

    Args:
        path: path of the .tmx file. Tilesets are read from its folder, and folders in it, only.
        options: how it becomes a scene.
        changes: fields of `LevelOptions`, in place of `options`, such as `scale=0.02`, m for each pixel.

    Returns:
        The scene, its text, and the warnings.

    Raises:
        SceneError: the map or an option is invalid, or pytmx is not installed; the error has every fault.
    """
    options = replace(options or LevelOptions(), **changes)
    if faults := options.faults():
        raise SceneError(faults)
    file = str(path)
    root = parse_xml(read_text(Path(path), file), file)
    if root.tag != "map":
        refuse(file, f"is no map of Tiled: its root element is <{root.tag}>, not <map>", root.line)
    logging.getLogger("pytmx").addHandler(logging.NullHandler())  # it reports that pygame is missing
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pytmx imports pygame where it is installed
    try:
        import pytmx  # noqa: F401, tests for the package
    except ImportError:
        refuse(file, NEEDS_PYTMX)
    return _Map(root, Path(path), file, options).imported()


class _Map:
    """A map while it is read."""

    def __init__(self, root: XmlNode, path: Path, file: str, options: LevelOptions) -> None:
        import pytmx

        self._root, self._path, self._options = root, path, options
        self._builder = LevelBuilder(file, options, "pixel")
        self._tilesets: list[Tileset] = []
        self._tiles = 0
        self._known_properties: dict[int, dict[str, str]] = {}
        """of each element by its `id()`; those of tiles are asked for often"""
        if root.attributes.get("orientation", "orthogonal") != "orthogonal":
            kind = short_repr(root.attributes["orientation"])
            refuse(file, f"the orientation {kind} is not supported; use an orthogonal map", root.line, "map")
        self._is_infinite = root.attributes.get("infinite") == "1"
        try:
            self._tile_size = tile_size_of(root)
            columns, rows = (integer_of(root, key) for key in ("width", "height"))
        except TiledError as error:
            refuse(file, str(error), root.line, "map")
        if columns < 0 or rows < 0 or columns * rows > MAX_TILES:
            refuse(file, f"the map has {columns} × {rows} tiles; the limit is {MAX_TILES:,}", root.line, "map")
        self._size = columns * self._tile_size[0], rows * self._tile_size[1]
        # pytmx checks names of properties against its own attributes, unless a map was created with this option
        self._pytmx = pytmx.TiledMap(allow_duplicate_names=True)
        self._pytmx.filename = file

    def imported(self) -> ImportedLevel:
        """Return the scene of the map."""
        builder, root = self._builder, self._root
        for node in root.find_all("tileset"):
            self._read_tileset(node)
        element = LevelElement("map", root.line)
        properties = self._properties(root, element)
        builder.title, builder.about = properties.pop("title", ""), properties.pop("about", "")
        if (gravity := properties.pop("gravity", None)) is not None:
            words = re.split(r"[\s,]+", gravity.strip())
            if len(words) == 2 and all(NUMBER.fullmatch(word) and abs(float(word)) <= 1e9 for word in words):
                builder.gravity = float(words[0]), float(words[1])
            else:
                builder.fault(element, f"gravity must be two numbers, is {short_repr(gravity)}")
        outer = _Layer(
            role=_plain_role(stated_role(properties)) or "static", keys=ShapeKeys().inner(keys_in(properties))
        )
        self._walk_layers(root, outer)
        return builder.build(self._path.stem)

    def _page_transform(self) -> Affine:
        """Return the map from pixels to metres."""
        scale, (width, height) = self._options.scale, self._size
        x = y = 0.0
        if not self._is_infinite:  # an infinite map has no size: its origin is its upper left tile (0, 0)
            x = 0.5 * width if self._options.origin == "centre" else 0.0
            y = {"lower-left": height, "centre": 0.5 * height}.get(self._options.origin, 0.0)
        return Affine(scale, 0.0, 0.0, -scale, -scale * x, scale * y)

    def _read_tileset(self, node: XmlNode) -> None:
        name = node.attributes.get("source", node.attributes.get("name", ""))
        element = LevelElement(f"tileset {short_repr(name)}", node.line)
        if len(self._tilesets) >= MAX_TILESETS:
            self._builder.fault(element, f"the map has more than {MAX_TILESETS} tilesets")
            raise SceneError(self._builder.faults)
        try:
            self._tilesets.append(read_tileset(node, self._builder.file))
        except TiledError as error:
            self._builder.fault(element, str(error))

    def _tile_of(self, gid: int) -> Tile | None:
        """Return the tile of a global id with its flags; None without a tileset for it."""
        number = gid & GID_MASK
        found = [each for each in self._tilesets if each.first_gid <= number]
        if not found:
            return None
        tileset = max(found, key=lambda each: each.first_gid)
        flips = gid & (FLIPPED_X | FLIPPED_Y | FLIPPED_DIAGONALLY)
        return Tile(tileset, tileset.tiles.get(number - tileset.first_gid), flips)

    def _walk_layers(self, node: XmlNode, outer: _Layer) -> None:
        for child in node.children:
            if child.tag not in ("group", "layer", "objectgroup", "imagelayer"):
                continue
            name = child.attributes.get("name", child.attributes.get("id", ""))
            element = LevelElement(f"{child.tag} {short_repr(name)}", child.line)
            if child.attributes.get("visible") == "0":
                continue
            if child.tag == "imagelayer":
                self._builder.warn(element, "image layers are not imported")
                continue
            try:
                layer = self._layer(child, outer, element)
                if layer.role == "ignore":
                    continue
                if child.tag == "group":
                    self._walk_layers(child, layer)
                elif child.tag == "layer":
                    self._add_tiles(child, layer, element)
                else:
                    self._add_objects(child, layer)
            except TiledError as error:
                self._builder.fault(element, str(error))

    def _layer(self, node: XmlNode, outer: _Layer, element: LevelElement) -> _Layer:
        properties = self._properties(node, element)
        role = (
            stated_role(properties)
            or role_of_words(node.attributes.get("class", ""))
            or role_of_words(node.attributes.get("name", ""))
        )
        keys = outer.keys.inner(keys_in(properties))
        self._builder.warn_unknown(keys, element)
        shift = outer.shift[0] + number_of(node, "offsetx"), outer.shift[1] + number_of(node, "offsety")
        return _Layer(
            role=_plain_role(role) or outer.role,
            keys=keys,
            shift=shift,
            solid=is_true(properties.get("solid"), outer.solid),
            colour=colour_of(node.attributes.get("color")) or outer.colour,
        )

    def _add_objects(self, node: XmlNode, layer: _Layer) -> None:
        for child in node.find_all("object"):
            number, name = child.attributes.get("id", "?"), child.attributes.get("name", "")
            element = LevelElement(f"object#{number}" + (f" {short_repr(name)}" if name else ""), child.line)
            if child.attributes.get("visible") == "0":
                continue
            try:
                self._add_object(child, layer, element)
            except TiledError as error:
                self._builder.fault(element, str(error))

    def _add_object(self, node: XmlNode, layer: _Layer, element: LevelElement) -> None:
        """Add an object: a shape, or a tile with its collision shapes."""
        if "template" in node.attributes:
            self._builder.warn(element, "objects of templates are not imported; use Detach in Tiled")
            return
        properties = self._properties(node, element)
        tile = None
        inherited: dict[str, str] = {}
        stated: dict[str, str] = {}
        kind = node.attributes.get("type", node.attributes.get("class", ""))
        if "gid" in node.attributes:
            tile = self._tile_of(integer_of(node, "gid"))
            if tile is None:
                raise TiledError("its tile belongs to no tileset of the map")
            if tile.node is not None:
                inherited = dict(self._tile_keys(tile))
                stated = self._properties(tile.node, _element_of(tile))
                kind = kind or tile.node.attributes.get("type", tile.node.attributes.get("class", ""))
        role = _plain_role(
            stated_role(properties)
            or stated_role(stated)
            or role_of_words(kind)
            or role_of_words(node.attributes.get("name", ""))
        )
        layer = replace(layer, role=role or layer.role)
        if layer.role == "ignore":
            return
        tile_keys = ShapeKeys(inherited={**layer.keys.all, **inherited})
        keys = tile_keys.inner(keys_in(properties))
        place = self._page_transform().after(translation(*layer.shift))
        if tile is None:
            shapes = list(self._shapes(node, place, properties, element))
        else:
            shapes = list(self._tile_object_shapes(node, tile, place))
        pieces = [LevelPiece(shape, keys, layer.colour, element) for shape in shapes]
        label = node.attributes.get("name") or kind or f"{layer.role} object"
        self._builder.add(pieces, layer.role, label, keys, element)

    def _shapes(
        self, node: XmlNode, place: Affine, properties: Mapping[str, str], element: LevelElement
    ) -> Iterator[LevelShape]:
        """Yield the shape of an object, or of a collision shape of a tile, m."""
        import pytmx

        each = pytmx.TiledObject(self._pytmx, object_for_pytmx(node), {})
        x, y, width, height = (float(value) for value in (each.x, each.y, each.width, each.height))
        # the rotation is clockwise, in degrees, about the position of the object; y points down
        frame = place.after(translation(x, y)).after(rotation(math.radians(float(each.rotation))))
        tolerance = self._options.tolerance * self._options.scale
        kinds = {child.tag for child in node.children}
        if "polygon" in kinds or "polyline" in kinds:
            points = tuple(frame.apply(px - x, py - y) for px, py in getattr(each, "points", ()))
            thickness = self._thickness(properties)
            yield PolygonShape(points) if "polygon" in kinds else LineShape(points, thickness)
        elif "text" in kinds:
            self._builder.warn(element, "text is not imported")
        elif "point" in kinds or (width == 0.0 and height == 0.0):
            radius = properties.get("radius")
            if radius is None:
                self._builder.warn(
                    element, "a point has no size and is left out; the property radius, m, makes it a circle"
                )
            elif not NUMBER.fullmatch(radius) or not 0.0 < float(radius) <= 1e9:
                raise TiledError(f"radius must be a number greater than 0, is {short_repr(radius)}")
            else:
                yield CircleShape(frame.apply(0.0, 0.0), float(radius))
        elif "ellipse" in kinds:
            yield self._ellipse((width, height), frame, element)
        elif "capsule" in kinds:
            end = 0.5 * min(width, height)
            yield rectangle_shape((0.0, 0.0), (width, height), frame, tolerance, (end, end))
        else:
            yield rectangle_shape((0.0, 0.0), (width, height), frame)

    def _ellipse(self, size: tuple[float, float], frame: Affine, element: LevelElement) -> LevelShape:
        radii = 0.5 * size[0], 0.5 * size[1]
        shape = ellipse_shape(radii, radii, frame, self._options.tolerance * self._options.scale)
        if isinstance(shape, PolygonShape):
            count, tolerance = len(shape.points), self._options.tolerance
            self._builder.warn(element, f"an ellipse becomes a polygon of {count} corners, within {tolerance:g} pixels")
        return shape

    def _thickness(self, properties: Mapping[str, str]) -> float:
        """Return the thickness of a line, m."""
        text = properties.get("thickness", "0")
        if not NUMBER.fullmatch(text) or not 0.0 <= float(text) <= 1e9:
            raise TiledError(f"thickness must be a number of metres, at least 0, is {short_repr(text)}")
        return float(text)

    def _tile_object_shapes(self, node: XmlNode, tile: Tile, place: Affine) -> Iterator[LevelShape]:
        """Yield the collision shapes of a tile object, or its rectangle if the tile has none, m."""
        (across, up), (ax, ay) = tile.tileset.size, tile.tileset.anchor
        width, height = number_of(node, "width", across), number_of(node, "height", up)
        frame = place.after(translation(number_of(node, "x"), number_of(node, "y")))
        frame = frame.after(rotation(math.radians(number_of(node, "rotation"))))
        frame = frame.after(translation(-ax * width, -ay * height))
        if not tile.colliders():
            yield rectangle_shape((0.0, 0.0), (width, height), frame)
            return
        scaled = frame.after(Affine(width / across, 0.0, 0.0, height / up))
        yield from self._collision_shapes(tile, scaled)

    def _collision_shapes(self, tile: Tile, place: Affine) -> Iterator[LevelShape]:
        """Yield the collision shapes of a tile whose upper left corner is at the origin of `place`, m."""
        place = place.after(tile.flip())
        for node in tile.colliders():
            name = f"{tile.path} object#{node.attributes.get('id', '?')}"
            element = LevelElement(name, node.line, tile.tileset.file)
            try:
                yield from self._shapes(node, place, self._properties(node, element), element)
            except TiledError as error:
                raise TiledError(f"{name}: {error}") from None

    def _add_tiles(self, node: XmlNode, layer: _Layer, element: LevelElement) -> None:
        """Add the collision shapes of a tile layer; rectangles with equal keys are merged."""
        rectangles: dict[_KeyTexts, list[TileRectangle]] = {}
        others: list[tuple[_TileSolid, float, float]] = []
        width, height = self._tile_size
        role = layer.role
        if role == "dynamic":
            self._builder.warn(element, "tiles of a layer are static; insert tiles that move as objects")
            role = "static"
        solids: dict[int, _TileSolid | None] = {}
        count = 0
        for column, row, gid in self._gids(node):
            count += 1
            if gid not in solids:
                tile = self._tile_of(gid)
                if tile is None:
                    raise TiledError(f"the tile at column {column}, row {row} belongs to no tileset of the map")
                solids[gid] = self._solid_of(tile, layer)
            solid = solids[gid]
            if solid is None:
                continue
            # a tile larger than the cells of the map grows up and to the right
            x, y = column * width, (row + 1) * height - solid.tile.tileset.size[1]
            if solid.rectangles is None:
                others.append((solid, x, y))
            else:
                target = rectangles.setdefault(solid.keys, [])
                target += (part._replace(x=part.x + x, y=part.y + y) for part in solid.rectangles)
        place = self._page_transform().after(translation(*layer.shift))
        label = node.attributes.get("name") or "tiles"
        for keys, parts in rectangles.items():
            shape_keys = ShapeKeys(inherited={**layer.keys.all, **dict(keys)})
            for part in merge_rectangles(parts):
                box = rectangle_shape((part.x, part.y), (part.width, part.height), place)
                self._builder.add(
                    [LevelPiece(box, shape_keys, layer.colour, element)], role, label, shape_keys, element
                )
        for solid, x, y in others:
            shape_keys = ShapeKeys(inherited={**layer.keys.all, **dict(solid.keys)})
            for shape in self._collision_shapes(solid.tile, place.after(translation(x, y))):
                self._builder.add(
                    [LevelPiece(shape, shape_keys, layer.colour, element)], role, label, shape_keys, element
                )
        if count and not rectangles and not others:
            self._builder.warn(
                element, "none of its tiles has a collision shape; the property solid = true makes each tile a box"
            )

    def _solid_of(self, tile: Tile, layer: _Layer) -> _TileSolid | None:
        """Return the solid part of a tile of a tile layer, or None."""
        keys = self._tile_keys(tile)
        if tile.colliders():
            return _TileSolid(tile, keys, tile.rectangles())
        properties = {} if tile.node is None else self._properties(tile.node, _element_of(tile))
        if not is_true(properties.get("solid"), layer.solid):
            return None
        return _TileSolid(tile, keys, [TileRectangle(0.0, 0.0, *tile.tileset.size)])

    def _tile_keys(self, tile: Tile) -> _KeyTexts:
        """Return the keys that a tile gives to its shapes."""
        if tile.node is None:
            return ()
        keys = keys_in(self._properties(tile.node, _element_of(tile)))
        self._builder.warn_unknown(ShapeKeys(keys), _element_of(tile))
        return tuple(sorted(keys.items()))

    def _gids(self, node: XmlNode) -> Iterator[tuple[int, int, int]]:
        """Yield column, row and global id, with flags, of each tile of a layer."""
        import pytmx

        data = node.find("data")
        if data is None:
            raise TiledError("has no data")
        for part in data.find_all("chunk") or [node]:
            columns, rows = integer_of(part, "width"), integer_of(part, "height")
            if columns <= 0 or rows <= 0:
                raise TiledError("its width and height must be greater than 0")
            self._tiles += columns * rows
            if self._tiles > MAX_TILES:
                raise TiledError(f"the map has more than {MAX_TILES:,} tiles")
            text = data.text if part is node else part.text
            check_tile_data(text, data, columns * rows)
            tree = ElementTree.Element("layer", {"name": "", "width": str(columns), "height": str(rows)})
            keys = {str(key): data.attributes[key] for key in ("encoding", "compression") if key in data.attributes}
            ElementTree.SubElement(tree, "data", keys).text = text
            try:
                layer = pytmx.TiledTileLayer(self._pytmx, tree)
            except (ValueError, TypeError, OverflowError, EOFError, OSError, zlib.error):
                raise TiledError("its data cannot be decoded") from None
            if len(layer.data) != rows or any(len(row) != columns for row in layer.data):
                raise TiledError(f"its data are not {columns} × {rows} tiles")
            x = integer_of(part, "x") if part is not node else 0
            y = integer_of(part, "y") if part is not node else 0
            for column, row, local in layer.iter_data():
                if local:
                    yield x + column, y + row, self._gid_of(local)

    def _gid_of(self, local: int) -> int:
        """Return the global id, with flags, of pytmx's number for it."""
        gid = self._pytmx.tiledgidmap[local]
        flags = next(flags for number, flags in self._pytmx.gidmap[gid] if number == local)
        bits = (FLIPPED_X, FLIPPED_Y, FLIPPED_DIAGONALLY)
        return int(gid) | sum(bit for bit, is_set in zip(bits, flags, strict=True) if is_set)

    def _properties(self, node: XmlNode, element: LevelElement) -> dict[str, str]:
        """Return the custom properties of an element as text, by the key of a scene."""
        if id(node) not in self._known_properties:
            self._known_properties[id(node)] = self._read_properties(node, element)
        return dict(self._known_properties[id(node)])

    def _read_properties(self, node: XmlNode, element: LevelElement) -> dict[str, str]:
        found: dict[str, str] = {}
        for group in node.find_all("properties"):
            for each in group.find_all("property"):
                name, kind = each.attributes.get("name", ""), each.attributes.get("type", "string")
                if kind in ("class", "file", "object"):
                    self._builder.warn(element, f"the property {short_repr(name)} of the type {kind} is not imported")
                    continue
                text = each.attributes.get("value", each.text)
                if kind == "color":
                    text = colour_of(text) or ""
                if text or kind == "string":
                    found[normal_key(name)] = text
        return found


def _element_of(tile: Tile) -> LevelElement:
    """Return a tile as messages name it."""
    return LevelElement(tile.path, None if tile.node is None else tile.node.line, tile.tileset.file)


def _plain_role(role: str | None) -> LevelRole | None:
    """Return a role; groups of Tiled are no compounds."""
    return None if role == "compound" else cast("LevelRole | None", role)
