"""Drawing of joints of each kind and of drives, with and without the overlay."""

import math

import numpy as np
import pygame
import pytest

from sandbox.engines.common import kernel
from sandbox.scene.compile.scene import Scene
from sandbox.window.render import kernels
from sandbox.window.render import lines as module
from sandbox.window.render.joints import MAX_ZIGZAG_SPRINGS, SHADES, JointSegments, strain
from sandbox.window.render.lines import draw_thin_lines
from sandbox.window.render.palette import BACKGROUND, ORANGE, SKY
from tests.window.render.drawn import CAMERA, ball, changed_pixels, colour_at, frame, render, scene, snapshot

TWO = [ball(-3, 0, 0.3, name="a", angle=0.1), ball(3, 0, 0.3, name="b", angle=0.1)]
PAIR = {"between": ["a", "b"]}
KINDS = {
    "rod": PAIR | {"kind": "rod"},
    "pivot": PAIR | {"kind": "pivot", "at": [0, 1]},
    "slide": PAIR | {"kind": "slide", "most": 9.0},
    "groove": PAIR | {"kind": "groove", "groove": [[1, 1], [3, 1]]},
    "rotary_limit": PAIR | {"kind": "rotary_limit", "least": -1.0, "most": 1.0},
    "motor": PAIR | {"kind": "motor", "rate": 2.0},
    "gear": PAIR | {"kind": "gear", "ratio": 2.0},
    "spring": PAIR | {"kind": "spring", "stiffness": 1.0},
    "rotary_spring": PAIR | {"kind": "rotary_spring", "stiffness": 1.0},
    "pulley": PAIR | {"kind": "pulley", "wheels": [[-3, 2], [3, 2]]},
    "ratchet": PAIR | {"kind": "ratchet", "ratchet": 0.5},
    "weld": PAIR | {"kind": "weld", "at": [0, 1]},
    "prismatic": PAIR | {"kind": "prismatic", "axis": [1, 0], "travel": [-1, 1], "rate": 1.0},
    "wheel": PAIR | {"kind": "wheel", "axis": [0, 1], "travel": [-1, 1], "stiffness": 1.0},
}
WITHOUT_OVERLAY = {"rod", "slide", "spring", "pulley", "wheel"}


def scene_with(*joints: dict) -> Scene:
    return scene(balls=TWO, joint=list(joints))


def joint_pixels(model: Scene, *overlays: str) -> np.ndarray:
    """Return which pixels change by drawing the joints."""
    return changed_pixels(render(snapshot(scene(balls=TWO))), render(snapshot(model, *overlays)))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_drawn_in_the_overlay_and_lines_also_without_until_they_break(kind):
    model = scene_with(KINDS[kind])
    assert joint_pixels(model).any() == (kind in WITHOUT_OVERLAY)
    for antialias in (True, False):
        pictures = [render(snapshot(model, *shown), antialias=antialias) for shown in ((), ("joints",))]
        assert changed_pixels(*pictures).sum() > 10
    bare = render(snapshot(scene(balls=TWO), "joints"))
    assert not changed_pixels(bare, render(snapshot(model, "joints", broken=[0]))).any()


def test_kinds_of_joints_differ_in_shape():
    marks = [joint_pixels(scene_with(joint), "joints") for joint in KINDS.values()]
    for k, one in enumerate(marks):
        assert all((one != other).sum() > 10 for other in marks[:k])


def test_a_rod_is_a_line_between_its_anchors():
    model = scene_with(PAIR | {"kind": "rod", "anchors": [[0.0, 0.2], [0.0, 0.2]]})
    differ = joint_pixels(model)
    assert differ[60:140, 60 - 4].all()
    assert not differ[60:140, :50].any()
    assert not differ[:30].any()


def test_rod_to_the_world_reaches_its_anchor():
    model = scene_with({"kind": "rod", "between": ["a"], "anchors": [[0, 0], [-3, 2]]})
    differ = joint_pixels(model)
    assert differ[38:43, 20:50].any(axis=0).all()
    assert not differ[70:].any()


def test_joint_of_an_absent_body_is_not_drawn():
    model = scene_with(KINDS["rod"])
    present = np.asarray([True, False])
    picture = render(snapshot(model, "joints", frame=frame(model, present=present)))
    unjoined = scene(balls=TWO)
    assert not changed_pixels(picture, render(snapshot(unjoined, frame=frame(unjoined, present=present)))).any()


@pytest.mark.parametrize("point", [math.nan, math.inf, 1e300])
def test_joint_to_an_invalid_position_is_omitted(point):
    def picture(model: Scene) -> np.ndarray:
        return render(snapshot(model, "joints", frame=frame(model, position=np.asarray([[-3.0, 0.0], [point, 0.0]]))))

    without = picture(scene(balls=TWO))
    for kind, joint in KINDS.items():
        differ = changed_pixels(picture(scene_with(joint)), without)
        # The line to a distant body goes to the right, from a mark of 4 pixels at column 40.
        assert not (differ[:36] if math.isfinite(point) else differ).any(), kind


def test_spring_is_a_zigzag_between_its_ends():
    column, row = np.nonzero(joint_pixels(scene_with(KINDS["spring"])))
    assert column.min() >= 40
    assert column.max() <= 160
    assert row.max() - row.min() > 6, "not a line"


def test_a_spring_narrows_as_it_stretches():
    width = []
    for rest in (10.0, 6.0, 3.0):
        _, row = np.nonzero(joint_pixels(scene_with(KINDS["spring"] | {"rest_length": rest})))
        width.append(row.max() - row.min())
    assert width == sorted(width, reverse=True)
    assert width[0] > width[2]


def test_strain_colours_go_from_blue_over_grey_to_orange():
    model = scene_with(*(KINDS["spring"] | {"rest_length": rest} for rest in (60.0, 6.0, 0.06, 0.0)))
    held = JointSegments(model.joint_arrays, np.tile((0.0, 0.0, 6.0 * CAMERA.scale, 0.0), (4, 1)))
    short, rest, long, none = SHADES[strain(held, CAMERA.scale)].astype(int)
    assert np.abs(short - SKY).max() <= 20  # nine tenths of the range
    assert (rest == SHADES[32]).all()
    assert np.abs(long - ORANGE).max() <= 8  # nearly the whole range
    # Zero rest length is coloured as stretched to twice the length.
    assert (none == SHADES[61]).all() or np.abs(none - ORANGE).max() <= 20


def test_springs_of_a_cloth_are_lines():
    grid = {"corner": [-4.0, 4.0], "columns": 20, "rows": 16, "spacing": [0.4, 0.4], "radius": 0.001}
    model = scene(cloth=[grid | {"name": "rag", "stiffness": 1.0, "mass": 1.0}])
    assert len(model.joint_arrays) > MAX_ZIGZAG_SPRINGS
    picture = render(snapshot(model))
    differ = changed_pixels(picture, render(snapshot(scene(world={}))))
    assert differ[21:170, 68].all(), "a row of it, from its left to its right"
    tone = SHADES[32].astype(int)
    # A line may cover parts of two rows of pixels.
    assert np.abs(picture[50, 66:71].astype(int) - tone).max(axis=1).min() < 60


assert kernels.rasterise_lines, "imported before a test patches COMPILED"


def line_coverage(ends: list, compiled: bool) -> np.ndarray:
    surface = pygame.Surface((200, 120), 0, 32)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel, "COMPILED", True)  # without numba the same pass runs as plain Python
        patch.setattr(module, "MANY_LINES", 0 if compiled else 10**9)
        draw_thin_lines(surface, np.asarray(ends, np.float64), np.full(len(ends), 0xFFFFFF, np.uint32))
    return pygame.surfarray.array3d(surface)[..., 0] / 255.0


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("ends", [(10, 20, 110, 20), (10, 20, 90, 80), (90, 110, 60, 10), (150, 90, 20, 85)])
def test_coverage_of_a_thin_line_is_its_longer_extent(ends, compiled):
    ink = line_coverage([ends], compiled).sum()
    extent = max(abs(ends[2] - ends[0]), abs(ends[3] - ends[1]))
    assert ink == pytest.approx(extent, abs=2.5)  # whole pixels at its ends


@pytest.mark.parametrize("compiled", [True, False])
def test_thin_lines_are_clipped_to_the_picture(compiled):
    far = line_coverage([(-1e9, 60.0, 1e9, 60.0), (100.0, -1e7, 100.0, 1e7)], compiled)
    assert (far[:, 58:62].sum(axis=1) > 0.9).all()  # eight bits a pixel
    assert (far[98:102].sum(axis=0) > 0.9).all()  # the same
    none = [(math.nan, 0, 9, 9), (0, 0, math.inf, 3), (-50, -50, -3, 400), (0, 500, 200, 500), (1e300, 1, -1e300, 2)]
    assert line_coverage([*none[:4]], compiled).sum() == 0.0
    line_coverage(none, compiled)


BAR = {"name": "bar", "position": [1.0, 0.0], "size": [2.0, 1.0]}
TORQUE = {"kind": "torque", "body": "bar", "pivot": [0.0, 0.0], "stops": [0.0, 1.0], "torque": 1.0}
PLUNGER = {"kind": "plunger", "body": "bar", "direction": [0.0, 1.0], "travel": 2.0, "speed": 1.0}


def differing_points(differ):
    """Return the positions of pixels that differ, m, (N, 2)."""
    columns, rows = np.nonzero(differ)
    return np.column_stack(((columns + 0.5) / 20.0 - 5.0, 3.0 - (rows + 0.5) / 20.0))


def overlay_points(model):
    """Return the positions of the pixels that the overlay of joints changes, m, (N, 2)."""
    return differing_points(changed_pixels(render(snapshot(model)), render(snapshot(model, "joints"))))


def test_hinge_is_drawn_as_a_pin_at_the_pivot():
    bare, driven = (render(snapshot(scene(box=[BAR], **more))) for more in ({}, {"drive": [TORQUE]}))
    found = differing_points(changed_pixels(bare, driven))
    assert np.hypot(*found.mean(axis=0)) < 0.05  # m, a pixel
    assert np.hypot(*found.T).max() < 6.0 / 20.0  # radius of 4 px, and antialiased edges
    assert sum(colour_at(driven, 0.0, 0.0)) > sum(BACKGROUND)


def test_stops_are_drawn_as_an_arc_about_the_hinge():
    found = overlay_points(scene(box=[BAR], drive=[TORQUE]))
    angle = np.arctan2(found[:, 1], found[:, 0])
    far = np.hypot(*found.T) > 1.35  # m: beyond the pointer of the bar; the arc has a radius of 1.5 m
    assert -0.1 < angle[far].min() < 0.05
    assert 0.95 < angle[far].max() < 1.1
    assert (np.histogram(angle[far], 8, (0.0, 1.0))[0] > 0).all()


def test_pointer_rotates_with_the_body_and_shows_the_level():
    model = scene(box=[BAR], drive=[TORQUE])
    state = {"angle": np.asarray([0.5]), "position": np.asarray([[math.cos(0.5), math.sin(0.5)]])}
    pictures = [
        render(snapshot(model, "joints", frame=frame(model, **state, drives=np.asarray([[level, 0.0, 0.0]]))))
        for level in (0.0, 1.0)
    ]
    found = differing_points(changed_pixels(*pictures))
    assert np.abs(np.arctan2(found[:, 1], found[:, 0]) - 0.5).max() < 0.2


def test_plunger_is_drawn_as_a_line_of_its_travel_without_a_hinge():
    model = scene(box=[BAR], drive=[PLUNGER])
    assert not changed_pixels(render(snapshot(scene(box=[BAR]))), render(snapshot(model))).any()
    found = overlay_points(model)
    assert np.abs(found[:, 0] - 1.0).max() < 0.5
    assert found[:, 1].max() < 0.2
    assert -2.2 < found[:, 1].min() < -1.95
    assert (np.histogram(found[:, 1], 20, (-2.0, 0.0))[0] > 0).all()  # from end to end


@pytest.mark.parametrize("kind", ["rod", "slide", "spring"])
@pytest.mark.parametrize("at", [(-2.0, 1.0), (1.0, -1.0)])
def test_end_at_the_world_has_a_support(kind: str, at: tuple[float, float]) -> None:
    """The mark is wider than the joint, whose end is then seen at any zoom."""
    held = {key: value for key, value in KINDS[kind].items() if key != "between"}
    anchored = scene_with(held | {"between": ["a"], "anchors": [[0, 0], list(at)]})
    picture, bare = render(snapshot(anchored)), render(snapshot(scene_with()))
    column, row = CAMERA.to_screen(np.asarray(at)).astype(int)
    near = changed_pixels(picture, bare)[column - 14 : column + 15, row + 2 : row + 12]
    assert near.any(axis=1).sum() >= 20
