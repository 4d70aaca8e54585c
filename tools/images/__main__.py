"""Make the pictures of README and documentation.

    python -m tools.images [NAME…]
    python -m tools.images --list

A name is the path of a file in `docs/images/`, or its beginning: `hero`, `scenes/pinball`. Without a name all pictures
are made, which takes some minutes.
"""

import argparse
import os
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"  # the window, without a display
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"

from tools.images import browser, editor, films, hero, lessons, plots, thumbnails, window
from tools.images.files import FOLDER


class Picture(NamedTuple):
    """A picture and the function that makes it."""

    name: str
    """path in `docs/images/`"""
    about: str
    make: Callable[[Path], object]


def _thumbnail(scene: str) -> Callable[[Path], None]:
    return lambda path: thumbnails.make(scene, path)


PICTURES = (
    Picture("hero.gif", "the same scene on three engines, with the error of each", hero.make),
    Picture("window.png", "the window: gas on pymunk, with the ghost of the exact engine", window.ghost),
    Picture("live.png", "a live scene in the browser: the bridge, with a ghost at a tenth of dt", browser.live),
    Picture("editor.gif", "the editor: a car is built and driven", editor.make),
    Picture("table.png", "8-ball: the predicted paths of the next shot", window.table),
    Picture("break.gif", "9-ball: the break", window.rolling),
    Picture("duel.png", "artillery: a shell between two tanks", window.duel),
    Picture("landing.png", "landing: the ship above its pad", window.landing),
    Picture("pinball.png", "pinball: Neon Twins after half a minute", window.pinball),
    Picture("pile.gif", "1,000 balls settle", films.film("pile", (280, 350), 2.0, fps=12.5, colours=32)),
    Picture("ragdoll.gif", "a ragdoll falls down stairs", films.film("ragdoll_stairs", (640, 300), 2.5)),
    Picture("tearing.gif", "a stone tears a cloth", films.film("tearing_cloth", (560, 300), 1.6, engine="reference")),
    Picture(
        "tradeoff.png",
        "error against cost: a pendulum",
        plots.plot("tradeoff", "pendulum_90", "--tolerance", "0.01", "--effort", "5"),
    ),
    Picture("reliability.png", "stated odds of check against frequencies", plots.reliability),
    Picture("bounce-plot.png", "position, velocity and energy of a ball that bounces", plots.plot("run", "bounce")),
    Picture("sweep-lines.png", "contacts over the restitution", plots.sweep("contacts", "scatter.drop.restitution")),
    Picture(
        "sweep-map.png",
        "contacts over the restitution and the step",
        plots.sweep("contacts", "scatter.drop.restitution,solver.dt"),
    ),
    *(
        Picture(f"scenes/{scene.replace('/', '-')}.png", f"thumbnail of {scene}", _thumbnail(scene))
        for scene in thumbnails.MOMENTS
    ),
    *(
        Picture(f"lesson-{draw.__name__}.png", f"lessons: {draw.__doc__}", lessons.figure(draw))
        for draw in lessons.LESSONS
    ),
    *(
        Picture(f"scenes/artillery-{name}.png", f"thumbnail of artillery/{name}", window.artillery_thumbnail(name))
        for name in ("duel", "four")
    ),
)


def main() -> None:
    """Make the pictures named on the command line."""
    parser = argparse.ArgumentParser(description="Make the pictures of README and documentation.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="pictures, or the beginning of their paths")
    parser.add_argument("--list", action="store_true", help="list the pictures")
    options = parser.parse_args()
    selected = [each for each in PICTURES if not options.names or any(map(each.name.startswith, options.names))]
    unknown = [name for name in options.names if not any(each.name.startswith(name) for each in PICTURES)]
    if unknown:
        parser.error(f"no picture begins with {', '.join(unknown)}; --list lists them")
    for picture in selected:
        if options.list:
            print(f"{picture.name:40} {picture.about}")
            continue
        path, begin = FOLDER / picture.name, perf_counter()
        path.parent.mkdir(parents=True, exist_ok=True)
        picture.make(path)
        print(f"{picture.name:40} {path.stat().st_size / 1000.0:6.0f} kB {perf_counter() - begin:6.1f} s", flush=True)


if __name__ == "__main__":
    main()
