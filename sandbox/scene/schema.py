"""Schema: the JSON Schema of a scene file, from the model, so that editors complete and check one."""

import inspect
import json
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from sandbox.scene.docstrings import docstrings
from sandbox.scene.model import Scene
from sandbox.scene.part import Part


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a scene file.

    It knows every key, type and range; what the parts of a scene say about each other only `crosscheck` sees.
    """
    model = Scene.model_json_schema(by_alias=True, schema_generator=_Generator)
    return {"$schema": _Generator.schema_dialect, **model}


def dumps() -> str:
    """Write the schema as a text, the same for the same model; `scenes/scene.schema.json` holds it."""
    return json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


class _Generator(GenerateJsonSchema):
    """Fits a schema to TOML, which has no null: what may be None, or is empty, may be left out.

    It also takes over the docstrings of fields. Pydantic can, but would read its own source to do so at every
    start of every command.
    """

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        default = schema.get("default")
        if default is None or default == () or isinstance(default, Part):
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002, its name is pydantic's
        return False  # an editor shows the key itself

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        result = super().model_schema(schema)
        descriptions = described(schema["cls"])
        for name, field in schema["cls"].model_fields.items():
            if name in descriptions:
                result["properties"][field.alias or name]["description"] = descriptions[name]
        return result


def described(model: type[BaseModel]) -> dict[str, str]:
    """Return what each field of a model is: its docstring or, of a table, the first line of that table's own.

    Of the `kind` of a joint or drive it is the first line of what that kind is.
    """
    found = docstrings(model)
    for name, field in model.model_fields.items():
        if name not in found:
            table = model if name == "kind" else _table_in(field.annotation)
            if table is not None:
                found[name] = inspect.cleandoc(table.__doc__ or "").partition("\n")[0]
    return found


def _table_in(annotation: Any) -> type[BaseModel] | None:
    """Return the model that a field holds, one or many of; None where it is a value, or one of several models."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = [table for table in map(_table_in, get_args(annotation)) if table is not None]
    return found[0] if len(found) == 1 else None
