"""Flippers at 1 kHz: no ball passes through one, for both kinds of drive and any time of the stroke."""

import math

import numpy as np
import pytest

from sandbox.action import Drive, Move
from sandbox.engines.switching import start
from sandbox.scene.files.load import loads
from tests.games.pinball.passing_watch import TIP, PassageObserver

TEXT = """
[solver]
dt = 0.001
substeps = 1
[pinball]
[[pinball.flipper]]
name = "bat"
pivot = [0.0, 0.0]
side = "left"
drive = "{drive}"
[[pinball.ball]]
name = "ball"
position = [{x}, {y}]
"""
REST, RAISED = -0.541, 0.349


@pytest.mark.parametrize("drive", ["torque", "stroke"])
def test_no_ball_passes_through_a_flipper(drive: str) -> None:
    random, max_depth, hits = np.random.default_rng(3), 0.0, 0
    for _ in range(40):
        # Aimed at a random point of the flipper at a random angle of its stroke, from above or below.
        angle, fraction, side = random.uniform(REST, RAISED), random.uniform(0.0, 1.0), random.choice([-1.0, 1.0])
        direction = angle + side * (0.5 * math.pi + random.uniform(-0.9, 0.9))
        speed, distance = random.uniform(0.5, 4.0), 0.12  # m/s: speeds of balls on a table
        x = 0.0702 * fraction * math.cos(angle) + distance * math.cos(direction)
        y = 0.0702 * fraction * math.sin(angle) + distance * math.sin(direction)
        simulation = start(loads(TEXT.format(drive=drive, x=x, y=y)))
        names = simulation.bodies.names
        watch = PassageObserver(simulation.scene, simulation.bodies, (names.index("ball"),))
        simulation.watch(watch)
        velocity = -speed * math.cos(direction), -speed * math.sin(direction)
        simulation.apply(Move(time=0.0, body="ball", position=(x, y), velocity=velocity))
        raised, until = random.uniform(0.0, 2.0 * distance / speed), 2.0 * distance / speed + 0.05
        up = False
        while simulation.time < until:
            if not up and simulation.time >= raised:
                up = True
                simulation.apply(Drive(time=simulation.time, drive="bat", level=1.0))
            simulation.step()
        simulation.close()
        assert watch.passages == [], (x, y, velocity, raised)
        max_depth, hits = max(max_depth, watch.max_depth), hits + (watch.max_depth > 0.0)
    assert hits > 20  # of 40 aimed balls
    # A ball approaches by 4 mm in a substep, and a flipper pushed back onto its stop yields further. The overlap stays
    # below the radius of the tip, the thinnest part, so the centre of the ball does not reach the flipper.
    assert 0.0 < max_depth < TIP
