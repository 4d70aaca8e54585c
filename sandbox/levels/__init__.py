"""Import of levels drawn in other programs: SVG drawings, such as Inkscape's, and maps of Tiled."""

from sandbox.levels.builder import ImportedLevel, LevelOptions
from sandbox.levels.svg import import_svg
from sandbox.levels.tiled import import_tmx

__all__ = ["ImportedLevel", "LevelOptions", "import_svg", "import_tmx"]
