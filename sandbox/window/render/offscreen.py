"""Offscreen renderer: frames as arrays, without a window."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.action import Throttle
from sandbox.games.contract import HasLamps, HasViewState, Rules
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot, active_thrusters
from sandbox.window.render.renderer import InsetRenderer, Renderer
from sandbox.window.view_bounds import view_bounds


class OffscreenRenderer:
    """Draws frames into an array."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Create a renderer for frames of `size`, px."""
        pygame.font.init()
        self._surface = pygame.Surface(size)
        self._picture, self._inset = Renderer(), InsetRenderer()

    def picture(
        self, scene: Scene, bodies: Bodies, frame: Frame, rules: Rules, throttles: Mapping[str, Throttle]
    ) -> npt.NDArray[np.uint8]:
        """Return a frame of a game as the window shows it, without text: (height, width, 3).

        Args:
            scene: in its current form.
            bodies: including spawned ones.
            frame: state of the bodies.
            rules: of the game, the source of lit lamps and of the view state (guns, blasts).
            throttles: current settings, by thruster name.
        """
        camera = Camera.fitting(view_bounds(scene), self._surface.get_size())
        lit = rules.lit_lamps() if isinstance(rules, HasLamps) else frozenset[str]()
        game = rules.view_state(frame.time) if isinstance(rules, HasViewState) else None
        flames = active_thrusters(scene, bodies, throttles, frame.time)
        snapshot = Snapshot(scene, bodies, frame, flames=flames, lit=lit, game=game)
        self._picture.draw(self._surface, camera, snapshot, hud=False)
        self._inset.draw(self._surface, camera, snapshot, self._surface.get_rect())
        return np.ascontiguousarray(pygame.surfarray.array3d(self._surface).swapaxes(0, 1))
