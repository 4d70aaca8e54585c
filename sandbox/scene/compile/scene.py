"""Scene: the contents of a scene file, with the start state that follows from them."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

from pydantic import PrivateAttr

from sandbox.echo import short_repr
from sandbox.formatting import format_plural
from sandbox.html_repr import HtmlRepr
from sandbox.scene.description.base import BodySource, BodySpec
from sandbox.scene.description.game_tables import unexpanded
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.description.surface import Stroke, struck

if TYPE_CHECKING:  # reading a file needs no numpy
    from sandbox.scene.compile.bodies import Bodies
    from sandbox.scene.compile.joint_arrays import JointArrays


class Scene(SceneDescription, HtmlRepr):
    """Contents of a scene file."""

    _start: "tuple[Bodies, JointArrays] | None" = PrivateAttr(default=None)
    """bodies and joints of another start than that of the file; copies with other settings or duration keep them"""

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with other values, which keeps another start than that of the file."""
        copied = super().model_copy(update=update, deep=deep)
        copied._start = self._start
        return copied

    def started_from(self, bodies: "Bodies") -> Self:
        """Return the scene with another start state of its bodies; joints keep their rest lengths and angles.

        Args:
            bodies: bodies of this scene in another state, such as those of `Starts`. A scene file cannot state it.
        """
        started = self.model_copy()
        for name in ("bodies", "joint_arrays"):  # the copy has those that are computed already
            started.__dict__.pop(name, None)
        started._start = bodies, self.joint_arrays
        return started

    @property
    def is_perturbed(self) -> bool:
        """Whether it has another start than that of the file."""
        return self._start is not None

    @cached_property
    def bodies(self) -> "Bodies":
        """Bodies in scene order as arrays, with generators expanded."""
        return start_bodies(self) if self._start is None else self._start[0]

    @cached_property
    def joint_arrays(self) -> "JointArrays":
        """Joints as arrays; they refer to the indices of `bodies`."""
        if self._start is not None:
            return self._start[1]
        from sandbox.scene.compile.joints import compile_joints

        return compile_joints(self, self.bodies)

    @cached_property
    def elements(self) -> tuple[BodySource, ...]:
        """Shape and material of the bodies in scene order; generators are expanded."""
        from sandbox.scene.compile.bodies import elements_in

        return elements_in(self)

    def with_duration(self, duration: float) -> Self:
        """Return the scene with another duration, s."""
        return self.model_copy(update={"world": self.world.model_copy(update={"duration": duration})})

    def source_index(self, element: int) -> int:
        """Return the index in `body_sources` of the source to which an element belongs.

        Elements that were added to a running scene continue the numbering after the last source.
        """
        from sandbox.scene.compile.bodies import elements_of

        if len(self.elements) == len(self.body_sources):
            return element
        for index, source in enumerate(self.body_sources):
            element -= len(elements_of(source))
            if element < 0:
                return index
        return len(self.body_sources) + element

    def __repr__(self) -> str:
        """Return the title, the counts of elements and the key figures, as `str` does."""
        elements = {"plane": self.planes, "wall": self.walls, "post": self.posts, "pocket": self.pockets}
        elements |= {"zone": self.zones, "sensor": self.sensors}
        counts = [format_plural(len(self.bodies), "body", "bodies")]
        counts += [format_plural(len(each), kind) for kind, each in elements.items() if each]
        if len(self.joint_arrays):
            counts.append(format_plural(len(self.joint_arrays), "joint", "joints"))
        x, y = self.world.gravity
        figures = f"gravity ({x:g}, {y:g}) m/s², duration {self.world.duration:g} s, dt {self.solver.dt:g} s"
        return f"<Scene {short_repr(self.title)}: {', '.join(counts)}\n  {figures}>"

    __str__ = __repr__


def start_bodies(scene: SceneDescription) -> "Bodies":
    """Return the bodies of a scene in scene order, in the state in which the scene starts.

    Generators are expanded, cue strokes applied, and moments of inertia set by drives.

    Raises:
        GeneratorError: the balls of a generator do not fit.
        OutlineError: an outline cannot be cut into convex pieces.
        ValueError: the scene was built in code and has a preset that is not expanded.
    """
    from sandbox.scene.compile.bodies import Layout, elements_in, join_layouts, layout_of_singles

    preset = unexpanded(scene)
    if preset is not None:
        raise ValueError(f"its [{preset}] is not expanded; sandbox.scene.files.presets.expanded does that")
    names: list[str] = []
    layouts: list[Layout] = []
    for kind, sources in scene.kinds.items():
        singles = [each for each in sources if isinstance(each, BodySpec)]
        if singles:
            layouts.append(layout_of_singles(singles))
            names += [each.name or default_name(kind, k) for k, each in enumerate(sources)]
            continue
        for k, each in enumerate(sources):
            from sandbox.scene.compile.generators import layout_of

            layout, stem = layout_of(each, scene.world.seed, k, scene.world.gravity), each.name or default_name(kind, k)
            layouts.append(layout)
            names += [f"{stem}-{ending}" for ending in layout.endings or range(1, len(layout) + 1)]
    spheres = scene.surface is not None and scene.surface.bodies == "spheres"
    bodies = join_layouts(names, elements_in(scene), layouts, spheres, scene.layers, len(scene.zones))
    for shot in scene.shots:
        if shot.ball in names:
            _strike(bodies, names.index(shot.ball), shot)
    if not scene.drives:
        return bodies
    from sandbox.scene.compile.drives import with_drive_moments

    return with_drive_moments(scene, bodies)


def _strike(bodies: "Bodies", index: int, stroke: Stroke) -> None:
    """Give a sphere the velocity and spin of a cue stroke, in place."""
    velocity, spin = struck(stroke, float(bodies.mass[index]), float(bodies.radius[index]))
    bodies.velocity[index] = velocity
    bodies.roll[index], bodies.angular_velocity[index] = spin[:2], spin[2]
