"""Tables of games in scene files: a scene has a field for each, and imports a game only if its table occurs.

A game adds tables by `GameSpec.tables`. A table that expands to elements is a `sandbox.scene.files.presets.Preset`,
other tables are a `GameTable`.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, TypeVar

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, create_model
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from sandbox.game_names import game_tables
from sandbox.game_spec import import_part
from sandbox.scene.description.base import Part

GAME_TABLES: dict[str, str] = game_tables()
"""Import string, `module:name`, of the `GameTable` of each heading. Presets expand in this order."""

PRESETS = tuple(heading for heading in GAME_TABLES if "." not in heading)
"""Tables at the top of a document, which are fields of a scene and expand to its elements."""

Model = TypeVar("Model", bound=Part)


@dataclass(frozen=True)
class GameTable:
    """Table of a game."""

    model: type[Part]
    about: str
    """description of the key, for the JSON schema"""
    is_kept: bool = True
    """whether a scene still has the table after it has been read; otherwise elements replace the table"""


@cache
def game_table(heading: str) -> GameTable:
    """Import the game of a heading, and return its table.

    Raises:
        KeyError: `GAME_TABLES` has no such heading.
    """
    table = import_part(GAME_TABLES[heading])
    assert isinstance(table, GameTable)
    return table


@dataclass(frozen=True)
class LazyTable:
    """Annotation of the field for a table: its model is imported when a document has the table."""

    heading: str

    @property
    def model(self) -> type[Part]:
        """Model of the table; imports the game."""
        return game_table(self.heading).model

    def validate(self, value: Any, info: core_schema.ValidationInfo) -> Part:
        """Return the table as its model.

        Raises:
            pydantic.ValidationError: it has faults; pydantic adds their locations to those of the scene.
        """
        if info.mode == "json":  # arrays are valid tuples in JSON mode only; here they are lists
            return self.model.model_validate_json(json.dumps(value), by_alias=True, by_name=False)
        return self.model.model_validate(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.nullable_schema(core_schema.with_info_plain_validator_function(self.validate))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        self.model.model_rebuild()  # models are built on first use
        return handler(core_schema.nullable_schema(self.model.__pydantic_core_schema__))


def with_game_tables(within: str = "") -> Callable[[type[Model]], type[Model]]:
    """Return a class decorator that adds a field for each table of `GAME_TABLES`, after the existing ones.

    Args:
        within: heading of the table that contains them, such as `play`; default: the scene itself.
    """
    keys = {heading.rpartition(".")[2]: heading for heading in GAME_TABLES if heading.rpartition(".")[0] == within}
    fields: dict[str, Any] = {key: (Annotated[Any, LazyTable(heading)], None) for key, heading in keys.items()}

    def extend(model: type[Model]) -> type[Model]:
        return create_model(model.__name__, __base__=model, __module__=__name__, **fields)

    return extend


def is_generated(model: type) -> bool:
    """Return whether a model was created by `with_game_tables`, so that it has no source text."""
    return model.__module__ == __name__


def has_preset(document: dict[str, Any], paths: Iterable[str] = ()) -> bool:
    """Return whether a document has a preset, or an override adds one."""
    return any(key in document for key in PRESETS) or any(path.startswith(PRESETS) for path in paths)


def unexpanded(scene: Part) -> str | None:
    """Return the heading of the first table that has not been replaced by its elements; None without one."""
    return next((key for key in PRESETS if getattr(scene, key) is not None and not game_table(key).is_kept), None)


def lazy_table(field: FieldInfo) -> LazyTable | None:
    """Return the annotation of the field of a table; None for other fields."""
    return next((each for each in field.metadata if isinstance(each, LazyTable)), None)


def table_of(part: Part, model: type[Model]) -> Model | None:
    """Return the table of a game in a scene or in its `[play]`, by its model; None if it is absent.

    Args:
        part: a scene, or its `play`.
        model: model of the table, such as `sandbox.games.artillery.scene.Artillery`.
    """
    return next((value for value in vars(part).values() if isinstance(value, model)), None)
