"""Setup: the compiled state from which an engine starts a scene, at its beginning or in the middle of a session."""

import math
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any, Self, Union

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.drives import initial_drive_states
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Passing, PlaneReach
from sandbox.scene.description.joints import Motor, Prismatic, Wheel
from sandbox.scene.description.scene import default_name


@dataclass(frozen=True, eq=False)
class Setup:
    """State from which an engine starts a scene, with N bodies, J joints and D drives.

    Functions that accept `Scene | Setup` treat a scene as its own start state, `Setup.of(scene)`.
    """

    scene: Scene
    """the scene; its `bodies` and `joint_arrays` are those at its start"""
    bodies: Bodies
    """the N bodies that are present, in their state at `time`"""
    joints: JointArrays
    """the J unbroken joints, with indices into `bodies`"""
    drives: FloatArray
    """(D, 3) state of each drive: level, torque or pull, rate of the pull"""
    time: float = 0.0
    """s, time in the session at which the state begins; 0 at the start of the scene"""
    passing: Passing = ()
    """pairs of a body and the one-way wall or body that it is passing"""
    plane_reach: PlaneReach | None = None
    """extent of half-planes; None leaves it to the engine"""
    is_start: bool = field(default=False, init=False)
    """whether it is the state in which the scene starts; false for every copy with changes"""

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        """Return itself: it never changes, so that copies of a simulation can share it."""
        return self

    @classmethod
    def of(cls, start: Union[Scene, "Setup"]) -> "Setup":
        """Return the start state of a scene, or a setup as it is."""
        if isinstance(start, Setup):
            return start
        setup = cls(start, start.bodies, start.joint_arrays, initial_drive_states(start))
        object.__setattr__(setup, "is_start", True)
        return setup

    def placed(
        self,
        bodies: Bodies,
        time: float = 0.0,
        broken: Collection[int] = (),
        drives: FloatArray | None = None,
        passing: Passing = (),
        plane_reach: PlaneReach | None = None,
    ) -> Self:
        """Return a later state: bodies moved, removed or added, joints with their bodies, and broken ones left out.

        Args:
            bodies: bodies at that time; those of this setup are found by their names.
            time: s.
            broken: indices of the broken joints.
            drives: (D, 3) state of the drives; default: their initial state.
            passing: pairs of a body and the one-way wall or body that it is passing.
            plane_reach: extent of half-planes.
        """
        joints = self.joints.without(broken).among(bodies.names, self.bodies.names).clicked(bodies.angle)
        drives = initial_drive_states(self.scene) if drives is None else drives
        return replace(
            self, bodies=bodies, joints=joints, drives=drives, time=time, passing=passing, plane_reach=plane_reach
        )

    def with_scene(self, scene: Scene) -> Self:
        """Return the same state with changed values of the scene.

        Elements of the scene are replaced; those of bodies that were added since are kept. Motors that differ get their
        new values. Bodies and other joints are not compiled again, because that would restore removed bodies and broken
        joints, and lay out ropes along the new gravity.

        Args:
            scene: scene with as many elements as this one, such as from `change_value`.
        """
        spawned = self.bodies.elements[len(self.scene.elements) :]
        bodies = replace(self.bodies, elements=(*scene.elements, *spawned))
        return replace(self, scene=scene, bodies=bodies, joints=self._joints_of(scene))

    def _joints_of(self, scene: Scene) -> JointArrays:
        """Return the joints with the values of the motors of a scene that differ from those of this one."""
        if scene.joints is self.scene.joints:
            return self.joints
        figures, max_force = self.joints.figures.copy(), self.joints.max_force.copy()
        for index, (motor, before) in enumerate(zip(scene.joints, self.scene.joints, strict=True)):
            name = motor.name or default_name("joint", index)
            if motor == before or name not in self.joints.names:
                continue
            first = self.joints.names.index(name)
            for row in self.joints.whole(np.asarray([first])).tolist():
                kind = self.joints.kind[row]
                if kind == JointKind.MOTOR and isinstance(motor, Motor | Wheel):
                    figures[row, 0] = motor.rate
                    max_force[row] = math.inf if motor.max_torque is None else motor.max_torque
                elif kind == JointKind.LINEAR_MOTOR and isinstance(motor, Prismatic):
                    figures[row, 2] = motor.rate
                    max_force[row] = math.inf if motor.max_force is None else motor.max_force
        return replace(self.joints, figures=figures, max_force=max_force)
