"""Settings as the `[solver]` table of a scene file, to be copied."""

import json
from collections.abc import Mapping
from typing import Any

from sandbox.scene.description.world import Settings

PLAIN = Settings()


def settings_text(settings: Mapping[str, Any], engine: str | None = None) -> str:
    """Return settings as TOML; what is left to the engine, or is as without saying it, is left out.

    Args:
        settings: by name.
        engine: that they are for, told in a comment.
    """
    lines = ["[solver]" if engine is None else f"[solver]  # {engine}"]
    for name, value in settings.items():
        if value is None or (name in {"half_kick", "record_every"} and value == getattr(PLAIN, name)):
            continue
        # Strings, whole numbers, floats and truth values are written alike in TOML and JSON.
        lines.append(f"{name} = {json.dumps(value)}")
    return "\n".join(lines)
