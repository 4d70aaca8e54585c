"""Pictures of the README, made by what they show: the window itself, and `sandbox export`.

python tools/pictures.py
"""

import os
import sys
import tempfile
from pathlib import Path

os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"  # the window, without a display
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"

import pygame

from sandbox.cli.main import call
from sandbox.play.stage import Stage
from sandbox.play.window import Window
from sandbox.scene.shipped import find

FOLDER = Path(__file__).resolve().parent / "pictures"
SIZE = (1280, 800)
FRAME = 1.0 / 60.0  # s


def window(scene: str, seconds: float, overlays: set[str], *, ghost: bool, trust: bool, file: str) -> None:
    """Play a scene in the window for so long, and keep what is seen."""
    stage = Stage()
    opened = Window(stage, size=SIZE)
    stage.open(find(scene))
    opened.desk.overlays |= overlays
    if ghost:
        stage.toggle_ghost()
    if stage.live is not None:
        stage.live.company.show_trust(trust)
    while stage.show is not None and stage.show.frame.time < seconds:
        opened.turn(FRAME)
    pygame.image.save(opened.surface, FOLDER / file)
    opened.close()


def film(scene: str, file: str, *options: str) -> None:
    """Run a scene, and export it."""
    with tempfile.TemporaryDirectory() as folder:
        for arguments in (
            ["run", scene, "--out", folder, "--quiet"],
            ["export", folder, "--to", str(FOLDER / file), *options],
        ):
            if call(arguments):
                sys.exit(f"sandbox {' '.join(arguments)} failed")


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    window("gas", 4.0, {"velocities", "energy"}, ghost=True, trust=True, file="window.png")
    film("pile", "pile.gif", "--size", "320x400", "--fps", "15", "--until", "2")
    film("ragdoll_stairs", "ragdoll.gif", "--size", "640x300", "--fps", "20", "--until", "2.5")
    film("tearing_cloth", "tearing.gif", "--size", "640x340", "--fps", "20", "--until", "1.6")
