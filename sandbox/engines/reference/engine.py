"""The engine `reference`: its capabilities, refusals and default choices. No solver is imported before the start."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sandbox.engines.common.solver_settings import BIAS, setting_faults, slop_of
from sandbox.engines.common.workload import overload
from sandbox.engines.tabletop.requirements import on_floor, unsupported_by_steppers
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import BALLS, FLOOR, JOINTS, SURFACES, Demand, demands, unmodelled
from sandbox.scene.compile.drives import names_of
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings

if TYPE_CHECKING:
    from sandbox.engines.reference.simulation import ReferenceSimulation
    from sandbox.engines.tabletop.simulation import SteppedTabletopSimulation


def _drive_faults(setup: Setup, wanted: frozenset[Demand], settings: Settings) -> list[str]:
    """Return the demands and settings of a scene with drives or kinematic bodies that are not supported."""
    missing, driven = [], "drives" if Demand.DRIVES in wanted else "kinematic bodies"
    if settings.detection in ("bisect", "swept"):
        missing.append(f"detection {settings.detection!r} does not support {driven}; 'discrete' and 'shrink' do")
    if Demand.ATTRACTION in wanted:
        missing.append(f"it does not model attraction and {driven} together")
    jointed = _fixed_joint_with_drive(setup)
    if jointed is not None:
        body, drive = jointed
        missing.append(f"it does not model a joint to {body!r}, whose motion the drive {drive!r} prescribes")
    bodies = setup.bodies
    kinematic = np.flatnonzero(bodies.kinematic & setup.joints.held(len(bodies)))
    if len(kinematic):
        missing.append(f"it does not model a joint to {bodies.names[kinematic[0]]!r}, which is kinematic")
    return missing


def _fixed_joint_with_drive(setup: Setup) -> tuple[str, str] | None:
    """Return a driven body that has a joint as well, and its drive; None if there is none."""
    scene, numbers = setup.scene, setup.bodies.number_of
    joined = setup.joints.held(len(setup.bodies))
    for drive, name in zip(scene.drives, names_of(scene), strict=True):
        if drive.body in numbers and joined[numbers[drive.body]]:
            return drive.body, name
    return None


def _max_bias_faults(setup: Setup, settings: Settings) -> list[str]:
    """Return the first joint with a largest speed of correction, if the method of joints does not have it."""
    limited = np.flatnonzero(np.isfinite(setup.joints.max_bias))
    if settings.joints in (None, "impulses") or not len(limited):
        return []
    return [f"max_bias of {setup.joints.names[int(limited[0])]!r} needs joints = 'impulses', not {settings.joints!r}"]


def _max_force_faults(setup: Setup) -> list[str]:
    """Return the first joint whose largest force is not supported: springs are forces, and grooves have two rows."""
    for kind in (JointKind.SPRING, JointKind.ROTARY_SPRING, JointKind.GROOVE):
        joints = setup.joints.of(kind)
        limited = np.flatnonzero(np.isfinite(joints.max_force))
        if len(limited):
            word = kind.name.lower().replace("_", " ")
            return [f"max_force of a {word} is not supported ({joints.names[int(limited[0])]!r})"]
    return []


DEFAULT_METHODS = {"integrator": "explicit_euler", "detection": "discrete", "response": "impulse"}
"""Default methods: those of pymunk and of the tutorial"""

TABLETOP = BALLS | FLOOR | SURFACES | {Demand.DAMPING, Demand.CURL}
"""Demands that the engine models in scenes with a surface, as far as `unsupported_by_steppers` allows"""

TABLETOP_METHODS = {**DEFAULT_METHODS, "impact": "newton", "persistence": 1}
"""Settings of scenes with a surface, each with its only supported value"""

ABSENT = {"half_kick": "only pymunk has it; integrator 'velocity_verlet' is as accurate"}
"""Settings that the engine does not have, with the reason"""

ABSENT_ON_TABLETOP = dict.fromkeys(("joints", "stretch", "stiffness", "damping"), "a [surface] has nothing of the kind")
"""The same in scenes with a surface"""

JOINT_INTEGRATORS = {"relaxation": "semi_implicit_euler", "xpbd": "semi_implicit_euler", "rattle": "velocity_verlet"}
"""Default integrators of position-based joint methods: they change velocities before positions are corrected."""

CONSTRAINTS = JOINTS - {Demand.SPRINGS, Demand.ROTARY_SPRINGS, Demand.BANDS}
"""Joints that are constraints; springs are forces"""

MAX_ALL_PAIRS = 24
"""Number of bodies up to which testing all pairs is faster than sorting them"""

MAX_GRID_RATIO = 8.0
"""Largest ratio of radii for which a uniform grid is used"""


@dataclass(frozen=True)
class ReferenceEngine:
    """Hand-written engine with a fixed step. Integrator, broad phase, detection and response are chosen by settings.

    With explicit_euler, discrete and impulse the scheme is that of pymunk, except for drag: pymunk applies it as an
    exponential step, this engine as a force.
    """

    name: str = "reference"
    about: str = "hand-written, fixed step: choice of integrator, broad phase, detection and response"
    capabilities: frozenset[Demand] = TABLETOP | {
        Demand.FALLOFF,
        Demand.KICKS,
        Demand.ONE_WAY,
        Demand.PASSABLE,
        Demand.POLYGONS,
        *JOINTS - {Demand.RATCHETS},
        Demand.MAX_FORCE,
        Demand.MAX_BIAS,
        Demand.DAMPING,
        Demand.LIFT,
        Demand.BODY_DAMPING,
        Demand.GRAVITY_SCALE,
        Demand.SPEED_LIMITS,
        Demand.ROLLING,
        Demand.ATTRACTION,
        Demand.THRUST,
        Demand.TYRES,
        Demand.BUOYANCY,
        Demand.LAYERS,
        Demand.CATEGORIES,
        Demand.GROUPS,
        Demand.ZONES,
        Demand.DRIVES,
        Demand.KINEMATIC,
        Demand.PATHS,
        Demand.ONE_WAY_BODIES,
    }
    knows_impulses: bool = True
    epsilon: float = 2.0**-52

    def missing(self, start: Scene | Setup, settings: Settings) -> tuple[str, ...]:
        """Return the demands and settings that the engine does not support."""
        setup = Setup.of(start)
        wanted = demands(setup)
        if on_floor(setup):
            return (*_tabletop_faults(setup, settings), *overload(setup, settings))
        missing = unmodelled(setup, self.capabilities) + setting_faults(settings, self.name, {"persistence": 1}, ABSENT)
        missing += self._detection_faults(wanted, settings)
        missing += _max_force_faults(setup) + _max_bias_faults(setup, settings)
        rods = setup.joints.of(JointKind.ROD)
        if settings.joints == "rattle" and len(points := np.flatnonzero(rods.figures[:, 0] == 0.0)):
            name = rods.names[points[0]]
            missing.append(
                f"joints 'rattle' needs the direction of each rod, and {name!r} has the length 0; use a pivot"
            )
        if wanted & {Demand.DRIVES, Demand.KINEMATIC}:
            missing += _drive_faults(setup, wanted, settings)
        if settings.broad_phase == "oriented" and Demand.POLYGONS not in wanted:
            missing.append("broad_phase 'oriented' needs polygons, and the scene has none; use 'grid' or 'sweep'")
        if settings.stretch is not None and settings.joints != "relaxation":
            missing.append("stretch applies to joints = 'relaxation' only")
        if settings.impact == "dissipative" and wanted & (CONSTRAINTS | {Demand.DRIVES, Demand.KINEMATIC}):
            missing.append("impact 'dissipative' does not support joints, drives and kinematic bodies; use 'newton'")
        if settings.impact == "dissipative":
            missing += [
                f"impact 'dissipative' does not support {demand}, which adds energy; use 'newton'"
                for demand in (Demand.SURFACE_SPEED, Demand.SURFACE_VELOCITY)
                if demand in wanted
            ]
        if settings.impact == "dissipative" and Demand.ROLLING in wanted:
            missing.append(f"impact 'dissipative' does not support {Demand.ROLLING}; use 'newton'")
        if settings.response == "penalty":
            missing += self._penalty_faults(setup, settings)
            if settings.impact is not None:
                missing.append("impact applies to response 'impulse' only")
            unsupported = Demand.FALLOFF, Demand.KICKS, Demand.SURFACE_SPEED, Demand.SURFACE_VELOCITY, Demand.ROLLING
            for demand in unsupported:
                if demand in wanted:
                    missing.append(f"response 'penalty' does not model {demand}; 'impulse' does")
        else:
            missing += [
                f"{key} applies to response 'penalty' only"
                for key in ("stiffness", "damping")
                if getattr(settings, key) is not None
            ]
        return (*missing, *overload(setup, settings))

    def _detection_faults(self, wanted: frozenset[Demand], settings: Settings) -> list[str]:
        """Return the demands that the detection of impacts within a step does not support."""
        missing = []
        if settings.detection == "swept" and Demand.POLYGONS in wanted:
            missing.append("detection 'swept' supports balls only; 'bisect' supports polygons too")
        if settings.detection in ("bisect", "swept") and wanted & CONSTRAINTS:
            missing.append(f"detection {settings.detection!r} does not support joints; 'shrink' does")
        return missing

    def _penalty_faults(self, setup: Setup, settings: Settings) -> list[str]:
        from sandbox.engines.reference.penalty import instability

        missing = [
            f"{key} applies to response 'impulse' only"
            for key in ("slop", "bias", "persistence")
            if getattr(settings, key) is not None
        ]
        if settings.detection in ("bisect", "swept"):
            missing.append(f"detection {settings.detection!r} leaves no overlap, but penalty springs need one")
        reason = instability(setup, self.resolve(setup, settings), settings.stiffness is not None)
        return missing if reason is None else [*missing, reason]

    def resolve(self, start: Scene | Setup, settings: Settings) -> Settings:
        """Return the settings with the engine's choice for every setting that is None."""
        setup = Setup.of(start)
        if on_floor(setup):
            own = {**TABLETOP_METHODS, "slop": slop_of(setup), "bias": BIAS, "broad_phase": _default_broad_phase(setup)}
            return settings.replace(**{k: v for k, v in own.items() if getattr(settings, k) is None})
        choices: dict[str, object] = {**DEFAULT_METHODS, "slop": slop_of(setup), "bias": BIAS, "persistence": 1}
        if len(setup.joints):
            choices["joints"] = "impulses"
        if demands(setup) & {Demand.SPRINGS, Demand.ROTARY_SPRINGS, Demand.ATTRACTION, Demand.BUOYANCY}:
            choices["integrator"] = "semi_implicit_euler"  # with explicit Euler, oscillations gain energy
        choices["integrator"] = JOINT_INTEGRATORS.get(settings.joints or "impulses", choices["integrator"])
        if settings.response == "penalty":
            from sandbox.engines.reference.penalty import default_stiffness

            choices["integrator"] = "semi_implicit_euler"  # explicit Euler makes springs gain energy
            choices["stiffness"] = default_stiffness(setup, settings)
        else:
            choices["impact"] = "newton"
        choices["broad_phase"] = _default_broad_phase(setup)
        return settings.replace(**{k: v for k, v in choices.items() if getattr(settings, k) is None})

    def start(
        self, start: Scene | Setup, settings: Settings | None = None
    ) -> "ReferenceSimulation | SteppedTabletopSimulation":
        """Start a scene, or continue from a setup.

        Raises:
            Refusal: a demand is not supported, or the first collision detection exceeds a resource limit.
        """
        from sandbox.engines.contract import Exhaustion, Refusal
        from sandbox.engines.reference.simulation import ReferenceSimulation

        setup = Setup.of(start)
        settings = setup.scene.solver if settings is None else settings
        missing = self.missing(setup, settings)
        if missing:
            raise Refusal(self.name, missing, ())
        resolved = self.resolve(setup, settings)
        try:
            if on_floor(setup):
                from sandbox.engines.reference.table_pairs import CirclePairFinder
                from sandbox.engines.tabletop.simulation import SteppedTabletopSimulation

                return SteppedTabletopSimulation(setup, resolved, CirclePairFinder)
            return ReferenceSimulation(setup, resolved)
        except Exhaustion as exhaustion:
            raise Refusal(self.name, (str(exhaustion),), ()) from None


def _tabletop_faults(setup: Setup, settings: Settings) -> list[str]:
    """Return the demands and settings of a scene with a surface that are not supported."""
    missing = unmodelled(setup, TABLETOP) + setting_faults(
        settings, "reference", TABLETOP_METHODS, ABSENT_ON_TABLETOP, " on a [surface]"
    )
    missing += unsupported_by_steppers(setup)
    if settings.broad_phase == "oriented":
        missing.append("broad_phase 'oriented' needs polygons, and the scene has none; use 'grid' or 'sweep'")
    return missing


def _default_broad_phase(setup: Setup) -> str:
    """Return the default broad phase, by the number and sizes of the bodies."""
    bodies = setup.bodies
    radius = bodies.radius[contact_matrix(setup).touches | bodies.fixed]
    if len(radius) <= MAX_ALL_PAIRS:
        return "all_pairs"
    return "grid" if radius.max() <= MAX_GRID_RATIO * radius.min() else "sweep"
