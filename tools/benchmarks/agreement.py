"""Agreement: checks that both sides of a row compute the same, run once before the row is timed."""

import numpy as np
import pymunk

import sandbox
from sandbox.engines.registry import start
from sandbox.measure.run.ensemble import ensemble
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from sandbox.trajectory import Frame
from sandbox.window.render.palette import BACKGROUND
from tools.benchmarks import box2d_peer, connected, drawing, peers, pooltool_shots, pymunk_loops
from tools.benchmarks.workloads import motion_of_first, particles_in_flight


def pile(scene: Scene) -> None:
    """Check half a second of a pile against the hand-written pymunk loops: states and pairs in contact."""
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.5})})
    _same_as_loops(short)


def _same_as_loops(scene: Scene) -> None:
    """Check a run on pymunk against each of the hand-written loops: states, and contacts except for their impulses.

    Where two shapes meet again within pymunk's persistence, the loop has the impulse of their last contact too, as
    pymunk reports it; the engine leaves it out.
    """
    found = run(scene, audit=False)
    frames, contacts = pymunk_loops.states_and_contacts(scene)
    ours = np.dstack((found.position, found.angle, found.velocity, found.angular_velocity))
    for loop in (frames, pymunk_loops.states(scene), pymunk_loops.attributes(scene)):
        # The same calls of the same solver; rounding of constants, 1e-16, grows to 3e-10 rad/s in this time.
        assert np.allclose(ours, loop, rtol=0.0, atol=1e-8)
    pairs = np.where(found.contact_pair < 0, len(scene.bodies) - 1 - found.contact_pair, found.contact_pair)
    rows = np.column_stack((found.contact_time, pairs, found.contact_normal, found.contact_point))
    flipped = pairs[:, 0] > pairs[:, 1]
    rows[flipped, 1:5] = np.column_stack((pairs[flipped, ::-1], -found.contact_normal[flipped]))
    assert len(rows) == len(contacts)
    for theirs in (rows, contacts):
        theirs[:] = theirs[np.lexsort((theirs[:, 2], theirs[:, 1], theirs[:, 0].round(9)))]
    assert np.allclose(rows, contacts[:, :7], rtol=0.0, atol=1e-8)  # as above


def pile_on_box2d(scene: Scene) -> None:
    """Check half a second of balls on box2d against the bare loop: positions, and the number of pairs that touch."""
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.5})})
    bare, found = box2d_peer.run_arrays(short), run(short, "box2d", audit=False)
    # The same calls with the same numbers; the first frame of ours is in 64-bit numbers, as the scene.
    assert np.array_equal(found.position[1:], bare.position[1:] / box2d_peer.scale_of(short))
    assert len(found.contact_time) == len(bare.began)


def balls(scene: Scene) -> None:
    """Check balls that fall onto a plane against the pymunk loops, and other engines until they touch it."""
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.6})})
    _same_as_loops(short)
    found = run(short, audit=False)
    for engine in ("reference", "exact"):
        other = run(short, engine, audit=False)
        height = 0.5 * 9.81 * 0.3 * 0.01  # error of explicit Euler after 0.3 s
        assert np.abs(other.position[30] - found.position[30]).max() <= 1.001 * height, engine


def members(scene: Scene, engine: str) -> None:
    """Check that runs of an ensemble end as ordinary runs do, bit for bit."""
    vary = {"ball.*.velocity": 0.01}
    compiled = ensemble(scene, 3, vary=vary, engine=engine)
    ordinary = ensemble(scene, 3, vary=vary, engine=engine, keep="contacts")
    assert compiled.compiled.all() and not ordinary.compiled.any()
    assert np.array_equal(compiled.position, ordinary.position)


def audited(scene: Scene) -> None:
    """Check that the audit does not change the positions."""
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.25})})
    with_audit, without = run(short), run(short, audit=False)
    assert np.array_equal(with_audit.position, without.position)


def flight(substeps: int = 1, count: int = 1000) -> None:
    """Check particles in free flight against two lines of numpy, after 10 frames."""
    scene = particles_in_flight(count, substeps)
    simulation = start(scene, "pymunk")
    initial = simulation.frame()
    position, velocity = initial.position.copy(), initial.velocity.copy()
    for _ in range(10):
        simulation.step()
    peers.fly(position, velocity, 0.01 / substeps, 10 * substeps)
    frame = simulation.frame()
    assert np.allclose(frame.position, position, rtol=1e-12, atol=1e-12)  # rounding of sums of 160 terms
    assert np.allclose(frame.velocity, velocity, rtol=1e-12, atol=1e-12)  # same reason


def stepped(scene: Scene, engine: str, steps: int, *, contacts: bool = False, turning: bool = False) -> Frame:
    """Return the frame of a scene on an engine after a number of steps."""
    simulation = start(scene, engine)
    if contacts:
        simulation.contacts()
    if turning:
        peers.give_moments(simulation, scene)
    for _ in range(steps):
        simulation.step()
    return simulation.frame()


def without_contacts(scene: Scene, steps: int = 60) -> None:
    """Check that recording contacts does not change the positions."""
    recorded, bare = stepped(scene, "pymunk", steps, contacts=True), stepped(scene, "pymunk", steps)
    assert np.array_equal(recorded.position, bare.position)


def without_rotation(scene: Scene, steps: int = 100) -> None:
    """Check that balls that cannot be turned move alike with a moment of inertia and without."""
    turning, bare = stepped(scene, "pymunk", steps, turning=True), stepped(scene, "pymunk", steps)
    assert np.array_equal(turning.position, bare.position)


def pile_on_engines(scene: Scene, steps: int = 240) -> None:
    """Check that a pile on the reference and on pymunk has the same height of its centre of mass, to 2 %.

    Positions of single balls are chaotic.
    """
    heights = [float(stepped(scene, engine, steps).position[:, 1].mean()) for engine in ("reference", "pymunk")]
    assert abs(heights[0] / heights[1] - 1.0) < 0.02, heights


def one_ball(scene: Scene, steps: int = 20) -> None:
    """Check that a falling ball has the same position on the reference and on pymunk."""
    reference, pymunk = stepped(scene, "reference", steps), stepped(scene, "pymunk", steps)
    # The engines update velocity and position in different order, which shifts a fall of n steps by at most n·g·h².
    assert np.abs(reference.position - pymunk.position).max() <= 1.01 * steps * 9.81 * scene.solver.h**2


def bounce(scene: Scene, tolerance: float) -> None:
    """Check the heights of a bounce on `exact` against the closed form; the peer has the same tolerance, m."""
    simulation, truth = start(scene, "exact"), peers.bounce_truth(scene)
    for height in truth:
        simulation.step()
        assert abs(float(simulation.frame().position[0, 1]) - 0.5 - height) <= tolerance


def cloth(engine: str, steps: int = 50) -> None:
    """Check the nodes of a cloth after 50 ms against hand-written pymunk springs."""
    scene = loads(connected.CLOTH)
    frame, space = stepped(scene, engine, steps), connected.cloth_space(scene)
    for _ in range(steps):
        space.step(scene.solver.h)
    by_hand = np.array([tuple(body.position) for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC])
    # Free nodes have fallen by 12 mm. Springs as forces and as impulses differ by the order of the step.
    assert np.abs(frame.position[~scene.bodies.fixed] - by_hand).max() < 1e-3


def planks(steps: int = 40) -> None:
    """Check that a heap of planks is the same with the broad phases `oriented` and `circles`."""
    scene = connected.heap()
    found = []
    for broad_phase in ("oriented", "circles"):
        simulation = start(scene, "reference", scene.solver.replace(broad_phase=broad_phase))
        for _ in range(steps):
            simulation.step()
        found.append(simulation.frame().position)
    assert np.allclose(found[0], found[1], rtol=0.0, atol=1e-9)  # rounding: contacts may be in another order


def shot(name: str) -> None:
    """Check the events of a shot to rest on `exact`, and in a batch, against those of pooltool with its corrections."""
    scene = load(pooltool_shots.path(name))
    table, theirs = sandbox.Table(scene), pooltool_shots.playing(corrected=True)(name)
    done = table.shoot()
    ours = [[event.kind, [name for name in (event.ball, event.partner) if name is not None]] for event in done.events]
    assert ours == theirs.events
    assert abs(done.duration - theirs.rest) < 1e-3  # s: chaos of a break, which grows to 0.2 ms until the last rest
    batch = table.fan_of(motion_of_first(scene)[None], scene.bodies.names[0])
    assert batch.events.tolist() == [len(ours)]
    assert np.array_equal(batch.position[0], done.position)


def picture(scene: Scene, steps: int, antialias: bool) -> None:
    """Check that balls cover the same pixels as pymunk's debug drawing, except for a tenth: outlines."""
    balls = drawing.picture_of(scene, steps, antialias) != drawing.picture_of(scene, steps, antialias, bodies=False)
    ours, theirs = balls.any(axis=2), (drawing.debug_picture_of(scene, steps) != BACKGROUND).any(axis=2)
    assert theirs.mean() > 0.05
    assert (ours ^ theirs).sum() < 0.1 * theirs.sum()


def threads(scene: Scene, shots: int = 20) -> None:
    """Check that a fan of shots has equal results on one thread and on two."""
    table = sandbox.Table(scene)
    motions = np.multiply.outer(np.linspace(0.9, 1.1, shots), motion_of_first(scene))
    single, double = (table.fan_of(motions, threads=count) for count in (1, 2))
    assert np.array_equal(single.position, double.position)
    assert np.array_equal(single.pocket, double.pocket)
