"""Workload: the cost of a step of a fixed-step engine, estimated from the scene before anything is allocated."""

import numpy as np

from sandbox.resource_limits import PAIRS, STEP_WORK
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.validate.bodies import MAX_OVERLAPS, MAX_OVERLAPS_EACH, count_overlaps

CONTACTS_PER_BODY = 2
"""Contacts per body in a heap. In a stack of boxes, each box has one contact of two points."""
DETECTION_COST = 10
"""Cost of finding one contact in a substep, in iterations of one contact."""


def overload(setup: Setup, settings: Settings) -> list[str]:
    """Return why a step would take too long: because of its iterations, attractions or liquids."""
    scene, bodies = setup.scene, setup.bodies
    can_collide = np.asarray([element.collides != "none" for element in bodies.elements], np.bool_)[bodies.element]
    is_moving = can_collide & ~bodies.fixed
    moving_count = int(is_moving.sum())
    iterations = (settings.iterations + DETECTION_COST) * settings.substeps
    max_overlaps = MAX_OVERLAPS + MAX_OVERLAPS_EACH * moving_count  # validation refuses a scene that starts with more
    overlaps = 0
    if max_overlaps * iterations > STEP_WORK.value:  # rare; other scenes need no search for overlaps
        overlaps = count_overlaps(bodies.position[is_moving], bodies.core[is_moving], max_overlaps)
    rows = max(CONTACTS_PER_BODY * moving_count, overlaps) + len(setup.joints)
    solver_refusal = STEP_WORK.refusal(
        f"a step of up to {rows:,} contacts and joints × ({settings.iterations:,} iterations + {DETECTION_COST} for "
        f"detection) × {settings.substeps:,} substeps takes work of",
        rows * iterations,
    )
    attraction_refusal = PAIRS.refusal(
        f"{len(scene.attractions):,} attractions of {len(bodies):,} bodies need this many pairs per step:",
        len(scene.attractions) * len(bodies) * settings.substeps,
    )
    liquid_refusal = PAIRS.refusal(
        f"{len(scene.liquids):,} liquids and {len(bodies):,} bodies need this many pairs per step:",
        len(scene.liquids) * len(bodies) * settings.substeps,
    )
    return [reason for reason in (solver_refusal, attraction_refusal, liquid_refusal) if reason is not None]
