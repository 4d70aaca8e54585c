"""Variant: one engine with one choice of settings, and the variants that are one choice away."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, get_args

from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.measure.recorder import frame_count
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.scene.part import MAX_STEPS
from sandbox.scene.settings import Detection, Integrator, Joints, Response, Settings

MOST_SUBSTEPS, MOST_ITERATIONS = 512, 1000
FEWEST_STEPS = 4
"""A run of fewer says nothing."""
FINEST, COARSEST = Fraction(256), Fraction(1, 16)
"""How many frames are made of one of the scene's own."""

WORDS: dict[str, tuple[Any, ...]] = {
    "integrator": get_args(Integrator),
    "detection": get_args(Detection),
    "joints": get_args(Joints),
    "response": get_args(Response),
    "half_kick": (False, True),
}
"""The choices between ways of doing things. Broad phases are none: all give the same answer."""


@dataclass(frozen=True)
class Variant:
    """Settings as they differ from a scene's own."""

    engine: str
    finer: Fraction = Fraction(1)
    """steps in one of the scene's"""
    substeps: int = 1
    iterations: int = 10
    words: tuple[tuple[str, Any], ...] = ()

    @classmethod
    def of(cls, engine: str, settings: Settings) -> "Variant":
        """Return the settings themselves."""
        return cls(engine, Fraction(1), settings.substeps, settings.iterations)

    @property
    def work(self) -> float:
        """About what a run costs beside others of the same words: substeps, of more iterations a little more."""
        return float(self.finer) * self.substeps * (1.0 + self.iterations / 20.0)

    def settings(self, base: Settings) -> Settings:
        """Return the settings in full; frames are kept at the same times, or where those are too close, at fewer.

        Raises:
            pydantic.ValidationError: dt leaves its bounds.
        """
        every = Fraction(base.record_every) * self.finer
        return base.replace(
            dt=float(Fraction(base.dt) / self.finer),
            record_every=int(every) if every.denominator == 1 else 1,
            substeps=self.substeps,
            iterations=self.iterations,
            **dict(self.words),
        )

    def with_word(self, key: str, value: Any) -> "Variant":
        """Return the variant with another way of doing one thing."""
        kept = [(k, v) for k, v in self.words if k != key]
        return replace(self, words=tuple(sorted([*kept, (key, value)])))


@dataclass(frozen=True, eq=False)
class Space:
    """All variants that a scene can be run with."""

    scene: Scene
    base: Settings
    engines: tuple[str, ...]

    def starts(self) -> list[Variant]:
        """Return each engine with the scene's own settings; what only some engines take is left out for the others."""
        return [Variant.of(name, self.own(name)) for name in self.engines]

    def own(self, engine: str) -> Settings:
        """Return the settings that an engine's variants differ from: the scene's, or of these what all engines take."""
        return self.base if not ENGINES[engine].missing(self.scene, self.base) else self.base.common()

    def settings(self, variant: Variant) -> Settings:
        """Return a variant's settings in full, choices that are left to the engine still open."""
        return variant.settings(self.own(variant.engine))

    def sound(self, variant: Variant) -> bool:
        """Tell whether a variant can be run at all."""
        if not (COARSEST <= variant.finer <= FINEST and 1 <= variant.substeps <= MOST_SUBSTEPS):
            return False
        if not 1 <= variant.iterations <= MOST_ITERATIONS:
            return False
        try:
            settings = self.settings(variant)
        except ValidationError:
            return False
        steps = self.scene.world.duration / settings.dt
        if not FEWEST_STEPS <= steps <= MAX_STEPS / variant.substeps:
            return False
        return not ENGINES[variant.engine].missing(self.scene, settings)

    def near(self, variant: Variant) -> Iterator[Variant]:
        """Yield the sound variants that are one choice away, each choice up and down."""
        if variant.engine == "exact":  # for whom dt is but the time between two frames
            yield from filter(self.sound, [replace(variant, finer=variant.finer / 2)])
        else:
            yield from filter(self.sound, self._steps(variant))
        yield from filter(self.sound, self._ways(variant))

    def _steps(self, variant: Variant) -> Iterator[Variant]:
        own = self.own(variant.engine)
        if variant.substeps == own.substeps:  # more substeps do the same for less
            yield replace(variant, finer=variant.finer / 2)
            if variant.finer < 4:
                yield replace(variant, finer=variant.finer * 2)
        if variant.finer <= 1:
            yield replace(variant, substeps=variant.substeps * 2)
            if variant.substeps % 2 == 0:
                yield replace(variant, substeps=variant.substeps // 2)
        if self.iterates:
            yield replace(variant, iterations=variant.iterations * 2)
            if variant.iterations > 1:
                yield replace(variant, iterations=variant.iterations // 2)

    def _ways(self, variant: Variant) -> Iterator[Variant]:
        filled = ENGINES[variant.engine].resolve(self.scene, self.settings(variant))
        for key, values in WORDS.items():
            if key == "joints" and not len(self.scene.links):
                continue
            if key in ("detection", "response") and not self.touches:
                continue
            if key == "half_kick" and self.scene.world.gravity == (0.0, 0.0):
                continue
            for value in values:
                if value != getattr(filled, key):
                    yield variant.with_word(key, value)

    @cached_property
    def touches(self) -> bool:
        """Whether anything can meet anything."""
        return bool(meetings(self.scene).touches.any())

    @cached_property
    def iterates(self) -> bool:
        """Whether more passes of the solver can change anything: where contacts or joints hang together."""
        meet = meetings(self.scene)
        return bool(len(self.scene.links)) or (
            self.touches and (meet.mutual or len(self.scene.fixed) > 1 or meet.solids)
        )

    def frames(self, variant: Variant) -> int:
        """Return how many steps a variant's run has."""
        return frame_count(self.scene, self.settings(variant))[0]
