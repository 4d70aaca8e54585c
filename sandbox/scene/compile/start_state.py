"""Start state of the bodies of a scene: generators expanded, cue strokes applied, moments of inertia set by drives."""

from sandbox.scene.compile.bodies import Bodies, join_layouts, layout_of_singles
from sandbox.scene.compile.drives import with_drive_moments
from sandbox.scene.compile.generators import layout_of
from sandbox.scene.compile.layout import Layout, elements_in
from sandbox.scene.description.base import BodySpec
from sandbox.scene.description.game_tables import unexpanded
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.description.surface import Stroke, struck


def start_bodies(scene: SceneDescription) -> Bodies:
    """Return the bodies of a scene in scene order, in the state in which the scene starts.

    Raises:
        GeneratorError: the balls of a generator do not fit.
        OutlineError: an outline cannot be cut into convex pieces.
        ValueError: the scene was built in code and has a preset that is not expanded.
    """
    preset = unexpanded(scene)
    if preset is not None:
        raise ValueError(f"its [{preset}] is not expanded; sandbox.scene.files.presets.expanded does that")
    names: list[str] = []
    layouts: list[Layout] = []
    for kind, those in scene.kinds.items():
        singles = [each for each in those if isinstance(each, BodySpec)]
        if singles:
            layouts.append(layout_of_singles(singles))
            names += [each.name or default_name(kind, k) for k, each in enumerate(those)]
            continue
        for k, each in enumerate(those):
            layout, stem = layout_of(each, scene.world.seed, k, scene.world.gravity), each.name or default_name(kind, k)
            layouts.append(layout)
            names += [f"{stem}-{ending}" for ending in layout.endings or range(1, len(layout) + 1)]
    spheres = scene.surface is not None and scene.surface.bodies == "spheres"
    bodies = join_layouts(names, elements_in(scene), layouts, spheres, scene.layers, len(scene.zones))
    for shot in scene.shots:
        if shot.ball in names:
            _strike(bodies, names.index(shot.ball), shot)
    return with_drive_moments(scene, bodies) if scene.drives else bodies


def _strike(bodies: Bodies, index: int, stroke: Stroke) -> None:
    """Give a sphere the velocity and spin of a cue stroke, in place."""
    velocity, spin = struck(stroke, float(bodies.mass[index]), float(bodies.radius[index]))
    bodies.velocity[index] = velocity
    bodies.roll[index], bodies.angular_velocity[index] = spin[:2], spin[2]
