"""Agreement: checks, run once before a row is timed, that both of its sides compute the same."""

import numpy as np
import pymunk

import sandbox
from sandbox.engines.registry import start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Frame
from sandbox.window.render.palette import BACKGROUND
from tools.benchmarks import connected, drawing, peers
from tools.benchmarks.workloads import particles_in_flight


def pile(scene: Scene) -> None:
    """Check half a second of a pile against pymunk's loop by hand: balls, and which of them touch what."""
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.5})})
    frames, contacts = peers.pile_arrays(short)
    found = run(short, audit=False)
    assert len(found.position) == len(frames)
    # The same calls of the same solver; rounding of constants, 1e-16, grows to 4e-13 m by then.
    assert np.allclose(found.position, frames[:, :, :2], rtol=0.0, atol=1e-9)
    # Rows of a pair are split otherwise, so the pairs are compared; the loop numbers fixed bodies after the balls.
    pairs = np.where(found.contact_pair < 0, len(scene.bodies) - 1 - found.contact_pair, found.contact_pair)
    assert {frozenset(pair) for pair in pairs.tolist()} == {frozenset(map(int, row[1:3])) for row in contacts}


def audited(scene: Scene) -> None:
    """Check that the audit changes nothing."""
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.25})})
    with_audit, without = run(short), run(short, audit=False)
    assert np.array_equal(with_audit.position, without.position)


def flight(substeps: int = 1, count: int = 1000) -> None:
    """Check particles in free flight against two lines of numpy, after 10 frames."""
    scene = particles_in_flight(count, substeps)
    simulation = start(scene, "pymunk")
    begun = simulation.frame()
    position, velocity = begun.position.copy(), begun.velocity.copy()
    for _ in range(10):
        simulation.step()
    peers.fly(position, velocity, 0.01 / substeps, 10 * substeps)
    frame = simulation.frame()
    assert np.allclose(frame.position, position, rtol=1e-12, atol=1e-12)  # rounding of sums of 160 terms
    assert np.allclose(frame.velocity, velocity, rtol=1e-12, atol=1e-12)  # likewise


def stepped(scene: Scene, engine: str, steps: int, *, contacts: bool = False, turning: bool = False) -> Frame:
    """Return the frame of a scene on an engine after some steps."""
    simulation = start(scene, engine)
    if contacts:
        simulation.contacts()
    if turning:
        peers.give_moments(simulation, scene)
    for _ in range(steps):
        simulation.step()
    return simulation.frame()


def without_contacts(scene: Scene, steps: int = 60) -> None:
    """Check that recording contacts changes nothing."""
    recorded, bare = stepped(scene, "pymunk", steps, contacts=True), stepped(scene, "pymunk", steps)
    assert np.array_equal(recorded.position, bare.position)


def without_rotation(scene: Scene, steps: int = 100) -> None:
    """Check that balls that nothing can turn move alike with a moment of inertia and without."""
    turning, bare = stepped(scene, "pymunk", steps, turning=True), stepped(scene, "pymunk", steps)
    assert np.array_equal(turning.position, bare.position)


def pile_on_engines(scene: Scene, steps: int = 240) -> None:
    """Check that a pile on the reference and on pymunk is as high: the height of its centre of mass, to 2 %.

    Positions of single balls are chaotic.
    """
    heights = [float(stepped(scene, engine, steps).position[:, 1].mean()) for engine in ("reference", "pymunk")]
    assert abs(heights[0] / heights[1] - 1.0) < 0.02, heights


def one_ball(scene: Scene, steps: int = 20) -> None:
    """Check that a falling ball is in the same place on the reference and on pymunk."""
    reference, pymunk = stepped(scene, "reference", steps), stepped(scene, "pymunk", steps)
    # Velocity and position are updated in one or the other order, which moves a fall of n steps by n·g·h² at most.
    assert np.abs(reference.position - pymunk.position).max() <= 1.01 * steps * 9.81 * scene.solver.h**2


def bounce(scene: Scene, tolerance: float) -> None:
    """Check the heights of a bounce on `exact` against the closed form; the peer is sought to the same tolerance, m."""
    simulation, truth = start(scene, "exact"), peers.bounce_truth(scene)
    for height in truth:
        simulation.step()
        assert abs(float(simulation.frame().position[0, 1]) - 0.5 - height) <= tolerance


def cloth(engine: str, steps: int = 50) -> None:
    """Check the nodes of a cloth after 50 ms against pymunk's springs by hand."""
    scene = loads(connected.CLOTH)
    frame, space = stepped(scene, engine, steps), connected.cloth_space(scene)
    for _ in range(steps):
        space.step(scene.solver.h)
    by_hand = np.array([tuple(body.position) for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC])
    # It has fallen by 12 mm where it is free. Springs as forces and as impulses differ by the order of the step.
    assert np.abs(frame.position[~scene.bodies.fixed] - by_hand).max() < 1e-3


def planks(steps: int = 40) -> None:
    """Check that a heap of planks is the same by oriented boxes and by discs around them."""
    scene = connected.heap()
    found = []
    for broad_phase in ("oriented", "circles"):
        simulation = start(scene, "reference", scene.solver.replace(broad_phase=broad_phase))
        for _ in range(steps):
            simulation.step()
        found.append(simulation.frame().position)
    assert np.allclose(found[0], found[1], rtol=0.0, atol=1e-9)  # contacts may be in another order: rounding


def picture(scene: Scene, steps: int, antialias: bool) -> None:
    """Check that balls cover the pixels that pymunk's debug drawing covers, but for a tenth: outlines."""
    balls = drawing.picture_of(scene, steps, antialias) != drawing.picture_of(scene, steps, antialias, bodies=False)
    ours, theirs = balls.any(axis=2), (drawing.debug_picture_of(scene, steps) != BACKGROUND).any(axis=2)
    assert theirs.mean() > 0.05
    assert (ours ^ theirs).sum() < 0.1 * theirs.sum()


def threads(scene: Scene, shots: int = 20) -> None:
    """Check that a fan of shots ends alike on one thread and on two."""
    table = sandbox.Table(scene)
    cue = scene.bodies.names.index("cue")
    motion = (*scene.bodies.velocity[cue], *scene.bodies.roll[cue], scene.bodies.angular_velocity[cue])
    motions = np.multiply.outer(np.linspace(0.9, 1.1, shots), motion)
    one, two = (table.fan_of(motions, threads=count) for count in (1, 2))
    assert np.array_equal(one.position, two.position)
    assert np.array_equal(one.pocket, two.pocket)
