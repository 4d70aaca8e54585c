"""Wishes: what somebody has chosen, which what is on next is to keep."""

from dataclasses import dataclass, field
from typing import Any

from sandbox.action import SetParameter
from sandbox.play.running.company import Company
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import Override, from_document
from sandbox.scene.scene import Scene


@dataclass
class Wishes:
    """What is chosen for every scene, and what was turned of the present one."""

    engine: str | None
    """what plays may be another"""
    overrides: tuple[Override, ...]
    """values set in every scene that is opened"""
    ghosted: bool = False
    trusting: bool | None = None
    """None: nobody has said"""
    turned: dict[str, Any] = field(default_factory=dict)
    """values of the present scene by path, for a restart to keep"""

    def begin(self, company: Company, trusting: bool) -> None:
        """Show beside a session what is wished; a twin, where nobody has said, as told."""
        company.show_trust(trusting if self.trusting is None else self.trusting)
        if self.ghosted and not company.ghosted:
            company.show_ghost(True)

    def toggle_ghost(self, company: Company) -> None:
        """Begin a ghost from here, or end it; from now on that is wished."""
        self.ghosted = not company.ghosted
        company.show_ghost(self.ghosted)

    def toggle_trust(self, company: Company) -> None:
        """Begin to watch a twin from here, or end it; from now on that is wished."""
        self.trusting = company.trust is None
        company.show_trust(self.trusting)

    def turn(self, action: SetParameter) -> None:
        """Keep a value for a restart."""
        self.turned.pop(action.path, None)  # what is turned last is set last
        self.turned[action.path] = action.value

    def as_turned(self, file: Scene) -> Scene:
        """Return the scene as its file has it, with what was turned.

        Raises:
            SceneError: what was turned does not go together.
        """
        return from_document(to_document(file), "<scene>", self.turned.items())
