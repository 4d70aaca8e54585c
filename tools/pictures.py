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
from PIL import Image

from sandbox.cli.main import call
from sandbox.games.billiards.bot.bot import Bot
from sandbox.games.pinball.hand import PinballHand
from sandbox.games.rules import Seen
from sandbox.play.messages import Messages
from sandbox.play.stage import Stage
from sandbox.play.window import Window
from sandbox.scene.shipped import find

FOLDER = Path(__file__).resolve().parent / "pictures"
SIZE = (1280, 800)
FRAME = 1.0 / 60.0  # s
UPRIGHT = (960, 900)
SKILL, LIT = 0.95, 65.0
"""of the player of pinball; and when many a lamp is lit, s"""
GUNNER = ("right", 0.5, 0.7), ("up", 0.5, 1.18), ("fire", 9.0, 9.1)
"""What is held in the duel's first turn, and from when until when, s: it comes down near the other."""
AFTER_FIRE = 14.0
"""s, when the shell is over the hills, and what the window told at the beginning is gone"""
FLIGHT = (
    (2.6, "turn left", 1.0),
    (3.1, "turn left", 0.0),
    (3.2, "turn right", 1.0),
    (3.65, "turn right", 0.0),
    (3.7, "engine", 0.8),
    (6.1, "turn right", 0.6),
)
"""s, controls and values of a landing that is under way"""


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


def duel(file: str) -> None:
    """Fire once, and keep what is seen of the shell on its way."""
    opened = Window(Stage(), size=SIZE)
    opened.stage.open(find("duel"))
    opened.desk.panel.visible = False
    host = opened.stage.host
    assert host is not None
    while opened.stage.show is not None and opened.stage.show.frame.time < AFTER_FIRE:
        time = opened.stage.show.frame.time
        for control, begin, end in GUNNER:
            host.hold("script", control, float(begin <= time < end))
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


def landing(file: str) -> None:
    """Come down on the pad by a script of throttles, and keep what is seen half-way."""
    stage = Stage(overrides=["world.seed=9"])
    opened = Window(stage, size=SIZE)
    stage.open(find("landing"))
    opened.desk.overlays |= {"trails"}
    opened.turn(FRAME)
    stage.messages = Messages()
    for seconds, control, value in FLIGHT:
        while stage.show is not None and stage.show.frame.time < seconds:
            opened.turn(FRAME)
        if stage.host is not None:
            stage.host.hold("script", control, value)
    for _ in range(12):
        opened.turn(FRAME)
    pygame.image.save(opened.surface, FOLDER / file)
    opened.close()


def pinball(file: str) -> None:
    """Let a player who watches the ball play for a while, and keep what is seen."""
    opened = Window(Stage(), size=UPRIGHT)
    opened.stage.open(find("pinball/full"))
    opened.desk.panel.visible = False
    opened.desk.overlays |= {"trails"}
    opened.home()
    opened.turn(FRAME)
    opened.stage.messages = Messages()
    live, host = opened.stage.live, opened.stage.host
    assert live is not None
    assert host is not None
    live.company.show_trust(False)
    player = PinballHand(live.scene.world.seed, SKILL)
    while live.frame.time < LIT:
        for control, value in player.decide(Seen(live.frame.time, live.frame, live.contacts, ()), host.rules):
            host.hold("player", control, value)
        opened.turn(FRAME)
    pygame.image.save(opened.surface, FOLDER / file)
    opened.close()


def table(file: str) -> None:
    """Break, aim as a good player would, and keep what is seen; the numbers of the bot are those of its seed."""
    opened = sit_down("8-ball")
    stroke_and_roll(opened)
    game = opened.stage.game
    assert game is not None
    plan = Bot(1.0, 1).intend(game.match).stroke
    game.cue.aim, game.cue.speed = plan.aim, plan.speed
    game.cue.tip_at(plan.side, plan.height)
    opened.turn(FRAME)
    pygame.image.save(opened.surface, FOLDER / file)
    opened.close()


def rolling(file: str, seconds: float) -> None:
    """Break off, and film the picture without what surrounds it."""
    opened = sit_down("9-ball")
    opened.desk.panel.visible = False
    opened.home()
    opened.take(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE, mod=0, unicode=" ", scancode=0))
    shots = []
    for k in range(round(seconds / FRAME)):
        opened.turn(FRAME)
        if k % 4 == 0:
            pixels = pygame.surfarray.array3d(opened.surface).transpose(1, 0, 2)
            shots.append(Image.fromarray(pixels).resize((640, 400), Image.Resampling.LANCZOS))
    # Half of the colours for what there is most of, the cloth in its light; half so that no ball is without its own.
    halves = [shots[0].quantize(128, how) for how in (Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE)]
    palette = Image.new("P", (1, 1))
    palette.putpalette([part for half in halves for part in (half.getpalette() or [])[: 3 * 128]])
    few = [shot.quantize(palette=palette, dither=Image.Dither.NONE) for shot in shots]
    few[0].save(FOLDER / file, save_all=True, append_images=few[1:], duration=67, loop=0, optimize=True)
    opened.close()


def sit_down(scene: str) -> Window:
    """Open a table."""
    opened = Window(Stage(), size=SIZE)
    opened.stage.open(find(scene))
    opened.turn(FRAME)
    opened.stage.messages = Messages()  # what it says to begin with is no part of the picture
    return opened


def stroke_and_roll(opened: Window) -> None:
    """Play the stroke that is laid ready, and let all come to rest."""
    game = opened.stage.game
    assert game is not None
    game.shoot()
    opened.turn(FRAME)
    while not game.waits:
        opened.turn(FRAME)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    window("gas", 4.0, {"velocities", "energy"}, ghost=True, trust=True, file="window.png")
    film("pile", "pile.gif", "--size", "320x400", "--fps", "15", "--until", "2")
    film("ragdoll_stairs", "ragdoll.gif", "--size", "640x300", "--fps", "20", "--until", "2.5")
    table("table.png")
    duel("duel.png")
    landing("landing.png")
    pinball("pinball.png")
    rolling("break.gif", 2.6)
    film("tearing_cloth", "tearing.gif", "--size", "640x340", "--fps", "20", "--until", "1.6")
