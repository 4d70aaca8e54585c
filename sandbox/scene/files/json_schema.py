"""JSON schema of scene files, with the docstrings of fields as descriptions."""

import ast
import inspect
import json
import textwrap
from functools import cache
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part
from sandbox.scene.description.game_tables import game_table, is_generated, lazy_table


@cache  # reading the source takes 10 ms, and a scene may have many faults
def docstrings(model: type[BaseModel]) -> dict[str, str]:
    """Return the docstrings of the fields of a model and of its base classes."""
    found: dict[str, str] = {}
    for part in reversed(model.__mro__):
        if issubclass(part, BaseModel) and part is not BaseModel and not is_generated(part):
            (definition,) = ast.parse(textwrap.dedent(inspect.getsource(part))).body
            assert isinstance(definition, ast.ClassDef)
            for field, text in zip(definition.body, definition.body[1:], strict=False):
                match field, text:
                    case (
                        ast.AnnAssign(target=ast.Name(id=name)),
                        ast.Expr(value=ast.Constant(value=str(words))),
                    ):
                        found[name] = inspect.cleandoc(words)
    return found


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a scene file.

    It covers keys, types and ranges; references and other relations between elements are checked by `crosscheck` only.
    """
    model = Scene.model_json_schema(by_alias=True, schema_generator=_Generator)
    return {"$schema": _Generator.schema_dialect, **model}


def dumps() -> str:
    """Return the schema as text, deterministically; `scenes/scene.schema.json` contains it."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


class _Generator(GenerateJsonSchema):
    """Adapts a schema to TOML, which has no null: optional or empty values may be omitted.

    It also adds the docstrings of fields. Pydantic can do that, but reads source files at every start of a command.
    """

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        default = schema.get("default")
        if default is None or default == () or isinstance(default, Part):
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002, its name is pydantic's
        return False  # editors show the key itself

    def field_is_required(self, field: Any, total: bool) -> bool:
        """Return whether a file must have the key; it must have `kind`, whose default is that of Python only."""
        return super().field_is_required(field, total) or bool(field["schema"].get("default_factory_takes_data"))

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        result = super().model_schema(schema)
        descriptions = described(schema["cls"])
        for name, field in schema["cls"].model_fields.items():
            if name in descriptions:
                result["properties"][field.alias or name]["description"] = descriptions[name]
        return result


def described(model: type[BaseModel]) -> dict[str, str]:
    """Return the description of each field of a model: its docstring or, for a table, the first line of the table's.

    For the `kind` of a joint or drive it is the first line of that kind's docstring.
    """
    found = dict(docstrings(model))
    for name, field in model.model_fields.items():
        lazy = lazy_table(field)
        if lazy is not None:
            found[name] = game_table(lazy.heading).about
        elif name not in found:
            table = model if name == "kind" else _table_in(field.annotation)
            if table is not None:
                found[name] = inspect.cleandoc(table.__doc__ or "").partition("\n")[0]
    return found


def _table_in(annotation: Any) -> type[BaseModel] | None:
    """Return the model of a field that holds one or several of it; None for a value or a choice of models."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = [table for table in map(_table_in, get_args(annotation)) if table is not None]
    return found[0] if len(found) == 1 else None
