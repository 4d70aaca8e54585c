"""Numbers of accents: an element keeps its colour while others are added, deleted or reordered."""

from collections.abc import Sequence

from sandbox.scene.description.base import BodySource
from sandbox.window.render.palette import ACCENTS


class AccentNumbers:
    """Numbers of the accents of a scene's elements, shared by all views of the scene and by its later versions.

    The elements of the first version are numbered in their order. A later version is compared with the one before:
    within a table, an element is the same if its name is, else if its values are, else by its order among those that
    are left, which finds elements whose name or values have changed. A new element gets the accent that the fewest
    others have. Names of deleted elements are remembered, so that undo restores the colour too.
    """

    def __init__(self) -> None:
        self._elements: tuple[BodySource, ...] = ()
        self._numbers: tuple[int, ...] = ()
        self._named: dict[tuple[type[BodySource], str], int] = {}

    def clear(self) -> None:
        """Forget the elements, as another scene is opened."""
        self._elements, self._numbers, self._named = (), (), {}

    def update(self, elements: Sequence[BodySource]) -> tuple[int, ...]:
        """Return the numbers of the elements of a version of the scene, which is the last one from now on."""
        present = tuple(elements)
        numbers = self._known(present) if self._elements else dict(enumerate(range(len(present))))
        counts = [0] * len(ACCENTS)
        for number in numbers.values():
            counts[number % len(ACCENTS)] += 1
        for index in range(len(present)):
            if index not in numbers:
                numbers[index] = counts.index(min(counts))
                counts[numbers[index]] += 1
        self._elements, self._numbers = present, tuple(numbers[index] for index in range(len(present)))
        for element, number in zip(present, self._numbers, strict=True):
            if element.name is not None:
                self._named[type(element), element.name] = number
        return self._numbers

    def _known(self, present: tuple[BodySource, ...]) -> dict[int, int]:
        """Return the numbers of the elements that the version before has, by index in the present one."""
        found = dict[int, int]()
        for table in {type(element) for element in present}:
            before = [k for k, element in enumerate(self._elements) if type(element) is table]
            left = [k for k, element in enumerate(present) if type(element) is table]
            for k in left:
                name = present[k].name
                if name is not None and (table, name) in self._named:
                    found[k] = self._named[table, name]
            names = {present[k].name for k in left if k in found}
            before = [k for k in before if self._elements[k].name not in names]
            left, matched = [k for k in left if k not in found], set[int]()
            by_values = dict[BodySource, list[int]]()
            for old in before:
                by_values.setdefault(self._elements[old], []).append(old)
            for k in left:
                if by_values.get(present[k]):
                    same = by_values[present[k]].pop(0)
                    found[k] = self._numbers[same]
                    matched.add(same)
            before, left = [k for k in before if k not in matched], [k for k in left if k not in found]
            found |= {k: self._numbers[old] for k, old in zip(left, before, strict=False)}
        return found
