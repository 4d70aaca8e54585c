"""Scene: the contents of a scene file, with the start state that follows from them."""

from functools import cached_property
from typing import TYPE_CHECKING

from sandbox.echo import short_repr
from sandbox.html_repr import HtmlRepr
from sandbox.scene.description.base import BodySource
from sandbox.scene.description.scene import SceneDescription

if TYPE_CHECKING:  # reading a file needs no numpy
    from sandbox.scene.compile.bodies import Bodies
    from sandbox.scene.compile.joint_arrays import JointArrays


class Scene(SceneDescription, HtmlRepr):
    """Contents of a scene file."""

    @cached_property
    def bodies(self) -> "Bodies":
        """Bodies in scene order as arrays, with generators expanded."""
        from sandbox.scene.compile.start_state import start_bodies

        return start_bodies(self)

    @cached_property
    def links(self) -> "JointArrays":
        """Joints as arrays; they refer to the indices of `bodies`."""
        from sandbox.scene.compile.joints import compile_joints

        return compile_joints(self, self.bodies)

    @cached_property
    def elements(self) -> tuple[BodySource, ...]:
        """Shape and material of the bodies in scene order; generators are expanded."""
        from sandbox.scene.compile.layout import elements_in

        return elements_in(self)

    def source_index(self, element: int) -> int:
        """Return the index in `body_sources` of the source to which an element belongs.

        Elements that were added to a running scene continue the numbering after the last source.
        """
        from sandbox.scene.compile.layout import elements_of

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
        counts = [_counted(len(self.bodies), "body", "bodies")]
        counts += [
            _counted(len(each), kind, f"{kind}s") for kind, each in {**elements, "zone": self.zones}.items() if each
        ]
        if len(self.links):
            counts.append(_counted(len(self.links), "joint", "joints"))
        x, y = self.world.gravity
        figures = f"gravity ({x:g}, {y:g}) m/s², duration {self.world.duration:g} s, dt {self.solver.dt:g} s"
        return f"<Scene {short_repr(self.title)}: {', '.join(counts)}\n  {figures}>"

    __str__ = __repr__


def _counted(count: int, noun: str, nouns: str) -> str:
    return f"{count:,} {noun if count == 1 else nouns}"
