"""Replays in pages: runs of a scene with several values of a key, computed while the site is built."""

import sandbox
from sandbox.batch.sweep import parse_sweep
from sandbox.notebook import frame
from sandbox.report.html.comparison import replay_page

HEIGHT = 640
"""Height of the frame until the replay has reported its own, px."""


def replay(scene: str, swept: str, *words: str) -> str:
    """Return a replay with a slider over the values of a key, below a sentence, as Markdown.

    Args:
        scene: name of a shipped scene.
        swept: key and values, such as `solver.dt=0.001,0.01`.
        words: names of the engines, and other keys with their values, such as `solver.damping=1`.
    """
    key, values = parse_sweep(swept)
    engines = [word for word in words if "=" not in word]
    changed = sandbox.load(scene, [word for word in words if "=" in word])
    comparison = sandbox.compare(changed, engines, sweep={key: values})
    lead = f"The same runs to play: the slider chooses `{key}`."
    return f"{lead}\n\n````{{raw}} html\n{frame(replay_page(comparison), HEIGHT)}\n````"
