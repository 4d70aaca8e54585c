"""Materials: coefficients by name, `[[material]]`, and those of two that meet, `[[pair]]`."""

from sandbox.scene.part import Falloff, Friction, Name, Part, Restitution


class Material(Part):
    """Named coefficients."""

    name: Name
    restitution: Restitution | None = None
    restitution_falloff: Falloff | None = None
    """s/m"""
    friction: Friction | None = None


class Pair(Part):
    """The coefficients of two materials in contact; outranks whatever they would mix to."""

    between: tuple[Name, Name]
    restitution: Restitution | None = None
    restitution_falloff: Falloff | None = None
    """s/m"""
    friction: Friction | None = None
