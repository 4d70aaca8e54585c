"""Sensors: translucent areas that are brighter while something overlaps them."""

import math

from sandbox.engines.sensors import SceneSensors
from sandbox.scene.geometry.shapes import geometry_of, placed_sensor
from sandbox.scene.geometry.vectors import to_world
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.palette import YELLOW, hex_colour
from sandbox.window.render.static_geometry import draw_area

IDLE_OPACITY = 0.08, 0.4
"""opacity of the area and of the outline"""
DETECTING_OPACITY = 0.3, 1.0
"""the same while something overlaps it"""


class SensorRenderer:
    """Draws the sensors of a snapshot. The compiled sensors of the last scene are kept."""

    def __init__(self) -> None:
        self._sensors: SceneSensors | None = None

    def draw(self, canvas: Canvas, snapshot: Snapshot) -> None:
        """Draw the sensors whose bodies are present."""
        scene, bodies, frame = snapshot.scene, snapshot.bodies, snapshot.frame
        if not scene.sensors:
            return
        known = self._sensors
        if known is None or known.scene is not scene or known.bodies is not bodies:
            known = self._sensors = SceneSensors(scene, bodies)
        for number, sensor in enumerate(scene.sensors):
            placed = sensor
            if sensor.body is not None:
                index = bodies.number_of[sensor.body]
                if index >= len(frame.position) or not frame.present[index]:
                    continue
                x, y = geometry_of(bodies.elements[bodies.element[index]]).centre
                angle, (px, py) = float(frame.angle[index]), frame.position[index].tolist()
                if not math.isfinite(angle + px + py):
                    continue
                placed = placed_sensor(sensor, to_world((-x, -y), math.cos(angle), math.sin(angle), (px, py)), angle)
            is_detecting = len(known.detected(number, frame)) > 0
            colour = YELLOW if sensor.colour is None else hex_colour(sensor.colour)
            draw_area(canvas, placed, colour, *(DETECTING_OPACITY if is_detecting else IDLE_OPACITY))
