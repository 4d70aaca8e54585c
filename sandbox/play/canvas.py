"""Canvas: pictures of states as arrays, without a window."""

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.play.camera import Camera
from sandbox.play.drawing.picture import Picture
from sandbox.play.framing import framing
from sandbox.play.sight import Sight
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.trajectory import Frame


class Canvas:
    """Draws one picture after the other."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Take a size, px."""
        pygame.font.init()
        self._surface = pygame.Surface(size)
        self._picture = Picture()

    def picture(self, scene: Scene, bodies: Bodies, frame: Frame) -> npt.NDArray[np.uint8]:
        """Return a picture of a state, (height, width, 3)."""
        camera = Camera.fitting(framing(scene), self._surface.get_size())
        self._picture.draw(self._surface, camera, Sight(scene, bodies, frame))
        return np.ascontiguousarray(pygame.surfarray.array3d(self._surface).swapaxes(0, 1))
