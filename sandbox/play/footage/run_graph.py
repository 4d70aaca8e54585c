"""Run graph: the energies of a stored run up to a moment, in a corner of its picture."""

from functools import cached_property

import numpy as np
import pygame

from sandbox.measure.energy import Energies, energies
from sandbox.play.instruments.graph import SPAN, EnergyGraph
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SAMPLES = 500
"""of the span that is shown"""
WIDTH, HEIGHT, MARGIN = 330.0, 130.0, 12.0
"""px at unit 1"""


class RunGraph:
    """The energy graph of the window, fed by a stored run."""

    def __init__(self, trajectory: Trajectory, scene: Scene, bodies: Bodies) -> None:
        self._run, self._scene, self._bodies = trajectory, scene, bodies
        self._graph = EnergyGraph()

    @cached_property
    def _energies(self) -> Energies:
        return energies(self._run, self._scene, bodies=self._bodies)

    def draw(self, surface: pygame.Surface, time: float, unit: float) -> None:
        """Draw the energies of the last seconds before a time, s, into the lower right corner."""
        first, last = np.searchsorted(self._run.time, (time - SPAN, time), side="right")
        every = max(1, round(SPAN / SAMPLES / _step(self._run)))
        first = -(-first // every) * every  # always the same frames, so that the lines do not tremble
        self._graph.samples.clear()
        for row in [*range(first, last - 1, every), last - 1]:
            self._graph.add(float(self._run.time[row]), *(float(each[row]) for each in self._energies))
        wide, high = surface.get_size()
        rect = pygame.Rect(0, 0, round(min(WIDTH * unit, wide / 2)), round(min(HEIGHT * unit, high / 2)))
        rect.bottomright = wide - round(MARGIN * unit), high - round(MARGIN * unit)
        self._graph.draw(surface, rect, unit)


def _step(run: Trajectory) -> float:
    """Return the usual time between frames, s."""
    return max(float(np.median(np.diff(run.time))), 1e-12) if len(run.time) > 1 else 1.0
