"""Documents: a scene as nested dicts and lists, as TOML or JSON hold it, to the model and back."""

import json
from typing import Any

from sandbox.scene.model import Scene


def read_model(document: dict[str, Any]) -> Scene:
    """Validate a scene document as a file holds it: by the keys of the file alone, dates being nothing of ours.

    Raises:
        pydantic.ValidationError: parts have faults.
        ValueError: a number is too large to be written.
        RecursionError: the document is nested too deeply.
    """
    text = json.dumps(document, default=lambda value: {"a date or time": str(value)})
    return Scene.model_validate_json(text, by_alias=True, by_name=False)


def to_document(scene: Scene) -> dict[str, Any]:
    """Return a scene as nested dicts and lists, defaults left out."""
    document = scene.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    return document or {"title": scene.title}
