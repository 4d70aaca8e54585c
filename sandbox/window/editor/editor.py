"""Editor: the draft of a scene, the selection and the tools, in world coordinates, m. No drawing and no events."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Literal

from sandbox.scene.compile.generators import GeneratorError
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.editing.clipboard import CopiedElement, copy_elements, paste_elements, paste_shift
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import (
    ElementKey,
    all_elements,
    bodies_of,
    describe_elements,
    exists,
    name_of,
    removal_changes,
)
from sandbox.scene.editing.take_apart import TakeApartError, take_apart_changes
from sandbox.scene.editing.transforms import (
    AlignmentSide,
    Similarity,
    alignment_shift,
    mirror_transform,
    transform_elements,
)
from sandbox.scene.errors import Location, SceneError
from sandbox.scene.files.toml_changes import (
    AddElement,
    Change,
    TextEditError,
    with_swapped_elements,
)
from sandbox.window.editor.draw_gestures import (
    BoxGesture,
    CapsuleGesture,
    DiscGesture,
    OutlineGesture,
    PlaneGesture,
)
from sandbox.window.editor.force_tools import AttractionGesture, FlipperGesture, PlungerGesture, ThrustGesture
from sandbox.window.editor.gestures import Gesture, MoveGesture, SelectGesture, set_values
from sandbox.window.editor.handles import EditHandle, gesture_of_handle, handle_at, handles_of
from sandbox.window.editor.joint_tools import JOINT_KINDS, JointGesture, PlacementError
from sandbox.window.editor.picking import bounds_of, bounds_of_elements, elements_at, pick_element
from sandbox.window.editor.property_changes import (
    element_changes,
    fault_text,
    new_material,
    new_pair,
    table_changes,
    table_removal,
)
from sandbox.window.editor.snapping import PICK_REACH, Pointer, ViewScale

MessageCallback = Callable[[str, str], None]
"""Callback with a text and a level, `info`, `warning` or `error`."""
DRAG_REACH = 4.0
"""px at UI scale 1 that the pointer moves before a press becomes a drag"""
GESTURES: Mapping[str, Callable[[Scene, str, Pointer], Gesture]] = {
    **dict.fromkeys(("ball", "post"), DiscGesture),
    "box": BoxGesture,
    "capsule": CapsuleGesture,
    "plane": PlaneGesture,
    **dict.fromkeys(("polygon", "wall", "zone"), OutlineGesture),
    **dict.fromkeys(JOINT_KINDS, JointGesture),
    "flipper": FlipperGesture,
    "plunger": PlungerGesture,
    "thrust": ThrustGesture,
    "attraction": AttractionGesture,
}
"""Gestures that a press of a tool begins, by its name; `select` and `eraser` act on the elements that there are"""


class Editor:
    """The draft of a scene, the selection, and the tool in use.

    Args:
        draft: the draft.
        notify: callback with messages.
    """

    def __init__(self, draft: SceneDraft, notify: MessageCallback = lambda _text, _level: None) -> None:
        self.draft = draft
        self._notify = notify
        self.selection: list[ElementKey] = []
        self.tool = "select"
        self.gesture: Gesture | None = None
        self.hovered: ElementKey | None = None
        """element under the pointer"""
        self.is_dragging = False
        """whether the pointer has moved far enough since the press"""
        self.fault: tuple[list[ElementKey], str] | None = None
        """elements and message of the last change that was refused"""
        self._pressed: Point | None = None  # raw
        self._pressed_key: ElementKey | None = None
        self._was_selected = False  # whether only that element was selected before the press
        self._clip: tuple[CopiedElement, ...] = ()
        self._pastes = 0
        self._preview: tuple[Gesture, Scene] | None = None  # until the gesture changes
        self.pointer: Point | None = None

    # --- State ---------------------------------------------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """The scene as drawn: that of the draft, with the effect of the present gesture."""
        gesture = self.gesture
        if gesture is None:
            return self.draft.scene
        if self._preview is None or self._preview[0] is not gesture:
            self._preview = gesture, self._compiled(gesture)
        return self._preview[1]

    def _compiled(self, gesture: Gesture) -> Scene:
        """Return the preview of a gesture; the scene of the draft if it cannot be compiled."""
        try:
            preview = gesture.preview()
            preview.bodies  # noqa: B018, compiles it
        except (ArithmeticError, ValueError, GeneratorError):  # such as an outline without an area
            return self.draft.scene
        return preview

    def type_text(self, text: str) -> None:
        """Replace the typed dimensions of the gesture."""
        self._preview = None
        if self.gesture is not None:
            self.gesture.type_text(text)

    @property
    def is_locked(self) -> bool:
        """Whether the elements come from a preset, and cannot be edited before it is taken apart."""
        return self.draft.preset is not None

    def choose_tool(self, name: str) -> None:
        """Choose a tool, and cancel a gesture; the selection stays."""
        if self.gesture is not None:
            self.cancel()
        self.tool = name

    def selection_bounds(self, scene: Scene | None = None) -> tuple[Point, Point] | None:
        """Return the corners of the box around the selection, m; None without bounded elements."""
        return bounds_of_elements(scene or self.scene, self.selection)

    def handles(self, view: ViewScale) -> list[EditHandle]:
        """Return the handles of the selection."""
        scene = self.scene
        if self.tool != "select" or not self.selection or (self.gesture is not None and not self.gesture.edits):
            return []
        return handles_of(scene, self.selection, view)

    @property
    def single_body(self) -> int | None:
        """Index of the body if exactly one single body is selected."""
        if len(self.selection) != 1 or not exists(self.draft.scene, self.selection[0]):
            return None
        bodies = bodies_of(self.draft.scene, self.selection[0])
        return bodies[0] if len(bodies) == 1 else None

    # --- Mouse ---------------------------------------------------------------------------------------------------

    def hover(self, point: Point, view: ViewScale) -> None:
        """Note the element under the pointer."""
        self.pointer = point
        if self.gesture is None and not self.is_locked:
            self.hovered = pick_element(self.draft.scene, point, view.metres(PICK_REACH))

    def handle_at(self, point: Point, view: ViewScale) -> EditHandle | None:
        """Return the handle at a point."""
        return handle_at(self.handles(view), point, view)

    def press(self, point: Point, view: ViewScale, *, shift: bool = False, control: bool = False) -> None:
        """Press the left button at a point."""
        self.fault = self._preview = None
        pointer = Pointer(point, view, is_free=control)
        if self.is_locked:
            self._notify_locked()
            return
        if self.gesture is not None and self.gesture.is_multi_click:
            if self.gesture.click(pointer):
                self.finish()
            return
        self.is_dragging, self._pressed, self._pressed_key = False, point, None
        if self.tool == "select":
            self._press_select(point, view, shift)
        elif self.tool == "eraser":
            self._erase(point, view)
        else:
            self._begin(pointer)

    def _begin(self, pointer: Pointer) -> None:
        """Begin the gesture of the tool, and finish it if the press is all that it needs."""
        try:
            self.gesture = GESTURES[self.tool](self.draft.scene, self.tool, pointer)
        except PlacementError as error:
            self._pressed = None
            self._notify(str(error), "warning")
        if self.gesture is not None and self.gesture.is_one_click:
            self.finish()

    def _notify_locked(self) -> None:
        self._notify(f"[{self.draft.preset}] makes this scene; Ctrl+Shift+X takes it apart", "warning")

    def _press_select(self, point: Point, view: ViewScale, shift: bool) -> None:
        scene, handle = self.draft.scene, self.handle_at(point, view)
        if handle is not None:
            self.gesture = gesture_of_handle(scene, self.selection, handle)
            return
        found = elements_at(scene, point, view.metres(PICK_REACH))
        key = next((each for each in found if self.selection == [each]), found[0] if found else None)
        self._pressed_key, self._was_selected = key, self.selection == [key]
        if key is None:
            self.gesture = SelectGesture(scene, point, self.selection if shift else ())
            if not shift:
                self.selection = []
        elif shift:
            others = [each for each in self.selection if each != key]
            self.selection = others if key in self.selection else [*others, key]
        elif key not in self.selection:
            self.selection = [key]

    def move(self, point: Point, view: ViewScale, *, control: bool = False) -> None:
        """Move the pointer to a point while the button is down, or between clicks."""
        self.pointer, self._preview = point, None
        if self._pressed is not None and math.dist(point, self._pressed) > view.metres(DRAG_REACH):
            if not self.is_dragging and self.gesture is None and self._pressed_key in self.selection:
                self.gesture = MoveGesture(self.draft.scene, self.selection, self._pressed)
            self.is_dragging = True
        if self.tool == "eraser" and self._pressed is not None:
            self._erase(point, view)
        gesture = self.gesture
        if gesture is None or gesture.typed or not (self.is_dragging or gesture.is_multi_click):
            return
        gesture.drag(Pointer(point, view, control, self._pressed is not None and self.is_dragging))

    def release(self, point: Point, view: ViewScale, *, shift: bool = False, control: bool = False) -> None:
        """Release the left button at a point."""
        self.move(point, view, control=control)
        pressed, is_dragged = self._pressed, self.is_dragging
        self._pressed, self.is_dragging = None, False
        if self.gesture is None:
            if self._pressed_key is not None and not is_dragged and not shift and pressed is not None:
                self.selection = [self._next_at(pressed, view)]
        elif not self.gesture.is_multi_click:
            self.finish()

    def _next_at(self, point: Point, view: ViewScale) -> ElementKey:
        """Return the element that a click selects: the topmost one, or the one below the one that was selected."""
        assert self._pressed_key is not None
        found = elements_at(self.draft.scene, point, view.metres(PICK_REACH))
        if not self._was_selected or self._pressed_key not in found:
            return self._pressed_key
        return found[(found.index(self._pressed_key) + 1) % len(found)]

    def finish(self) -> bool:
        """Finish the gesture, and apply its changes; return whether that succeeded."""
        gesture, self.gesture = self.gesture, None
        self._pressed, self.is_dragging = None, False
        if gesture is None:
            return False
        try:
            changes = gesture.changes()
        except PlacementError as error:
            self._notify(str(error), "warning")
            return False
        selects = gesture.selects
        if gesture.edits and (not changes or not self.apply(changes, gesture.label)):
            return False
        if gesture.note:
            self._notify(gesture.note, "info")
        if selects is not None:
            self.selection = [key for key in selects if exists(self.draft.scene, key)]
        return True

    def confirm(self) -> None:
        """Take the key Enter during a gesture: finish it, or add the corner that was typed."""
        self._preview = None
        if self.gesture is not None and self.gesture.confirm():
            self.finish()

    def take_back(self) -> bool:
        """Remove the last typed character of a gesture, else its last corner; return whether there was one."""
        gesture = self.gesture
        if gesture is None or not (gesture.typed or gesture.corners):
            return False
        if gesture.typed:
            self.type_text(gesture.typed[:-1])
            return True
        self._preview = None
        gesture.corners.pop()
        if not gesture.corners:
            self.cancel()
        return True

    def cancel(self) -> bool:
        """Cancel the gesture, else clear the selection, else choose the select tool; return whether any applied."""
        self._pressed, self.is_dragging = None, False
        if self.gesture is not None:
            self.gesture = None
            return True
        if self.selection:
            self.selection = []
            return True
        if self.tool != "select":
            self.tool = "select"
            return True
        return False

    def _erase(self, point: Point, view: ViewScale) -> None:
        key = pick_element(self.draft.scene, point, view.metres(PICK_REACH))
        if key is not None and (self.is_dragging is False or key.table != "plane"):
            self.selection = []
            self.apply(removal_changes(self.draft.scene, [key]), f"erase {name_of(self.draft.scene, key)}")
            self.hovered = None

    # --- Operations ----------------------------------------------------------------------------------------------

    def apply(self, changes: Sequence[Change], label: str, merge: str | None = None) -> bool:
        """Apply changes to the draft; return whether that succeeded. Faults are shown at the selected elements."""
        try:
            self.draft.change(changes, label, merge)
        except SceneError as error:
            message = fault_text(error)
            self.fault = list(self.selection) if self.tool == "select" else [], message
            self._notify(message, "error")
            return False
        except TextEditError as error:
            self._notify(str(error), "error")
            return False
        self.fault = None
        self._drop_gesture()
        self.hovered = None if self.hovered is None or not exists(self.draft.scene, self.hovered) else self.hovered
        return True

    def _drop_gesture(self) -> None:
        """Cancel the gesture and the click under way when the draft changes: they refer to its old elements."""
        self.gesture = self._pressed_key = None

    def delete(self) -> None:
        """Delete the selection, and the joints and forces of its bodies."""
        keys = self._selection_or_note()
        if keys:
            self.selection = []
            if not self.apply(removal_changes(self.draft.scene, keys), f"delete {describe_elements(keys)}"):
                self.selection = keys

    def select_all(self) -> None:
        """Select all elements with a place."""
        if self.is_locked:
            self._notify_locked()
            return
        hidden = ("material", "pair", "drive", "shot")
        self.selection = [key for key, _ in all_elements(self.draft.scene) if key.table not in hidden]

    def copy(self) -> None:
        """Copy the selection."""
        keys = self._selection_or_note()
        if keys:
            self._clip, self._pastes = copy_elements(self.draft.scene, keys), 0

    def cut(self) -> None:
        """Copy and delete the selection."""
        self.copy()
        if self.selection:
            self.delete()

    def paste(self, view: ViewScale) -> None:
        """Add copies of what was copied, beside it, and select them."""
        if not self._clip:
            self._notify("nothing was copied; Ctrl+C copies the selection", "warning")
            return
        self._pastes += 1
        self._add_copies(self._clip, paste_shift(view.grid, self._pastes), "paste")

    def duplicate(self, view: ViewScale) -> None:
        """Add copies of the selection beside it, and select them."""
        keys = self._selection_or_note()
        if keys:
            shift = paste_shift(view.grid, 1)
            self._add_copies(copy_elements(self.draft.scene, keys), shift, "duplicate")

    def _add_copies(self, elements: tuple[CopiedElement, ...], shift: Point, label: str) -> None:
        changes, keys = paste_elements(self.draft.scene, elements, Similarity(shift=shift))
        if changes and self.apply(changes, f"{label} {describe_elements(keys)}"):
            self.tool = "select"
            self.selection = [key for key in keys if key.table not in ("drive",)]

    def nudge(self, shift: Point) -> None:
        """Move the selection by a vector, m."""
        if self.selection:
            values = transform_elements(self.draft.scene, self.selection, Similarity(shift=shift))
            self.apply(set_values(values), f"move {describe_elements(self.selection)}", "nudge")

    def mirror(self, *, is_vertical: bool = False) -> None:
        """Mirror the selection about the middle of its box, left and right or up and down."""
        box = self.selection_bounds(self.draft.scene)
        if box is None or not self._selection_or_note():
            return
        values = transform_elements(self.draft.scene, self.selection, mirror_transform(box, is_vertical=is_vertical))
        self.apply(set_values(values), f"mirror {describe_elements(self.selection)}")

    def align(self, side: AlignmentSide) -> None:
        """Align the selected elements by a side of their boxes, with the box of all of them."""
        box = self.selection_bounds(self.draft.scene)
        if box is None or len(self.selection) < 2:
            self._notify("select two or more elements to align", "warning")
            return
        values: dict[ElementKey, dict[str, Any]] = {}
        for key in self.selection:
            own = bounds_of(self.draft.scene, key)
            if own is not None:
                values |= transform_elements(self.draft.scene, [key], Similarity(shift=alignment_shift(own, box, side)))
        self.apply(set_values(values), f"align {describe_elements(self.selection)}")

    def reorder(self, step: Literal[-1, 1]) -> None:
        """Exchange the selected element with the next (1) or the previous one (−1) of its table.

        Later elements are drawn above earlier ones, and have higher numbers.
        """
        if len(self.selection) != 1:
            self._notify("select one element to change its order", "warning")
            return
        key = self.selection[0]
        other = ElementKey(key.table, key.index + step)
        if not exists(self.draft.scene, other):
            self._notify(f"it is the {'last' if step > 0 else 'first'} {key.table} already", "info")
            return
        try:
            text = with_swapped_elements(self.draft.text, key.table, key.index, other.index)
            self.draft.replace_text(text, f"move {name_of(self.draft.scene, key)} {'up' if step > 0 else 'down'}")
        except (SceneError, TextEditError) as error:
            self._notify(str(error), "error")
            return
        self.selection = [other]

    def undo(self) -> None:
        """Undo the last change."""
        self._drop_gesture()
        label = self.draft.undo()
        self._after_history("undone", label)

    def redo(self) -> None:
        """Do the last undone change again."""
        self._drop_gesture()
        self._after_history("redone", self.draft.redo())

    def _after_history(self, what: str, label: str | None) -> None:
        self.fault = None
        self.selection = [key for key in self.selection if exists(self.draft.scene, key)]
        self.hovered = None
        self._notify(f"nothing to be {what}" if label is None else f"{what}: {label}", "info")

    def take_apart(self) -> None:
        """Replace the preset of the scene by its elements, or else selected generators by bodies, and divide walls."""
        preset = self.draft.preset
        if preset is None:
            self._take_elements_apart()
            return
        self._drop_gesture()
        try:
            self.draft.take_apart_preset()
        except SceneError as error:
            self._notify(error.faults[0].message, "error")
            return
        self._notify(f"[{preset}] was replaced by its elements, without comments", "info")

    def _take_elements_apart(self) -> None:
        keys = self._selection_or_note()
        try:
            changes = take_apart_changes(self.draft.scene, keys)
        except TakeApartError as error:
            self._notify(str(error), "warning")
            return
        are_walls, described = all(key.table == "wall" for key in keys), describe_elements(keys)
        if keys and self.apply(changes, f"divide {described}" if are_walls else f"take {described} apart"):
            self.selection = []
            parts = sum(isinstance(change, AddElement) for change in changes)
            walls = f"divided into {parts + len(keys)} walls of two points"
            self._notify(walls if are_walls else f"{parts} elements in their place now", "info")

    def _selection_or_note(self) -> list[ElementKey]:
        if not self.selection:
            self._notify("select something first: click it", "warning")
        return list(self.selection)

    # --- Properties ----------------------------------------------------------------------------------------------

    def set_property(self, keys: Collection[ElementKey], name: str, value: Any) -> str | None:
        """Set a key of elements, as `element_changes` does; return the message of a fault, or None."""
        changes = element_changes(self.draft.scene, self.draft.document, keys, name, value)
        return self._change_property(changes, f"set {name} of {describe_elements(list(keys))}", name)

    def set_value(self, location: Location, name: str, value: Any) -> str | None:
        """Set a key of a table at a location, as `table_changes` does; return the message of a fault, or None."""
        changes = table_changes(self.draft.scene, self.draft.document, location, name, value)
        return self._change_property(changes, f"set {name}", name)

    def _change_property(self, changes: Sequence[Change], label: str, field: str) -> str | None:
        """Apply the changes of a property; return the message of a fault, or None."""
        try:
            self.draft.change(changes, label)
        except SceneError as error:
            return fault_text(error, field)
        except TextEditError as error:
            return str(error)
        self._drop_gesture()
        self.fault = None
        return None

    def remove_table(self, location: Location) -> None:
        """Remove a table, such as `[surface]`, a part of a rigid body, or a material that nothing has."""
        table = location[-2] if isinstance(location[-1], int) else location[-1]
        self._apply_or_notify(lambda scene: table_removal(scene, location), f"remove a {table}")

    def add_material(self) -> None:
        """Add a material with a new name."""
        self._apply_or_notify(lambda scene: [new_material(scene)], "add a material")

    def add_pair(self) -> None:
        """Add coefficients of a pair of materials that has none yet."""
        self._apply_or_notify(lambda scene: [new_pair(scene)], "add a pair")

    def _apply_or_notify(self, changes: Callable[[Scene], list[Change]], label: str) -> bool:
        """Apply the changes of a scene, or show why there are none; return whether they were applied."""
        try:
            found = changes(self.draft.scene)
        except PlacementError as error:
            self._notify(str(error), "warning")
            return False
        return bool(found) and self.apply(found, label)
