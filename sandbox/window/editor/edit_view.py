"""Edit view: what the window shows and how it reacts while a scene is edited. Time stands at 0."""

from collections.abc import Callable
from contextlib import suppress
from datetime import date, datetime
from pathlib import Path
from time import monotonic
from typing import Any

import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.editing.autosave import Autosave, RecoveredText, recoverable
from sandbox.scene.editing.draft import SceneDraft
from sandbox.scene.editing.elements import differ_in_poses_only
from sandbox.scene.errors import SceneError
from sandbox.window.context import WindowContext
from sandbox.window.editor.check_marks import CheckMarks
from sandbox.window.editor.editor import Editor
from sandbox.window.editor.element_properties import location_of, property_sections
from sandbox.window.editor.ghost_path import GhostPredictor
from sandbox.window.editor.live_check import LiveCheck
from sandbox.window.editor.overlay import draw_ghost_path, draw_overlay
from sandbox.window.editor.picking import start_frame
from sandbox.window.editor.property_panel import PropertyPanel
from sandbox.window.editor.snapping import ViewScale
from sandbox.window.editor.toolbar import TOOLS, EditTool, Toolbar
from sandbox.window.input.keymap import Command
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.palette import FAINT, INK, ORANGE, PANEL_RAISED, SKY, WARNING
from sandbox.window.render.renderer import Renderer
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size, wrap_text
from sandbox.window.ui.hud import draw_messages, draw_notice
from sandbox.window.ui.text_edit import TextEdit, draw_text_edit

ACTIONS = (
    EditTool("play", "Space", "run the scene from the start"),
    EditTool("undo", "Ctrl+Z", "undo"),
    EditTool("redo", "Ctrl+Shift+Z", "redo"),
    EditTool("save", "Ctrl+S", "save the scene file"),
)
TYPED = "0123456789.,-x "
"""Characters that are typed into the dimensions of a gesture"""
HANDLE_CURSORS = {
    ("scale", 0): pygame.SYSTEM_CURSOR_SIZENESW,
    ("scale", 1): pygame.SYSTEM_CURSOR_SIZENWSE,
}
"""Cursors of the handles at the corners, by kind and parity of the corner"""
PROMPT_WIDTH = 520
"""px at UI scale 1"""


class PathPrompt:
    """Asks for a path. `handle_event` returns it once it is entered."""

    def __init__(self, path: Path) -> None:
        self._edit = TextEdit(str(path))
        stem = len(str(path)) - len(path.suffix)
        self._edit.anchor, self._edit.caret = stem - len(path.stem), stem  # typing replaces the name
        self._asked: Path | None = None
        self._shift = 0  # px by which the text is moved to the left
        self.note = ""
        """question or fault that is shown below the field"""
        self.is_closed = False

    def handle_event(self, event: pygame.event.Event) -> Path | None:
        """Process an event of the keyboard; return the path when Enter is pressed."""
        if event.type == pygame.TEXTINPUT:
            self._edit.insert(event.text)
        elif event.type == pygame.KEYDOWN:
            if event.key == pygame.K_ESCAPE:
                self.is_closed = True
            elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
                return self._path()
            else:
                self._edit.press(event)
        return None

    def _path(self) -> Path | None:
        """Return the path, with `.toml` added; None if it is empty, or if an existing file must be confirmed."""
        text = self._edit.text.strip()
        if not text:
            self.note = "type the name of a file, such as my-scene.toml"
            return None
        try:
            path = Path(text).expanduser()
        except RuntimeError:  # there is no such user
            path = Path(text)
        if not path.name:
            self.note = f"{text} is a folder; give the name of a file"
            return None
        if path.suffix.lower() != ".toml":
            path = path.with_name(f"{path.name}.toml")
        try:
            exists = path.exists()
        except OSError:  # reported when it is written
            exists = False
        if exists and path != self._asked:
            self._asked, self.note = path, f"{path.name} exists; Enter again replaces it"
            return None
        return path

    def draw(self, surface: pygame.Surface, ui_scale: float) -> None:
        """Draw the prompt in the middle of the window."""
        size = 13.5 * ui_scale
        lines = wrap_text(self.note, size, (PROMPT_WIDTH - 40) * ui_scale, 3) if self.note else []
        width = min(round(PROMPT_WIDTH * ui_scale), surface.get_width() - 20)
        rect = pygame.Rect(0, 0, width, round((96 + 20 * len(lines)) * ui_scale))
        rect.center = surface.get_rect().center
        draw_box(surface, rect, 8 * ui_scale, opacity=248, edge=SKY)
        left, top = rect.left + 18 * ui_scale, rect.top + 14 * ui_scale
        draw_text(surface, "Save the scene as", (left, top), size, INK, bold=True)
        draw_text(
            surface, "Enter: save · Esc: cancel", (rect.right - 18 * ui_scale, top), 0.85 * size, FAINT, "topright"
        )
        field = pygame.Rect(
            round(left), round(top + 26 * ui_scale), round(rect.width - 36 * ui_scale), round(28 * ui_scale)
        )
        pygame.draw.rect(surface, PANEL_RAISED, field, border_radius=round(4 * ui_scale))
        inner = field.inflate(-round(0.8 * size), 0)
        self._shift = draw_text_edit(surface, self._edit, inner, size, self._shift)
        for k, line in enumerate(lines):
            draw_text(surface, line, (left, field.bottom + (8 + 20 * k) * ui_scale), size, WARNING)


class EditView:
    """Editing of a scene in the window.

    Args:
        context: the window.
        draft: the draft of the scene.
        leave: called to run the scene.
        run_command: runs a command of the window.
        folder: for autosaves of scenes without a file; by default the working folder.
    """

    def __init__(
        self,
        context: WindowContext,
        draft: SceneDraft,
        leave: Callable[[], None],
        run_command: Callable[[Command], None],
        folder: Path | None = None,
    ) -> None:
        self._context, self.leave, self._run_command = context, leave, run_command
        self.editor = Editor(draft, context.app_state.messages.add)
        self.toolbar, self.actions = Toolbar(TOOLS), Toolbar(ACTIONS)
        self.panel = PropertyPanel(context.surface.get_size(), context.gui.ui_scale)
        self.panel.on_change = self._set_property
        self.panel.on_remove, self.panel.on_add = self._remove_section, self._add_section
        self.prompt: PathPrompt | None = None
        self.autosave, self._folder = Autosave(draft, folder), folder
        self.recovered: RecoveredText | None = recoverable(draft.path, folder)
        """unsaved changes of a former editor, about which the user is asked"""
        self._renderer, self._ghost = Renderer(context.gui.accents), GhostPredictor()
        self.live_check, self.check_marks = LiveCheck(), CheckMarks()
        self._shown: tuple[object, ...] = ()
        self._button_held = False
        self._cursor = pygame.SYSTEM_CURSOR_ARROW

    @property
    def draft(self) -> SceneDraft:
        """The draft of the scene."""
        return self.editor.draft

    @property
    def view_scale(self) -> ViewScale:
        """Scale of the view, as gestures need it."""
        camera, gui = self._context.camera, self._context.gui
        return ViewScale(camera.scale, gui.ui_scale, max(min(gui.area.size), 1) / camera.scale)

    # --- Events --------------------------------------------------------------------------------------------------

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Process an event; return whether it was consumed. Keys, wheel and window events are left to others."""
        if self.recovered is not None and event.type in (pygame.KEYDOWN, pygame.TEXTINPUT, pygame.MOUSEBUTTONDOWN):
            self._answer_recovery(self.recovered, event)
            return True
        if self.prompt is not None and event.type in (pygame.KEYDOWN, pygame.TEXTINPUT, pygame.MOUSEBUTTONDOWN):
            self._prompt(self.prompt, event)
            return True
        if self._context.gui.panel.visible:
            self._show_panel(self._context.surface.get_size())  # an event before it may have changed the draft
            if self.panel.handle_event(event):
                return True
        if self._use_check_marks(event):
            return True
        if event.type == pygame.TEXTINPUT:
            return self._type(event.text)
        if event.type in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP, pygame.MOUSEMOTION):
            return self._mouse(event)
        if event.type == pygame.WINDOWFOCUSLOST:
            self.drop_gesture()
        return False

    def reset_cursor(self) -> None:
        """Show the arrow again, when the scene runs."""
        self._cursor = pygame.SYSTEM_CURSOR_ARROW
        with suppress(pygame.error):
            pygame.mouse.set_cursor(self._cursor)

    def drop_gesture(self) -> None:
        """Cancel the gesture and the press of the button, whose release will not be seen."""
        self._button_held = False
        if self.editor.gesture is not None:
            self.editor.cancel()

    def _use_check_marks(self, event: pygame.event.Event) -> bool:
        """Pass an event to the marks of the check, and apply the remedy that is clicked; return whether it was used."""
        self.check_marks.takes_marks = self.editor.gesture is None and not self._button_held
        used, remedy = self.check_marks.handle_event(event)
        if remedy is not None:
            self.panel.commit()
            self.editor.apply(list(remedy.changes), f"set {remedy.label}")
            self.note_unsaved()
        return used

    def _mouse(self, event: pygame.event.Event) -> bool:
        for bar, use in ((self.actions, self._use_action), (self.toolbar, self.editor.choose_tool)):
            used, name = bar.handle_event(event)
            if name is not None:
                self.panel.commit()
                use(name)
            if used:
                return True
        point, view = self._context.camera.to_world(event.pos), self.view_scale
        modifiers = pygame.key.get_mods()
        shift, control = bool(modifiers & pygame.KMOD_SHIFT), bool(modifiers & pygame.KMOD_CTRL)
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self.panel.commit()
            self._button_held = True
            self.editor.press(point, view, shift=shift, control=control)
            return True
        if event.type == pygame.MOUSEBUTTONUP and event.button == 1 and self._button_held:
            self._button_held = False
            self.editor.release(point, view, shift=shift, control=control)
            return True
        if event.type == pygame.MOUSEMOTION:
            if self._button_held or self.editor.gesture is not None:
                self.editor.move(point, view, control=control)
            else:
                self.editor.hover(point, view)
        return False

    def _type(self, text: str) -> bool:
        gesture = self.editor.gesture
        if gesture is not None and text and all(letter in TYPED for letter in text):
            self.editor.type_text((gesture.typed + text).lstrip())
        return True

    def run(self, command: Command) -> None:
        """Run a command of the window, some of which cover the scene and receive the release of the button."""
        gesture = self.editor.gesture
        if command is Command.PICKER or (
            command is Command.HELP and not (gesture is not None and gesture.is_multi_click)
        ):
            self.drop_gesture()
        self._run_command(command)

    def _use_action(self, name: str) -> None:
        actions: dict[str, Callable[[], object]] = {
            "play": self.leave,
            "undo": self.editor.undo,
            "redo": self.editor.redo,
            "save": self.save,
        }
        actions[name]()

    # --- Files ---------------------------------------------------------------------------------------------------

    def save(self, is_new: bool = False) -> None:
        """Save the draft to its file; ask for one if it has none or another is wanted."""
        path = self.draft.path
        if path is None or is_new:
            self.prompt = PathPrompt(path or Path.cwd() / "scene.toml")
            return
        if self.draft.is_file_changed():
            self.prompt = PathPrompt(path)
            self.prompt.note = f"{path.name} was changed by another program; save it under another name, or replace it"
            return
        self._write(path)

    def _prompt(self, prompt: PathPrompt, event: pygame.event.Event) -> None:
        path = prompt.handle_event(event)
        if prompt.is_closed or (path is not None and self._write(path)):
            self.prompt = None

    def _write(self, path: Path) -> bool:
        """Write the draft to a file; return whether that succeeded."""
        try:
            self.draft.save(path)
        except SceneError as error:
            message = error.faults[0].message
            if self.prompt is not None:
                self.prompt.note = message
            self._context.app_state.messages.add(f"{path.name}: {message}", "error")
            return False
        self._context.notify(f"saved: {path}")
        self.note_unsaved()
        return True

    def note_unsaved(self) -> None:
        """Note whether the scene has unsaved changes, for the window."""
        self._context.app_state.has_unsaved_draft = self.draft.is_changed

    # --- Autosave ------------------------------------------------------------------------------------------------

    def update(self) -> None:
        """Write unsaved changes to the autosave; called every frame, also while the scene runs."""
        self.note_unsaved()
        message = self.autosave.update(monotonic())
        if message is not None:
            self._context.app_state.messages.add(message, "warning")

    def close(self, is_lost: bool) -> None:
        """End the editing of the scene.

        Args:
            is_lost: whether the user has confirmed that unsaved changes are lost; otherwise they are offered again.
        """
        self.live_check.close()
        self._ghost.close()
        if is_lost:
            self.autosave.discard()
            return
        if self.draft.is_changed:
            self._context.app_state.messages.add("unsaved changes are kept, and offered when the scene is edited again")
        self.autosave.release()

    def _answer_recovery(self, recovered: RecoveredText, event: pygame.event.Event) -> None:
        """Restore the unsaved changes of a former editor, or discard them."""
        if event.type != pygame.KEYDOWN:
            return
        if event.key == pygame.K_ESCAPE:
            recovered.discard()
            self.recovered = recoverable(self.draft.path, self._folder)
        elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
            self.recovered = None
            try:
                self.draft.replace_text(recovered.text, "restore unsaved changes")
            except SceneError as error:
                text = f"the changes are no valid scene, and stay in {recovered.autosave.name}: {error.faults[0]}"
                self._context.app_state.messages.add(text, "error")
                return
            self.autosave.adopt(recovered)

    def _recovery_question(self, recovered: RecoveredText) -> str:
        name = "a new scene" if self.draft.path is None else self.draft.path.name
        written = datetime.fromtimestamp(recovered.written_at)
        when = f"{written:%H:%M}" if written.date() == date.today() else f"{written:%d %B, %H:%M}"
        changed = f" ({name} has changed since)" if recovered.is_file_changed else ""
        return f"unsaved changes of {name} from {when} were found{changed}: Enter restores them, Esc discards them"

    # --- Properties ----------------------------------------------------------------------------------------------

    def _set_property(self, section: str, field: str, value: Any) -> str | None:
        kind, _, which = section.partition(":")
        if kind == "selection":
            found = self.editor.set_property([key for key in self.editor.selection if key.table == which], field, value)
        else:
            found = self.editor.set_value(location_of(section), field, value)
        self.note_unsaved()
        return found

    def _remove_section(self, section: str) -> None:
        self.editor.remove_table(location_of(section))
        self.note_unsaved()

    def _add_section(self, section: str) -> None:
        self.editor.add_material() if section == "material" else self.editor.add_pair()
        self.note_unsaved()

    # --- Drawing -------------------------------------------------------------------------------------------------

    def cursor(self) -> int:
        """Return the system cursor that shows what a press would do: `pygame.SYSTEM_CURSOR_…`."""
        position, editor = pygame.mouse.get_pos(), self.editor
        is_on_scene = self._context.gui.area.collidepoint(position) and self.prompt is None
        bars = self.toolbar.rect.collidepoint(position) or self.actions.rect.collidepoint(position)
        if not is_on_scene or bars or self.recovered is not None:
            return pygame.SYSTEM_CURSOR_ARROW
        if editor.is_locked:
            return pygame.SYSTEM_CURSOR_NO
        if editor.tool != "select":
            return pygame.SYSTEM_CURSOR_CROSSHAIR
        handle = editor.handle_at(self._context.camera.to_world(position), self.view_scale)
        if handle is not None:
            return HANDLE_CURSORS.get((handle.kind, handle.index % 2), pygame.SYSTEM_CURSOR_HAND)
        return pygame.SYSTEM_CURSOR_SIZEALL if editor.hovered is not None else pygame.SYSTEM_CURSOR_ARROW

    def _update_cursor(self) -> None:
        wanted = self.cursor()
        if wanted != self._cursor:
            self._cursor = wanted
            with suppress(pygame.error):  # a driver without system cursors
                pygame.mouse.set_cursor(wanted)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the scene, the overlay of the editor, its toolbar and the property panel."""
        context, gui, editor = self._context, self._context.gui, self.editor
        self._update_cursor()
        scene = editor.scene
        overlays = frozenset(gui.overlays | {"shapes", "joints"}) - {"trails", "energy", "contacts", "impulses"}
        # While bodies without paths are dragged, only the frame differs: the renderer need not prepare the scene again.
        is_prepared = differ_in_poses_only(scene, self.draft.scene) and not scene.bodies.paths
        drawn = self.draft.scene if is_prepared else scene
        snapshot = Snapshot(drawn, drawn.bodies, start_frame(scene), overlays=frozenset(overlays))
        self._renderer.draw(surface, context.camera, snapshot, antialias=gui.antialias, ui_scale=gui.ui_scale)
        self._draw_ghost(surface, scene)
        draw_overlay(Canvas(surface, context.camera, gui.ui_scale), editor, self.view_scale)
        area = gui.area
        self.toolbar.layout(area, gui.ui_scale)
        self._draw_check(surface, scene, area)
        self.toolbar.draw(surface, editor.tool, gui.ui_scale)
        self._draw_status(surface, area)
        if gui.panel.visible:
            self._show_panel(surface.get_size())
            self.panel.draw(surface)
        messages = context.app_state.messages.visible()
        free = area.inflate(-round(24 * gui.ui_scale), -round(24 * gui.ui_scale))
        free.left = self.toolbar.rect.right + round(10 * gui.ui_scale)
        draw_messages(surface, messages, free, self.check_marks.plates, 13.0 * gui.ui_scale)
        self.toolbar.draw_hint(surface, gui.ui_scale)
        labels = {"undo": self.draft.undo_label, "redo": self.draft.redo_label}
        self.actions.notes = {name: f"{name}: {label or 'nothing'}" for name, label in labels.items()}
        self.actions.draw_hint(surface, gui.ui_scale)
        if self.prompt is not None:
            self.prompt.draw(surface, gui.ui_scale)
        if self.recovered is not None:
            narrow = area.inflate(-max(area.width - round(640 * gui.ui_scale), 0), 0)
            draw_notice(surface, self._recovery_question(self.recovered), narrow, 16 * gui.ui_scale, ORANGE)

    def _draw_check(self, surface: pygame.Surface, scene: Scene, area: pygame.Rect) -> None:
        """Check the draft, and draw the result right of the toolbar and below the plate of the file."""
        ui_scale = self._context.gui.ui_scale
        self.live_check.submit(self.draft.scene)
        free = area.inflate(-round(24 * ui_scale), -round(24 * ui_scale))
        top = free.top + round(54 * ui_scale)
        free = pygame.Rect(self.toolbar.rect.right + round(10 * ui_scale), top, 0, free.bottom - top)
        free.width = max(area.right - round(12 * ui_scale) - free.left, 0)
        self.check_marks.draw(surface, self._context.camera, scene, self.live_check.result, free, ui_scale)

    def _draw_ghost(self, surface: pygame.Surface, scene: Scene) -> None:
        """Draw where the selected body will be in the next seconds."""
        body = None if self.editor.is_locked else self.editor.single_body
        self._ghost.submit(scene, body)
        if self._ghost.path is not None:
            draw_ghost_path(Canvas(surface, self._context.camera, self._context.gui.ui_scale), self._ghost.path)
        if self._ghost.fault is not None:
            self._context.app_state.messages.add(self._ghost.fault, "warning")
            self._ghost.fault = None

    def _show_panel(self, size: tuple[int, int]) -> None:
        """Update the property panel if the selection or the draft has changed."""
        gui, editor = self._context.gui, self.editor
        state = (tuple(editor.selection), self.draft.text, size, gui.ui_scale)
        if state == self._shown:
            return
        self._shown = state
        if (self.panel.width, size) != (gui.panel.width, size):
            self.panel.resize(size, gui.ui_scale)
        note = ""
        if editor.is_locked:
            note = f"[{self.draft.preset}] makes this scene. Ctrl+Shift+X replaces it by its elements, to edit them."
        self.panel.show(property_sections(self.draft, editor.selection), note)
        self.note_unsaved()

    def _draw_status(self, surface: pygame.Surface, area: pygame.Rect) -> None:
        """Draw the plate with the file, its state and the buttons of actions."""
        ui_scale = self._context.gui.ui_scale
        size, pad = 13.0 * ui_scale, round(6 * ui_scale)
        path = self.draft.path
        name = ("new scene" if path is None else path.name) + (" ●" if self.draft.is_changed else "")
        ghost = self._ghost.path
        detail = f"grid {self.view_scale.grid:g} m" + ("" if ghost is None else f" · path: {ghost.engine}")
        left, top = self.toolbar.rect.right + pad, self.toolbar.rect.top
        self.actions.layout_row((left, top), ui_scale)
        x = self.actions.rect.right + pad
        badge = text_size("EDIT", size, bold=True)[0]
        room = area.right - x - badge - 5 * pad
        if room < 5 * size:
            self.actions.draw(surface, "", ui_scale)
            return
        name, detail = ellipsis(name, size, room, True), ellipsis(detail, 0.85 * size, room, mono=True)
        wide = max(text_size(name, size, bold=True)[0], text_size(detail, 0.85 * size, mono=True)[0])
        rect = pygame.Rect(x, top, wide + badge + 4 * pad, self.actions.rect.height)
        draw_box(surface, rect, 7 * ui_scale)
        draw_text(surface, "EDIT", (x + pad, rect.centery), size, ORANGE, "midleft", bold=True)
        draw_text(surface, name, (x + badge + 3 * pad, rect.top + 0.32 * rect.height), size, INK, "midleft", bold=True)
        at = x + badge + 3 * pad, rect.top + 0.74 * rect.height
        draw_text(surface, detail, at, 0.85 * size, FAINT, "midleft", mono=True)
        self.actions.draw(surface, "", ui_scale)
