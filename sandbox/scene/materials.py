"""Materials: coefficients by name, `[[material]]`, and those of two that meet, `[[pair]]`."""

from sandbox.scene.part import Falloff, Friction, Name, Part, Restitution


class Material(Part):
    """Named coefficients."""

    name: Name
    """by which shapes and pairs name it"""
    restitution: Restitution | None = None
    """e: speed of separation / speed of approach, 0 to 1"""
    restitution_falloff: Falloff | None = None
    """s/m"""
    friction: Friction | None = None
    """Coulomb friction μ"""


class Pair(Part):
    """The coefficients of two materials in contact; outranks whatever they would mix to."""

    between: tuple[Name, Name]
    """the names of its two materials"""
    restitution: Restitution | None = None
    """e of this pair, 0 to 1, whatever the two state"""
    restitution_falloff: Falloff | None = None
    """s/m"""
    friction: Friction | None = None
    """μ of this pair, whatever the two state"""
