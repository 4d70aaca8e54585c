"""Compare `pymunk6_names` with pymunk 6 itself, and write the cases of the tests.

    pip install --no-deps --target FOLDER pymunk==6.11.1
    python -m tools.oracles.pymunk6 FOLDER [--games 300] [--write]

A game of a seed has discs, boxes, sensors and a kinematic body of four collision types in a box, and random handlers:
for pairs of types, wildcards, default, each with some of the four phases. Their callbacks note the shapes and the
normal that they see, and answer True, False, nothing or with an exception. The game removes and adds bodies, also in
callbacks. It runs in a process with pymunk 6, and here with the names of pymunk 6. All notes and states have to be
equal, bit for bit, in the same order; only the calls of `separate` within a step have none, as it follows addresses.
"""

import argparse
import gc
import hashlib
import json
import os
import random
import subprocess
import sys
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import pymunk

CASES = Path(__file__).resolve().parents[2] / "tests" / "pymunk_capture" / "cases" / "pymunk6.json"
STEPS = 60
STORED_GAMES = 12
PHASES = ("begin", "pre_solve", "post_solve", "separate")

Note = list[Any]
"""Step, phase, handler, and the ids of the shapes; after the steps the states of the bodies"""


class Game:
    """A game for pymunk 6, whose callbacks note what they see."""

    def __init__(self, seed: int) -> None:
        self.seed, self.rng = seed, random.Random(seed)
        self.notes: list[Note] = []
        self.step = 0
        self.is_over = False
        self.space: Any = pymunk.Space()
        self.space.gravity = (0, -300)
        self.ids: dict[Any, int] = {}
        corners = [(-80, 0), (80, 0), (80, 160), (-80, 160)]
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            self.add(pymunk.Segment(self.space.static_body, a, b, 3))
        self.slider = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self.slider.position, self.slider.velocity = (0, 40), (30, 0)
        self.space.add(self.slider)
        self.add(pymunk.Poly.create_box(self.slider, (40, 6)))
        for _ in range(14):
            self.add_body()
        self.add_handlers()

    def add(self, shape: Any) -> None:
        """Add a shape with random properties."""
        shape.elasticity, shape.friction = self.rng.random(), self.rng.random()
        shape.collision_type = self.rng.randrange(4)
        shape.sensor = self.rng.random() < 0.15
        self.ids[shape] = len(self.ids)
        self.space.add(shape)

    def add_body(self) -> None:
        """Add a disc or a box at a random position."""
        body = pymunk.Body(1, 60)
        body.position = self.rng.uniform(-60, 60), self.rng.uniform(20, 140)
        body.velocity = self.rng.uniform(-80, 80), self.rng.uniform(-80, 80)
        self.space.add(body)
        is_disc = self.rng.random() < 0.6
        self.add(pymunk.Circle(body, 9) if is_disc else pymunk.Poly.create_box(body, (16, 12)))

    def add_handlers(self) -> None:
        """Add handlers of all kinds, of which each sets some phases."""
        pairs = [(self.rng.randrange(4), self.rng.randrange(4)) for _ in range(self.rng.randrange(4))]
        found = {f"pair {pair}": self.space.add_collision_handler(*pair) for pair in pairs}
        for kind in self.rng.sample(range(4), self.rng.randrange(4)):
            found[f"wildcard {kind}"] = self.space.add_wildcard_collision_handler(kind)
        if self.rng.random() < 0.4:
            found["default"] = self.space.add_default_collision_handler()
        for name, handler in found.items():
            handler.data["calls"] = 0
            for phase in PHASES:
                if self.rng.random() < 0.6:
                    setattr(handler, phase, self.callback(name, phase))

    def callback(self, name: str, phase: str) -> Any:
        """Return a callback that notes its calls."""
        odds = self.rng.choice([(1, 0, 0, 0, 0), (6, 3, 1, 1, 1), (0, 1, 0, 0, 0)])

        def called(arbiter: Any, space: Any, data: dict[str, int]) -> Any:
            if self.is_over:  # the space is deleted
                return True
            data["calls"] += 1
            a, b = arbiter.shapes
            normal = [value.hex() for value in arbiter.normal]
            is_first = arbiter.is_first_contact
            note = [self.step, phase, name, self.ids[a], self.ids[b], is_first, *normal]
            self.notes.append(note)
            draw = random.Random(repr((self.seed, note[:5])))  # callbacks of a phase may come in another order
            (answer,) = draw.choices([True, False, None, "error", "remove"], odds)
            if answer == "remove" and phase == "separate":  # which a removal itself calls
                return None
            if answer == "remove":
                body = a.body if a.body.body_type == pymunk.Body.DYNAMIC else b.body
                if body.body_type == pymunk.Body.DYNAMIC and body.space is not None:
                    space.add_post_step_callback(self.remove, body)
                return True
            if answer == "error":
                raise ValueError("of a callback")
            return answer

        return called

    def remove(self, space: Any, body: Any) -> None:
        """Remove a body and its shapes, after a step."""
        if body in space.bodies:
            space.remove(*body.shapes, body)

    def play(self) -> list[Note]:
        """Run the game, and return its notes and states."""
        for self.step in range(STEPS):
            if self.step % 20 == 7:
                moving = [body for body in self.space.bodies if body.body_type == pymunk.Body.DYNAMIC]
                self.remove(self.space, self.rng.choice(moving))
                self.add_body()
            if abs(self.slider.position.x) > 40:
                self.slider.velocity = -self.slider.velocity
            self.space.step(1 / 60)
            self.note_queries()
            new = sum(note[0] == self.step for note in self.notes)
            self.notes[-new:] = sorted(self.notes[-new:], key=lambda note: repr(note) if note[1] == "separate" else "")
        for body in self.space.bodies:
            self.notes.append([value.hex() for value in (*body.position, *body.velocity, body.angle)])
        self.is_over = True
        return self.notes

    def note_queries(self) -> None:
        """Note what queries find that pymunk 7 changed."""
        everything = pymunk.ShapeFilter()
        near = self.space.point_query_nearest((0, 30), 50, everything)
        # A thick ray of either version may miss the first shape: the tree of shapes is searched as for a thin one.
        ray = self.space.segment_query_first((-70, 20), (70, 60), 0, everything)
        own = self.space.shapes[4].segment_query((-70, 20), (70, 60))
        found = [near and self.ids[near.shape], ray and self.ids[ray.shape], own.shape is None, own.alpha.hex()]
        self.notes.append([self.step, "queries", *found, bool(pymunk.Vec2d(0, 0))])


def play(seed: int) -> list[Note]:
    """Play the game of a seed; its warnings and the exceptions of its callbacks are not printed."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return Game(seed).play()
    finally:
        sys.unraisablehook = hook


def case_of(seed: int, notes: list[Note]) -> dict[str, Any]:
    """Return the stored figures of a game: its calls by phase, and the digest of their sequence, without normals."""
    calls = [note[:6] for note in notes if len(note) > 1 and note[1] in PHASES]
    digest = hashlib.sha256(json.dumps(calls).encode()).hexdigest()
    return {"seed": seed, "calls": dict(sorted(Counter(note[1] for note in calls).items())), "sha256": digest}


def main() -> int:
    """Compare games of many seeds; return 1 if one differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", help="where pymunk 6 is installed")
    parser.add_argument("--games", type=int, default=300)
    parser.add_argument("--write", action="store_true", help="write the cases of the tests")
    parser.add_argument("--play", action="store_true", help="print the notes; for the process with pymunk 6")
    asked = parser.parse_args()
    if asked.play:
        gc.disable()  # pymunk 6 may crash when its spaces are deleted
        print(json.dumps([pymunk.version, [play(seed) for seed in range(asked.games)]]), flush=True)
        os._exit(0)
    command = [sys.executable, __file__, asked.folder, "--play", "--games", str(asked.games)]
    environment = os.environ | {"PYTHONPATH": asked.folder}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    version, expected = json.loads(done.stdout)
    from sandbox.pymunk_capture.pymunk6 import pymunk6_names

    with pymunk6_names():
        found = [play(seed) for seed in range(asked.games)]
    differing = [seed for seed, (old, new) in enumerate(zip(expected, found, strict=True)) if old != new]
    calls = Counter(note[1] for notes in expected for note in notes if len(note) > 1 and note[1] in PHASES)
    print(f"{asked.games} games, pymunk {version} and {pymunk.version}: {len(differing)} differ {differing[:10]}")
    print(f"calls: {dict(calls)}")
    for seed in differing[:1]:
        pairs = zip(expected[seed], found[seed], strict=False)
        print(seed, next(((old, new) for old, new in pairs if old != new), "lengths"))
    if asked.write and not differing:
        CASES.parent.mkdir(exist_ok=True)
        cases = [case_of(seed, expected[seed]) for seed in range(STORED_GAMES)]
        CASES.write_text(json.dumps({"pymunk": version, "games": cases}, indent=1) + "\n")
    return bool(differing)


if __name__ == "__main__":
    sys.exit(main())
