"""Tables of a scene file: their models, their keys, and the tables that may occur several times."""

from typing import Any, get_args

from pydantic import BaseModel

from sandbox.scene.description.forces import Driven, PlungerDrive, StrokeDrive, TorqueDrive
from sandbox.scene.description.game_tables import lazy_table
from sandbox.scene.description.joints import (
    Gear,
    Groove,
    Joined,
    Motor,
    Pivot,
    Rod,
    RotaryLimit,
    RotarySpring,
    Slide,
    Spring,
)
from sandbox.scene.errors import Location
from sandbox.scene.scene import Scene


def list_tables() -> list[str]:
    """Return the tables that may occur several times, those of bodies first."""
    lists = [str(field.alias) for field in Scene.model_fields.values() if field.alias is not None]
    return sorted(lists, key=lambda table: table not in Scene().kinds)


def keys_of(model: type[BaseModel]) -> list[str]:
    """Return the keys of a table."""
    return [field.alias or name for name, field in model.model_fields.items()]


def model_at(location: Location) -> type[BaseModel]:
    """Return the model of a table by its location; for joints and drives the kind follows the index."""
    model: type[BaseModel] = Scene
    for key in location:
        if model is Scene and key in TAGGED:
            kinds, common = TAGGED[str(key)]
            return kinds.get(str(location[2]), common) if len(location) > 2 else common
        if isinstance(key, str):
            field = {field.alias or name: field for name, field in model.model_fields.items()}[key]
            table = lazy_table(field)
            annotation = field.annotation if table is None else table.model
            model = next(m for m in (annotation, *get_args(annotation)) if _is_model(m))
    return model


JOINTS: dict[str, type[BaseModel]] = {
    tag: model
    for model in (Rod, Pivot, Slide, Groove, RotaryLimit, Motor, Gear, Spring, RotarySpring)
    for tag in get_args(model.model_fields["kind"].annotation)
}
"""Models of joints by their `kind`."""


DRIVES: dict[str, type[BaseModel]] = {"torque": TorqueDrive, "stroke": StrokeDrive, "plunger": PlungerDrive}
"""Models of drives by their `kind`."""


TAGGED: dict[str, tuple[dict[str, type[BaseModel]], type[BaseModel]]] = {
    "joint": (JOINTS, Joined),
    "drive": (DRIVES, Driven),
}
"""Tables with a `kind`: models by kind, and the base model of all of them."""


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
