"""Models of the tables of a scene file."""

from collections.abc import Iterator
from functools import cache
from typing import Any, get_args

from pydantic import BaseModel

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.game_tables import lazy_table


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models within an annotation, such as those of a list or of a union."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from models_in(argument)


@cache
def models() -> tuple[type[BaseModel], ...]:
    """Return the model of a scene and the models of its fields, recursively, each once."""
    found: dict[type[BaseModel], None] = {Scene: None}
    queue: list[type[BaseModel]] = [Scene]
    while queue:
        for field in queue.pop(0).model_fields.values():
            table = lazy_table(field)
            for inner in models_in(field.annotation if table is None else table.model):
                if inner not in found:
                    found[inner] = None
                    queue.append(inner)
    return tuple(found)
