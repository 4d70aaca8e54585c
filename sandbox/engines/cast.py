"""Cast: what actions ask of an engine's running scene."""

from typing import Protocol

from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Collides, Scene, Single
from sandbox.scene.surfaced import Mover
from sandbox.trajectory import BoolArray, FloatArray


class Cast(Protocol):
    """The bodies of a running scene, as an engine keeps them."""

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""

    @property
    def bodies(self) -> Bodies:
        """The bodies by number; spawned ones at the end."""

    @property
    def h(self) -> float:
        """The substep, s."""

    @property
    def present(self) -> BoolArray:
        """(N,) which bodies are there."""

    def motion(self, number: int) -> tuple[FloatArray, float]:
        """Return a body's velocity (2,), m/s, and angular velocity, rad/s."""

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s."""

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s."""

    def set_roll(self, number: int, roll: tuple[float, float]) -> None:
        """Give a sphere on a floor an angular velocity about x and y, rad/s."""

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force, N, and torque, N·m, act on a body from now on.

        Raises:
            ActionError: the engine models no such force.
        """

    def put(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Refuse a place that this engine cannot start from, though others may.

        Raises:
            ActionError: it is one.
        """

    def change(self, scene: Scene, spawned: tuple[Mover, ...] | None = None) -> None:
        """Go on with a scene that differs alone in air, gravity, coefficients, courses of walls, or in what is solid.

        Args:
            scene: the changed one.
            spawned: the elements that joined since the start, with other coefficients; by default as they are.

        Raises:
            ActionError: it asks for what the settings or the engine cannot go on with.
        """

    def throttle(self, number: int, level: float) -> None:
        """Open the scene's thrust of that number to a share of its force.

        Raises:
            ActionError: the engine models no thrust.
        """

    def drive(self, number: int, level: float) -> None:
        """Ask the scene's drive of that number for a level.

        Raises:
            ActionError: the engine models no drives.
        """

    def add(self, single: Single, name: str) -> int:
        """Add a body that was checked, and return its number.

        Raises:
            ActionError: the engine cannot.
        """
