"""Rig for the tests of joints: a few bodies, their links and a minimal step loop."""

import math
from typing import Any

import numpy as np

from sandbox.engines.forces.air import Air
from sandbox.engines.reference.integrators import INTEGRATORS, Inputs, transition
from sandbox.engines.reference.joints import JointSolver, kick_pose
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind

G = 9.81
BIAS = 0.9**60
"""pymunk's default error bias: a tenth of a joint error is corrected in 1/60 s."""


def link(kind: JointKind, a: int, b: int, *figures: float, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "a": a, "b": b, "figures": [*figures, 0.0, 0.0, 0.0][:3], **more}


def compile_joints(*links: dict[str, Any]) -> JointArrays:
    def column(name: str, default: Any, kind: type = np.float64) -> Any:
        return np.array([each.get(name, default) for each in links], dtype=kind)

    return JointArrays(
        kind=column("kind", 0, np.int64),
        a=column("a", -1, np.int64),
        b=column("b", 0, np.int64),
        anchor_a=column("anchor_a", (0.0, 0.0)).reshape(-1, 2),
        anchor_b=column("anchor_b", (0.0, 0.0)).reshape(-1, 2),
        figures=column("figures", (0.0, 0.0, 0.0)).reshape(-1, 3),
        wheels=column("wheels", (0.0,) * 4).reshape(-1, 4),
        max_force=column("max_force", np.inf),
        max_bias=column("max_bias", np.inf),
        bias=column("bias", np.nan),
        pulls_only=column("pulls_only", False, np.bool_),
        collide=column("collide", False, np.bool_),
        strength=column("strength", np.inf),
        number=np.arange(len(links)),
        part_of=np.arange(len(links)),
        names=tuple(f"link {k}" for k in range(len(links))),
    )


class Rig:
    """Bodies with links, stepped as the engine steps them, without contacts."""

    def __init__(
        self,
        links: JointArrays,
        pose: Any,
        rates: Any = 0.0,
        mass: Any = 1.0,
        moment: Any = math.inf,
        *,
        method: str = "impulses",
        integrator: str = "semi_implicit_euler",
        iterations: int = 10,
        bias: float = BIAS,
        cap: float = math.inf,
        gravity: float = G,
        drag: float = 0.0,
        forces: Any = None,
    ) -> None:
        pose = np.atleast_2d(np.asarray(pose, dtype=float))
        if pose.shape[1] == 2:
            pose = np.column_stack((pose, np.zeros(len(pose))))
        self.x = np.stack((pose, np.broadcast_to(rates, pose.shape)))
        self.mass = np.broadcast_to(np.asarray(mass, dtype=float), len(pose)).copy()
        self.moment = np.broadcast_to(np.asarray(moment, dtype=float), len(pose)).copy()
        self.solver = JointSolver(links, 1 / self.mass, 1 / self.moment, bias, iterations, method, cap)
        self.integrator = INTEGRATORS[integrator]
        constant = np.zeros_like(pose)
        constant[np.isfinite(self.mass), 1] = -gravity
        applied = forces or (lambda x: 0.0)
        self.u = Inputs(constant, Air(drag), contacts=lambda x: self.solver.forces(x) + applied(x))
        self.time, self.gravity = 0.0, gravity

    def step(self, h: float) -> None:
        moved = self.integrator.step(transition, self.time, self.x, self.u, h)
        if self.solver.method == "impulses":
            fraction = self.integrator.fraction
            self.solver.prepare(kick_pose(moved, fraction, h), h)
            kicked = moved[1].copy()
            self.solver.solve(moved[1])
            moved[0] += fraction * h * (moved[1] - kicked)
        else:
            self.solver.project(self.x, moved, h)
        self.x, self.time = moved, self.time + h

    def run(self, time: float, h: float) -> "Rig":
        for _ in range(round(time / h)):
            self.step(h)
        return self

    @property
    def pose(self) -> Any:
        return self.x[0]

    @property
    def rates(self) -> Any:
        return self.x[1]

    @property
    def energy(self) -> float:
        moves = np.isfinite(self.mass)
        kinetic = 0.5 * (self.mass[moves] * (self.rates[moves, :2] ** 2).sum(axis=1)).sum()
        turns = np.isfinite(self.moment)
        kinetic += 0.5 * (self.moment[turns] * self.rates[turns, 2] ** 2).sum()
        return float(kinetic + self.gravity * (self.mass[moves] * self.pose[moves, 1]).sum())

    @property
    def momentum(self) -> Any:
        return (self.mass[:, None] * self.rates[:, :2]).sum(axis=0)

    @property
    def angular_momentum(self) -> float:
        x, v = self.pose[:, :2], self.rates[:, :2]
        spin = np.where(np.isfinite(self.moment), self.moment, 0.0) * self.rates[:, 2]
        return float((self.mass * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) + spin).sum())


def pendulum(angle: float, **more: Any) -> Rig:
    """Return a ball on a rod of 1 m that hangs from the origin, `angle` degrees from straight down, at rest."""
    a = math.radians(angle)
    return Rig(compile_joints(link(JointKind.ROD, -1, 0, 1.0)), [math.sin(a), -math.cos(a)], **more)
