"""Fields of pydantic models that Python code uses, such as actions."""

from pydantic import BaseModel
from scene_tables import keys_table

import sandbox
from sandbox.rehearsal.input_script import InputChange, InputScript
from sandbox.scene.files.json_schema import _Generator


def model_fields(*names: str) -> str:
    """Return the class and the table of fields of each model among the public names."""
    return "\n\n".join(_model(name) for name in names)


def input_script() -> str:
    """Return the keys of a script of inputs."""
    parts = []
    for model, heading in ((InputScript, "At the top of the file"), (InputChange, "`[[input]]`")):
        document = model.model_json_schema(schema_generator=_Generator)
        parts.append(f"## {heading}\n\n{keys_table(document, ('script', model.__name__), document)}")
    return "\n\n".join(parts)


def classes(*names: str) -> str:
    """Return the classes among the public names, each with its docstring only."""
    lines = "\n".join(f".. autoclass:: sandbox.{name}\n   :no-members:" for name in names)
    return f"```{{eval-rst}}\n{lines}\n```"


def _model(name: str) -> str:
    model = getattr(sandbox, name)
    assert issubclass(model, BaseModel)
    document = model.model_json_schema(by_alias=True, schema_generator=_Generator)
    table = {"properties": {k: v for k, v in document["properties"].items() if k != "kind"}}
    table["required"] = document.get("required", ())
    return f"{_class(name)}\n\n{keys_table(document, ('python', name), table)}"


def _class(name: str) -> str:
    return f"```{{eval-rst}}\n.. autoclass:: sandbox.{name}\n   :no-members:\n```"
