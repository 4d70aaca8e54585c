"""Import of levels of other programs: SVG drawings, such as Inkscape's, maps of Tiled, and shots of pooltool."""

from sandbox.levels.builder import ImportedLevel, LevelOptions
from sandbox.levels.pooltool import import_pooltool
from sandbox.levels.svg import import_svg
from sandbox.levels.tiled import import_tmx

__all__ = ["ImportedLevel", "LevelOptions", "import_pooltool", "import_svg", "import_tmx"]
