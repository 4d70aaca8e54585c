"""Gallery of the shipped scenes: picture, title, purpose, engines that can run it, and the command to play it."""

from itertools import groupby

import sandbox
from sandbox.engines.registry import able
from sandbox.scene.files.shipped_scenes import ShippedScene, shipped


def thumbnail_name(scene: str) -> str:
    """Return the file of a scene's thumbnail, below `docs/images/scenes/`."""
    return f"{scene.replace('/', '-')}.png"


def gallery() -> str:
    """Return the Markdown of all shipped scenes, by folder."""
    parts = []
    for folder, scenes in groupby(shipped(), folder_of):
        cards = "\n\n".join(map(_card, scenes))
        parts.append(f"## {folder.capitalize()}\n\n:::::{{grid}} 1 2 3 3\n:gutter: 2\n\n{cards}\n\n:::::")
    return "\n\n".join(parts)


def folder_of(scene: ShippedScene) -> str:
    """Return the folder of a scene."""
    return scene.name.partition("/")[0]


def _card(shipped_scene: ShippedScene) -> str:
    name, path = shipped_scene
    scene = sandbox.load(path)
    return "\n".join(
        (
            f"::::{{grid-item-card}} {scene.title}",
            f":img-top: images/scenes/{thumbnail_name(name)}",
            f":img-alt: {scene.title}",
            "",
            _literal(scene.about),
            "",
            f"Engines: {', '.join(able(scene))}",
            "",
            f"`sandbox play {name}`",
            "::::",
        )
    )


def _literal(text: str) -> str:
    """Return a text of which Markdown takes nothing as markup."""
    return "".join(f"\\{letter}" if letter in "\\`*_{}[]<>#|$~" else letter for letter in text)
