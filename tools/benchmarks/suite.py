"""The rows of the benchmarks: engines, pictures and commands, followed by those of games."""

from functools import partial

from tools.benchmarks import agreement, box2d_peer, connected, drawing, peers, pyramid, sweeps
from tools.benchmarks.environments import ENVIRONMENTS
from tools.benchmarks.games import GAMES
from tools.benchmarks.pymunk_loops import attributes, looped, looping, states, states_and_contacts
from tools.benchmarks.rehearsals import REHEARSALS
from tools.benchmarks.row import Bench
from tools.benchmarks.turning import edits, turns
from tools.benchmarks.workloads import (
    balls_on_plane,
    command,
    events,
    flying,
    for_one_step,
    rolling,
    running,
    scene,
    staged,
    starting,
    stepping,
    varying,
)

SPARKS = ("world.duration=1.0", "solver.record_every=1")
PILE = scene("benchmark/pile")
TOWER = scene("benchmark/tower")
SETTLED = scene("benchmark/pile", "world.duration=1.0")
BOUNCE = scene("tutorial/bounce")
LOW = scene("tutorial/bounce", "ball.ball.position=[0, 0.55]", "world.duration=0.25")

BALL = balls_on_plane(1, 1000)

SMALL = ((1, 1000), (10, 1000), (100, 500), (1000, 100))
"""Balls on a plane: number and steps."""

RUNS = {1: 5, 10: 5, 100: 1, 1000: 1}
"""Number of runs that a repeat times, one after the other: runs of some milliseconds are made many at a time."""

SMALL_TARGETS = {
    (10, states_and_contacts): (1.2, 0.2, 0.7),
    (1, attributes): (1.0, 0.5, 0.5),
    (10, attributes): (0.3, 0.15, 0.15),
    (100, attributes): (0.2, 0.4, 0.05),
    (1000, attributes): (0.45, 0.1, 0.1),
}
"""Target ratios of pymunk, exact and reference to a loop, by number of balls."""

PILE_AGREES = partial(agreement.pile, PILE)
BALLS_AGREE = {count: partial(agreement.balls, balls_on_plane(count, steps)) for count, steps in SMALL}
"""Checks that rows share."""

LOOPS = (
    ("", states_and_contacts, "states and contacts"),
    ("-states", states, "states"),
    ("-attributes", attributes, "attributes"),
)
"""Hand-written pymunk loops: suffix of the row, loop, name."""

BENCHES = (
    *(
        Bench(
            f"pile{suffix}{'-audited' * audit}",
            f"sandbox.run on the 1,000-ball pile, {'' if audit else 'not '}audited / a pymunk loop, {kept}",
            lambda audit=audit: running(PILE, audit=audit),
            lambda loop=loop: looping(loop, PILE),
            1.05 if loop is states_and_contacts and not audit else None,
            same=PILE_AGREES,
        )
        for suffix, loop, kept in LOOPS
        for audit in (False, True)
    ),
    Bench(
        "audit",
        "the same run with the audit of missed contacts, as is the default / without",
        lambda: running(PILE),
        lambda: running(PILE, audit=False),
        same=lambda: agreement.audited(PILE),
    ),
    Bench(
        "pile-reference",
        "sandbox.run on the 1,000-ball pile on the reference, audited / a pymunk loop, states and contacts",
        lambda: running(PILE, engine="reference"),
        lambda: looping(states_and_contacts, PILE),
        0.6,
    ),
    Bench(
        "pile-box2d",
        "sandbox.run on the 1,000-ball pile on box2d, not audited / a bare loop over the binding that records the same",
        lambda: running(PILE, engine="box2d", audit=False),
        lambda: box2d_peer.loop(PILE),
        1.05,
        missing=box2d_peer.missing,
        same=lambda: agreement.pile_on_box2d(PILE),
    ),
    Bench(
        "one-ball-box2d",
        "sandbox.run of one ball on a plane on box2d, not audited, 10,000 steps / the bare loop over the binding",
        lambda: running(balls_on_plane(1, 10_000), engine="box2d", audit=False),
        lambda: box2d_peer.loop(balls_on_plane(1, 10_000)),
        missing=box2d_peer.missing,
        same=lambda: agreement.pile_on_box2d(balls_on_plane(1, 100)),
    ),
    *(
        Bench(
            f"pyramid-box2d{suffix}",
            f"5 s of a pyramid of 55 boxes on box2d, {pyramid.SUBSTEPS} substeps / a pymunk loop, states, "
            f"{substeps} substep{'s' * (substeps > 1)} × {iterations} iterations{about}",
            lambda: pyramid.timing(pyramid.SUBSTEPS),
            lambda substeps=substeps, iterations=iterations: pyramid.timing(substeps, iterations),
            missing=box2d_peer.missing,
            same=lambda substeps=substeps, iterations=iterations: pyramid.same(substeps, iterations),
        )
        for suffix, (substeps, iterations), about in (
            ("", pyramid.EQUAL, ", the cheapest that moves no further"),
            ("-1x10", (1, 10), ""),
            ("-4x10", (4, 10), ""),
        )
    ),
    *(
        Bench(
            f"balls-{count}-{engine}{suffix}",
            f"sandbox.run, audited, of {count:,} ball{'s' * (count > 1)} on a plane, {steps:,} steps, on {engine} / a "
            f"pymunk loop, {kept}",
            lambda count=count, steps=steps, engine=engine: running(
                balls_on_plane(count, steps), engine=engine, runs=RUNS[count]
            ),
            lambda count=count, steps=steps, loop=loop: looping(loop, balls_on_plane(count, steps), RUNS[count]),
            target,
            same=BALLS_AGREE[count],
        )
        for count, steps in SMALL
        for suffix, loop, kept in LOOPS
        for engine, target in zip(
            ("pymunk", "exact", "reference"), SMALL_TARGETS.get((count, loop), (None, None, None)), strict=True
        )
    ),
    *(
        Bench(
            f"ensemble-{engine}",
            f"runs a second of ten balls on a plane for 1,000 steps, in an ensemble on {engine}, one thread / runs of "
            "a pymunk loop, states",
            lambda engine=engine: varying(balls_on_plane(10, 1000), engine),
            lambda: looped(states, balls_on_plane(10, 1000)),
            target,
            "runs/s",
            rate=True,
            same=lambda engine=engine: agreement.members(balls_on_plane(10, 1000), engine),
        )
        for engine, target in (("exact", 1 / 150e-6), ("reference", 1 / 350e-6))
    ),
    *(
        Bench(
            f"jointed-{name}",
            f"sandbox.run, audited, of a second of {path} on the reference / on pymunk",
            lambda path=path: running(scene(path, "world.duration=1.0"), engine="reference"),
            lambda path=path: running(scene(path, "world.duration=1.0")),
        )
        for name, path in (
            ("pendulum", "benchmark/pendulum_90"),
            ("ragdoll", "joints/ragdoll_stairs"),
            ("bridge", "joints/bridge"),
        )
    ),
    *(
        Bench(
            f"run-start-{engine}",
            f"runs a second of one ball for one step, on {engine} / runs of a pymunk loop, states and contacts",
            lambda engine=engine: starting(BALL, engine),
            lambda: looped(states_and_contacts, for_one_step(BALL), 50),
            1000.0,
            "runs/s",
            rate=True,
        )
        for engine in ("pymunk", "exact", "reference")
    ),
    *(
        Bench(
            f"flight-{name}",
            f"particle-steps a second of {count:,} particles, stepped and not read / of straightforward numpy",
            lambda count=count: flying(count),
            lambda count=count: peers.naive_flight(count),
            5e8 if count == 100_000 else None,
            "steps/s",
            rate=True,
            same=agreement.flight,
        )
        for name, count in (("1e3", 1_000), ("1e4", 10_000), ("1e5", 100_000), ("1e6", 1_000_000))
    ),
    Bench(
        "flight-substeps",
        "substeps a second of 100,000 particles, 16 per frame / of straightforward numpy",
        lambda: flying(100_000, substeps=16),
        lambda: peers.naive_flight(100_000),
        unit="steps/s",
        rate=True,
        same=lambda: agreement.flight(substeps=16),
    ),
    Bench(
        "flight-drag",
        "the same with drag and wind / of straightforward numpy without",
        lambda: flying(100_000, substeps=16, drag=0.3),
        lambda: peers.naive_flight(100_000),
        unit="steps/s",
        rate=True,
    ),
    Bench(
        "flight-copy",
        "the particle-steps a second of 100,000 particles / how many particles' bytes are copied in a second",
        lambda: flying(100_000),
        lambda: peers.copied(100_000),
        unit="steps/s",
        rate=True,
    ),
    Bench(
        "particles-pymunk",
        "100,000 collision-free particles, stepped and read / 100,000 pymunk bodies, which are not meant for particles",
        lambda: stepping(scene("particles/fireworks_100k", *SPARKS), 30, contacts=False),
        lambda: peers.bodies_without_shapes(100_000, 30),
        1 / 20,
    ),
    Bench(
        "particles-copy",
        "a step of the same particles, not read / copying the bytes that it reads and writes",
        lambda: stepping(scene("particles/fireworks_100k", *SPARKS), 100, record=False, contacts=False),
        lambda: peers.copying(100_000 * 4 * 8, 100),
    ),
    Bench(
        "omit-space",
        "1,000 balls that cannot collide, outside of the space / the same with collisions, in the space",
        lambda: stepping(scene("benchmark/pile", "grid.ball.collides=none"), 120, contacts=False),
        lambda: stepping(scene("benchmark/pile"), 120, contacts=False),
    ),
    Bench(
        "omit-ball-ball",
        "225 balls of a gas that collide only with the box / also with each other",
        lambda: stepping(scene("benchmark/gas", "grid.0.collides=fixed"), 400, contacts=False),
        lambda: stepping(scene("benchmark/gas"), 400, contacts=False),
    ),
    Bench(
        "omit-contacts",
        "the pile, contacts not recorded / recorded",
        lambda: stepping(SETTLED, 120, contacts=False),
        lambda: stepping(SETTLED, 120),
        same=lambda: agreement.without_contacts(SETTLED),
    ),
    Bench(
        "omit-rotation",
        "225 frictionless balls, which cannot be turned, without a moment / with one",
        lambda: stepping(scene("benchmark/gas"), 400, contacts=False),
        lambda: stepping(scene("benchmark/gas"), 400, contacts=False, turning=True),
        same=lambda: agreement.without_rotation(scene("benchmark/gas")),
    ),
    Bench(
        "reference-pile",
        "two seconds of the 1,000-ball pile on the reference, compiled / on pymunk; both stepped and read",
        lambda: stepping(PILE, 240, contacts=False, engine="reference"),
        lambda: stepping(PILE, 240, contacts=False),
        1.0,
        same=lambda: agreement.pile_on_engines(PILE),
    ),
    *(
        Bench(
            f"exact-{count}",
            f"events a second of exact in an elastic gas of {count:,} balls / contacts a second of pymunk in it",
            lambda count=count: events(count),
            lambda count=count: peers.contacts_per_second(count),
            target,
            "events/s",
            rate=True,
        )
        for count, target in ((16, 1e6), (100, 2e5), (1000, 3e4))
    ),
    Bench(
        "bounce-1e-6",
        "a ball dropped from 5 cm for 0.25 s, right to 1e-6 m: exact / pymunk by hand, at the dt that gets there",
        lambda: stepping(LOW, 250, contacts=False, engine="exact"),
        lambda: peers.bounce_to(LOW, 1e-6),
        same=lambda: agreement.bounce(LOW, 1e-6),
    ),
    Bench(
        "one-ball",
        "a step of one ball above a plane on the reference / on pymunk through the adapter",
        lambda: stepping(BOUNCE, 2000, record=False, contacts=False, engine="reference"),
        lambda: stepping(BOUNCE, 2000, record=False, contacts=False),
        same=lambda: agreement.one_ball(BOUNCE),
    ),
    *(
        Bench(
            f"one-ball-{name}",
            f"of such a step on the reference, {about} / the whole step",
            lambda name=name: staged(BOUNCE, name),
            lambda: staged(BOUNCE, "step"),
        )
        for name, about in (("move", "forces and advance"), ("look", "detect"), ("resolve", "resolve"))
    ),
    Bench(
        "cloth",
        "steps a second of a cloth of 64 × 64 nodes on the reference, springs as forces / on pymunk's springs, by hand",
        lambda: connected.cloth("reference", 200),
        lambda: connected.springs(100),
        unit="steps/s",
        rate=True,
        same=lambda: agreement.cloth("reference"),
    ),
    Bench(
        "cloth-pymunk",
        "the same on pymunk through the adapter / on pymunk's springs, by hand",
        lambda: connected.cloth("pymunk", 100),
        lambda: connected.springs(100),
        unit="steps/s",
        rate=True,
        same=lambda: agreement.cloth("pymunk"),
    ),
    Bench(
        "cloth-xpbd",
        "the same on the reference by XPBD, ten passes / on the reference, springs as forces",
        lambda: connected.cloth("reference", 100, joints="xpbd"),
        lambda: connected.cloth("reference", 100),
        unit="steps/s",
        rate=True,
    ),
    *(
        Bench(
            f"spin-{count}",
            f"steps a second of {count:,} balls on a floor, with three spins, on pymunk / of the same as discs without",
            lambda count=count: rolling(count, floor=True),
            lambda count=count: rolling(count, floor=False),
            unit="steps/s",
            rate=True,
        )
        for count in (16, 100, 1000)
    ),
    Bench(
        "tower",
        "20 boxes stand for 10 s and drift by at most 5 mm: the reference / bare pymunk, each at its cheapest",
        lambda: connected.standing(TOWER, "reference", 0.005, substeps=4, iterations=10),
        lambda: connected.bare_standing(TOWER, 0.005, substeps=3, iterations=15),
    ),
    Bench(
        "tower-pymunk",
        "20 boxes stand for 10 s at 8 substeps and 4 iterations and drift by 5 mm at most: pymunk / bare pymunk",
        lambda: connected.standing(TOWER, "pymunk", 0.005, substeps=8, iterations=4),
        lambda: connected.bare_standing(TOWER, 0.005, substeps=8, iterations=4),
    ),
    Bench(
        "oriented",
        "a second of a heap of 60 long planks on the reference, broad phase of oriented boxes / of circles",
        lambda: connected.planks("oriented"),
        lambda: connected.planks("circles"),
        same=agreement.planks,
    ),
    *(
        Bench(
            f"sweep-{milliseconds}ms",
            f"{runs} runs of 100 balls, about {milliseconds} ms each, as a stored sweep on 2 workers / in a bare "
            "multiprocessing pool over hand-written pymunk loops that record the same",
            lambda milliseconds=milliseconds, runs=runs: sweeps.sweeping(milliseconds, runs),
            lambda milliseconds=milliseconds, runs=runs: sweeps.pooled(milliseconds, runs, sweeps.loop_ends),
            target,
            same=lambda milliseconds=milliseconds: sweeps.same_ends(milliseconds),
        )
        for milliseconds, runs, target in ((50, 80, 1 / 0.9), (5, 400, 1 / 0.7))
    ),
    *(
        Bench(
            f"sweep-{milliseconds}ms-pool",
            f"the same sweep of runs of about {milliseconds} ms / sandbox.run of the same scenes in a bare pool",
            lambda milliseconds=milliseconds, runs=runs: sweeps.sweeping(milliseconds, runs),
            lambda milliseconds=milliseconds, runs=runs: sweeps.pooled(milliseconds, runs, sweeps.run_ends),
        )
        for milliseconds, runs in ((50, 80), (5, 400))
    ),
    Bench(
        "sweep-store",
        "200 runs of 5 ms in this process, planned and stored as summaries / as jobs in a loop, not stored",
        lambda: sweeps.storing(5, 200),
        lambda: sweeps.not_storing(5, 200),
    ),
    *(
        Bench(
            f"ensemble-{engine}-pool",
            f"seconds a run of 10,000 runs of ten balls for 1,000 steps, in an ensemble on {engine}, two threads / of "
            "single runs in a bare pool of two processes",
            lambda engine=engine: sweeps.ensemble_run(engine, 10_000),
            lambda engine=engine: sweeps.pooled_runs(balls_on_plane(10, 1000), engine, 400),
            1 / 20,
            same=lambda engine=engine: sweeps.same_members(engine),
        )
        for engine in ("exact", "reference")
    ),
    *(
        Bench(
            f"sweep-members-{engine}",
            f"seconds a run of a sweep of {runs:,} seeds of ten balls for 1,000 steps on {engine}, two workers, with "
            "--keep end / with --keep summary, whose runs are single ones",
            lambda engine=engine, runs=runs: sweeps.seed_sweep(engine, runs, keeps_ends=True),
            lambda engine=engine: sweeps.seed_sweep(engine, 1000, keeps_ends=False),
            1 / 20,
            same=lambda engine=engine: sweeps.same_members(engine),
        )
        for engine, runs in (("exact", 20_000), ("reference", 6_000))
    ),
    Bench(
        "shots-pool",
        "seconds a shot of 10,000 billiard shots with errors of the stroke, two threads / of single runs of the shot "
        "in a bare pool of two processes",
        lambda: sweeps.shot_run(10_000),
        lambda: sweeps.pooled_runs(scene("9-ball"), "exact", 200),
        1 / 20,
    ),
    Bench(
        "sweep-resume",
        "resuming a sweep whose 10,000 runs are all stored / reading the rows of its store",
        *sweeps.resumed(10_000),
    ),
    Bench(
        "turn",
        "a frame of the window in which a body is dragged to the pointer / a frame without events",
        lambda: turns("gas", hand=True),
        lambda: turns("gas", hand=False),
    ),
    Bench(
        "edit-drag",
        "a frame of the editor in which one of 1,000 balls is dragged / a frame of it without events",
        lambda: edits(hand=True),
        lambda: edits(hand=False),
    ),
    Bench(
        "check-start",
        "`sandbox check bounce` above a bare interpreter / the bare interpreter",
        lambda: command("-m", "sandbox", "check", "bounce"),
        lambda: command("-c", "pass"),
        0.35,
        above=True,
    ),
    Bench(
        "check-formulas",
        "`sandbox check --no-trial bounce` above a bare interpreter / the bare interpreter",
        lambda: command("-m", "sandbox", "check", "--no-trial", "bounce"),
        lambda: command("-c", "pass"),
        above=True,
    ),
    Bench(
        "help-start",
        "`sandbox --help` above a bare interpreter / the bare interpreter",
        lambda: command("-m", "sandbox", "--help"),
        lambda: command("-c", "pass"),
        0.12,
        above=True,
    ),
    Bench(
        "draw-plain",
        "a picture of the 1,000-ball pile, edges not smooth / pymunk.pygame_util's debug draw of the same balls",
        lambda: drawing.drawing(SETTLED, 120, antialias=False),
        lambda: drawing.debug_drawing(SETTLED, 120),
        0.25,
        same=lambda: agreement.picture(SETTLED, 120, antialias=False),
    ),
    Bench(
        "draw-antialiased",
        "the same picture with smooth edges / pymunk.pygame_util's debug draw of the same balls",
        lambda: drawing.drawing(SETTLED, 120, antialias=True),
        lambda: drawing.debug_drawing(SETTLED, 120),
        0.5,
        same=lambda: agreement.picture(SETTLED, 120, antialias=True),
    ),
    Bench(
        "draw-particles",
        "pictures a second of 100,000 particles of 1 px that fade / in one colour by surfarray, straightforward",
        lambda: drawing.particles(scene("particles/fireworks_100k", *SPARKS), 150),
        lambda: drawing.particles_by_array(scene("particles/fireworks_100k", *SPARKS), 150),
        300.0,
        "frames/s",
        rate=True,
    ),
    *GAMES,
    *ENVIRONMENTS,
    *REHEARSALS,
)
