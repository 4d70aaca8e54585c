"""Helpers of the tests of imported levels."""

from pathlib import Path
from typing import Any

import pytest

from sandbox.levels import ImportedLevel, import_svg
from sandbox.scene.errors import Fault, SceneError

DATA = Path(__file__).parent / "data"
EXACT = 1.1e-8
"""m: positions are rounded to a millionth of a user unit, 1e-8 m, and are wrong by half of that; the position and the
points of a polygon together by all of it."""


def svg(body: str, attributes: str = 'viewBox="0 0 100 100"') -> str:
    """Return an SVG drawing, by default of 100 × 100 user units."""
    namespaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    inkscape = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
    return f"<svg {namespaces} {inkscape} {attributes}>\n{body}\n</svg>"


def imported(body: str, attributes: str = 'viewBox="0 0 100 100"', **options: Any) -> ImportedLevel:
    """Import a drawing."""
    return import_svg(svg(body, attributes), **options)


def dynamic(body: str) -> str:
    """Return elements in a group of dynamic bodies."""
    return f'<g data-body="dynamic">{body}</g>'


def faults_of(body: str, attributes: str = 'viewBox="0 0 100 100"', **options: Any) -> tuple[Fault, ...]:
    """Return the faults of a drawing."""
    with pytest.raises(SceneError) as caught:
        imported(body, attributes, **options)
    return caught.value.faults


def messages(level: ImportedLevel) -> str:
    """Return all warnings as one text."""
    return "\n".join(map(str, level.warnings))


def map_file(folder: Path, body: str, attributes: str = "", properties: str = "") -> Path:
    """Write a map of 4 × 3 tiles of 10 pixels, and return its path."""
    path = folder / "map.tmx"
    text = (
        f'<map orientation="orthogonal" width="4" height="3" tilewidth="10" tileheight="10" {attributes}>\n'
        f"{properties}{body}\n</map>"
    )
    path.write_text(text, encoding="utf-8")
    return path


def objects(body: str, attributes: str = 'name="things"') -> str:
    """Return an object layer."""
    return f"<objectgroup {attributes}>{body}</objectgroup>"


def tiles(rows: str, tileset: str, attributes: str = 'name="ground"') -> str:
    """Return a tileset and a tile layer of 4 × 3 tiles."""
    return (
        f'<tileset firstgid="1" name="t" tilewidth="10" tileheight="10">{tileset}</tileset>'
        f'<layer width="4" height="3" {attributes}><data encoding="csv">{rows}</data></layer>'
    )


FULL = '<objectgroup><object id="1" x="0" y="0" width="10" height="10"/></objectgroup>'
"""Collision shape of a tile: all of it."""
