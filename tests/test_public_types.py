"""Types that the public interface takes, returns or has as attributes can be imported from `sandbox`."""

import ast
import dataclasses
import inspect
import sys
from collections.abc import Iterator
from functools import cache, cached_property
from types import SimpleNamespace
from typing import Any, get_args, get_type_hints

import pytest
from pydantic import BaseModel

import sandbox

pytestmark = pytest.mark.fail_slow(60)  # imports the whole package


def is_own(value: Any) -> bool:
    return str(value.__module__).partition(".")[0] == "sandbox"


@cache
def names_of(module: str) -> dict[str, Any]:
    """Return the names of a module, with those that it imports for type checkers only."""
    names = dict(vars(sys.modules[module]))
    for node in ast.parse(inspect.getsource(sys.modules[module])).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            imports: list[ast.stmt] = [each for each in node.body if isinstance(each, ast.ImportFrom)]
            exec(compile(ast.Module(imports, []), module, "exec"), names)
    return names


def classes_in(hint: Any) -> Iterator[type]:
    """Yield the classes of this package in an annotation."""
    if isinstance(hint, type) and not get_args(hint) and is_own(hint) and not hint.__name__.startswith("_"):
        yield hint
    for each in get_args(hint):
        yield from classes_in(each)


def classes_of(value: Any, only: str | None = None) -> Iterator[type]:
    """Yield the classes in the annotations of a function or class, or in one of them."""
    hints = {key: hint for key, hint in inspect.get_annotations(value).items() if only in (None, key)}
    holder = SimpleNamespace(__annotations__=hints)
    for name, hint in get_type_hints(holder, names_of(value.__module__)).items():
        if not name.startswith("_"):
            yield from classes_in(hint)


def function_of(member: Any) -> Any:
    """Return the function of a property or method."""
    match member:
        case property():
            return member.fget
        case cached_property():
            return member.func
        case classmethod() | staticmethod():
            return member.__func__
    return member


def classes_of_attributes(kind: type) -> Iterator[type]:
    """Yield the classes of the public attributes of a class, and those that its methods return."""
    for name, member in inspect.getmembers_static(kind):
        function = function_of(member)
        if not name.startswith("_") and inspect.isfunction(function) and is_own(function):
            yield from classes_of(function, "return")
    if dataclasses.is_dataclass(kind) or issubclass(kind, BaseModel):
        for base in filter(is_own, kind.__mro__):
            yield from classes_of(base)


def reachable_classes() -> dict[type, str]:
    """Return the classes that are reachable from a public name, and how."""
    found: dict[type, str] = {}
    public = [(name, getattr(sandbox, name)) for name in sandbox.__all__]
    waiting = [(each, name) for name, value in public if inspect.isfunction(value) for each in classes_of(value)]
    waiting += [(value, name) for name, value in public if isinstance(value, type)]
    while waiting:
        kind, origin = waiting.pop()
        if kind not in found:
            found[kind] = origin
            waiting += [(each, f"{origin}, {kind.__name__}") for each in classes_of_attributes(kind)]
    return found


def test_classes_of_the_public_interface_are_public() -> None:
    found = reachable_classes()
    assert {sandbox.Row, sandbox.Wall, sandbox.QuantityStatistics} <= found.keys()
    private = {origin: kind for kind, origin in found.items() if kind.__name__ not in sandbox.__all__}
    assert private == {}
    assert all(getattr(sandbox, kind.__name__) is kind for kind in found)


def test_lists_are_accepted_for_tuples_and_stored_as_tuples() -> None:
    outline = [[0, 0], [1, 0], [0.0, 1.0]]
    scene = sandbox.Scene(
        polygons=[sandbox.Polygon(name="a", points=outline, categories=["x"])],
        joints=[sandbox.Pivot(between=["a"], at=[0, 0])],
        attractions=[sandbox.Attraction(toward=[1, 2], strength=1.0)],
        cloths=[sandbox.Cloth(corner=[0, 9], columns=2, rows=2, spacing=[1, 1], stiffness=9.0, pins=[[0, 0], [1, 0]])],
    )
    assert scene.polygons[0].points == ((0, 0), (1, 0), (0, 1))
    assert (scene.polygons[0].categories, scene.joints[0].between, scene.cloths[0].pins) == (
        ("x",),
        ("a",),
        ((0, 0), (1, 0)),
    )
    assert scene.attractions[0].toward == (1, 2)
    assert sandbox.loads(sandbox.dumps(scene)) == scene


@pytest.mark.parametrize("position", ["ab", {0.0: 1.0, 1.0: 2.0}, [1.0], [1.0, "2"], [1.0, 2.0, 3.0]])
def test_other_values_are_refused_for_tuples(position: Any) -> None:
    with pytest.raises(ValueError, match="position"):
        sandbox.Ball(radius=1.0, position=position)


def test_kind_of_a_joint_is_known_in_python_and_needed_in_a_file() -> None:
    rod = sandbox.Rod(between=["a"])
    assert rod.kind == "rod"
    with pytest.raises(sandbox.SceneError, match="kind"):
        sandbox.loads('[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 1\n[[joint]]\nbetween = ["a"]\n')
