"""Bodies of other shapes than discs: filling, edges, and agreement of the compiled and the pygame renderer."""

import math
import sys

import numpy as np
import pygame
import pytest

from sandbox.engines.common import kernel
from sandbox.scene.compile.scene import Scene
from sandbox.window.render import kernels
from sandbox.window.render import polygons as module
from sandbox.window.render.circles import CircleStyle, darken
from sandbox.window.render.palette import ACCENTS, NEUTRAL, YELLOW
from sandbox.window.render.polygons import PolygonRenderer
from tests.window.render.drawn import CAMERA, ball, changed_pixels, colour_at, frame, render, scene, snapshot

STAR = [
    [math.cos(k * math.pi / 5) * (1.0 if k % 2 else 2.5), math.sin(k * math.pi / 5) * (1.0 if k % 2 else 2.5)]
    for k in range(10)
]
HAMMER = {"position": [0, 0], "box": [{"size": [4.0, 0.5]}, {"size": [1.0, 2.0], "position": [2.0, 0.0]}]}
ABUTTING = {"position": [0, 0], "box": [{"size": [2, 2], "position": [-1, 0]}, {"size": [2, 2], "position": [1, 0]}]}
FLUSH = {"position": [0, 0], "box": [{"size": [3, 2], "position": [-1, 0]}, {"size": [3, 2], "position": [1, 0]}]}
BONE = {
    "position": [0, 0],
    "ball": [{"radius": 1.0, "position": [-2, 0]}, {"radius": 1.0, "position": [2, 0]}],
    "capsule": [{"length": 4.0, "radius": 0.5}],
}
SHAPES = {
    "box": {"box": [{"position": [0, 0], "size": [4, 2], "angle": 0.4}]},
    "triangle": {"polygon": [{"position": [0, 0], "points": [[-2, -1], [2, -1], [0, 2]]}]},
    "capsule": {"capsule": [{"position": [0, 0], "length": 3, "radius": 1, "angle": -0.7}]},
    "star": {"polygon": [{"position": [0, 0], "points": STAR, "angle": 0.1}]},
    "hammer": {"body": [HAMMER | {"angle": 2.0}]},
    "abutting": {"body": [ABUTTING | {"angle": 0.3}]},
    "bone": {"body": [BONE | {"angle": 0.9}]},
}
AREAS = {
    "box": 8.0,
    "triangle": 6.0,
    "capsule": 6.0 + math.pi,
    "star": 10 * 0.5 * 2.5 * 1.0 * math.sin(math.pi / 5),
    "hammer": 2.0 + 2.0 - 0.25,
    "abutting": 8.0,
}
assert kernels.rasterise_polygons, "imported before a test patches COMPILED"


def coverage(
    model: Scene, *, few: int, antialias: bool = True, hollow: bool = False, scale: float = 20.0
) -> np.ndarray:
    """Return the coverage of each pixel by a body, drawn white on black without a rim."""
    surface, bodies = pygame.Surface((240, 240), 0, 32), model.bodies
    indices = np.arange(len(bodies))
    style = CircleStyle(2.0 if hollow else 0.0, hollow, antialias)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "FEW_POLYGONS", few)
        patch.setattr(kernel, "COMPILED", True)  # without numba the same pass runs as plain Python
        if few:
            patch.setattr(module, "_in_one_pass", lambda *_: False)
        tint = np.full((len(indices), 3), 255, np.uint8)
        PolygonRenderer().draw(
            surface, bodies, indices, np.full((len(indices), 2), 120.3), bodies.angle, scale, tint, style
        )
    return pygame.surfarray.array3d(surface)[..., 0] / 255.0


@pytest.mark.parametrize("shape", AREAS)
def test_drawn_area_equals_the_area_of_the_shape(shape):
    area = coverage(scene(**SHAPES[shape]), few=0).sum()
    assert area == pytest.approx(AREAS[shape] * 400, rel=0.012)  # 8 bits a pixel


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("antialias", [True, False])
def test_compiled_and_pygame_filling_differ_only_at_edges(shape, antialias):
    one, other = (coverage(scene(**SHAPES[shape]), few=few, antialias=antialias) for few in (0, 100))
    for a, b in ((one, other), (other, one)):
        near = np.stack([np.roll(a, (x, y), (0, 1)) for x in (-1, 0, 1) for y in (-1, 0, 1)])
        assert (b[near.min(axis=0) == 1.0] > 0.8).all()
        assert (b[near.max(axis=0) == 0.0] < 0.2).all()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("antialias", [True, False])
def test_compiled_and_pygame_rims_of_hollow_bodies_agree(shape, antialias):
    one, other = (coverage(scene(**SHAPES[shape]), few=few, antialias=antialias, hollow=True) for few in (0, 100))
    differ = np.abs(one - other)
    if antialias:
        assert differ.max() < 0.02  # a colour is rounded once or twice
    else:
        assert (differ > 0.02).sum() <= 4  # the centre of a pixel may be on the edge within rounding


@pytest.mark.parametrize(("boxes", "is_compiled"), [(1, False), (8, False), (9, True)])
@pytest.mark.parametrize("shown", [1, 9])
def test_rasteriser_depends_on_the_scene_only(boxes: int, is_compiled: bool, shown: int, monkeypatch) -> None:
    calls = []
    monkeypatch.setattr(module, "_in_one_pass", lambda *_: bool(calls.append(True)) or True)
    monkeypatch.setattr(module, "_draw_plain", lambda *_: None)
    monkeypatch.setitem(sys.modules, "numba", object())  # whether anything else has imported it does not matter
    bodies = scene(box=[{"size": [1, 1], "position": [2 * k, 0]} for k in range(boxes)]).bodies
    indices, tint = np.arange(min(shown, boxes)), np.zeros((min(shown, boxes), 3), np.uint8)
    surface, style = pygame.Surface((240, 240), 0, 32), CircleStyle(0.0, False, True)
    centre = np.full((len(indices), 2), 120.0)
    PolygonRenderer().draw(surface, bodies, indices, centre, bodies.angle[indices], 20.0, tint, style)
    assert bool(calls) == is_compiled


@pytest.mark.parametrize("few", [0, 100])
def test_rim_of_a_compound_body_follows_its_outline_and_not_its_seams(few, monkeypatch):
    monkeypatch.setattr(module, "FEW_POLYGONS", few)
    monkeypatch.setattr(kernel, "COMPILED", True)
    if few:
        monkeypatch.setattr(module, "_in_one_pass", lambda *_: False)
    boxes = [
        {"size": [4, 3], "position": [-2, 0]},
        {"size": [4, 3], "position": [2, 0]},
        {"size": [4, 3], "position": [1, 3]},  # like a brick on the two others
    ]
    picture = render(snapshot(scene(body=[{"position": [0, 0], "box": boxes}])))
    for seam in ((0.0, 0.0), (0.0, -1.2), (0.0, 1.5), (1.0, 1.5), (2.5, 1.5)):
        assert colour_at(picture, *seam) == ACCENTS[0]
    for edge in ((-2.0, 1.46), (3.5, 1.46), (0.0, -1.46), (-0.96, 3.0)):
        assert colour_at(picture, *edge) == pytest.approx(darken(ACCENTS[0]), abs=2)  # rounded twice
    for outside in ((-2.0, 1.58), (0.0, -1.58), (-1.08, 3.0)):
        assert colour_at(picture, *outside) == colour_at(render(snapshot(scene(world={}))), *outside)


@pytest.mark.parametrize("antialias", [True, False])
def test_many_boxes_without_numba_are_drawn_at_their_positions(antialias, monkeypatch):
    monkeypatch.setattr(module, "_in_one_pass", lambda *_: False)
    rows = [{"position": [x, y], "size": [0.8, 0.4], "angle": 0.5} for x in (-4, -2, 0, 2, 4) for y in (-1, 0.5, 2)]
    picture = render(snapshot(scene(box=rows)), antialias=antialias)
    for k, row in enumerate(rows):
        assert colour_at(picture, *row["position"]) == ACCENTS[k % len(ACCENTS)]
    assert not changed_pixels(picture, render(snapshot(scene(world={})), antialias=antialias))[115:125].any(), (
        "between them"
    )


@pytest.mark.parametrize("few", [0, 100])
@pytest.mark.parametrize(("body", "inside"), [(ABUTTING, (0.0, 0.5)), (HAMMER, (1.5, 0.0)), (FLUSH, (0.5, 0.3))])
def test_compound_body_has_outer_edges_and_no_inner_ones(body, inside, few):
    model = scene(body=[body])
    assert (coverage(model, few=few)[100:140, 118:122] == 1.0).all()
    hollow = coverage(model, few=few, hollow=True)
    x, y = (np.asarray(inside) - model.bodies.position[0]) * (20, -20) + 120.3
    assert hollow[round(x) - 3 : round(x) + 3, round(y) - 2 : round(y) + 2].max() == 0.0
    if body is FLUSH:  # 5 m, 100 px; a line 2 px wide nearly covers one pixel of each row
        assert hollow[75:165].max(axis=1).min() > 0.9


def test_polygon_has_its_colour_and_a_darker_rim_and_is_neutral_if_fixed():
    box = {"position": [0, 0], "size": [4, 3]}
    picture = render(snapshot(scene(box=[box])))
    assert colour_at(picture, 0.0, 0.0) == ACCENTS[0]
    assert colour_at(picture, 0.0, 1.46) == darken(ACCENTS[0])
    assert colour_at(picture, 0.0, 1.6) != darken(ACCENTS[0])
    assert colour_at(render(snapshot(scene(box=[box | {"fixed": True}]))), 0.0, 0.0) == NEUTRAL


def test_box_rotates_counterclockwise_with_y_up():
    model = scene(box=[{"position": [0, 0], "size": [6, 0.6]}])
    turned = render(snapshot(model, frame=frame(model, angle=np.asarray([math.pi / 4]))))
    assert colour_at(turned, 1.5, 1.5) == ACCENTS[0]
    assert colour_at(turned, 1.5, -1.5) != ACCENTS[0]


def test_only_nearly_round_polygons_have_a_spoke():
    corners = [[math.cos(k * math.pi / 8), math.sin(k * math.pi / 8)] for k in range(16)]
    plane = [{"point": [0, -3], "normal": [0, 1]}]
    for points, has in ((corners, True), (corners[::4], False)):
        model = scene(polygon=[{"position": [0, 0], "points": points}], plane=plane)
        assert (colour_at(render(snapshot(model)), 0.6, 0.0) != ACCENTS[0]) is has


@pytest.mark.parametrize("size", [1e3, 1e6, 1e9])
def test_box_of_any_size_ends_at_its_edge(size):
    picture = render(snapshot(scene(box=[{"position": [-size / 2, 0], "size": [size, size]}])))
    assert colour_at(picture, -2.0, 0.0) == ACCENTS[0]
    assert colour_at(picture, 0.2, 0.0) != ACCENTS[0]


def test_bodies_with_nan_are_omitted():
    model = scene(box=[{"position": [0, 0], "size": [1, 1]}, {"position": [2, 0], "size": [1, 1]}])
    broken = frame(model, position=np.asarray([[math.nan, 0.0], [2.0, 0.0]]), angle=np.asarray([0.0, math.nan]))
    assert colour_at(render(snapshot(model, frame=broken)), 2.0, 0.0) == ACCENTS[1]


def test_discs_are_drawn_equally_with_and_without_boxes():
    alone = render(snapshot(scene(balls=[ball(-3, 0), ball(-1, 1.5, 0.4, angle=1.0)])))
    both = scene(balls=[ball(-3, 0), ball(-1, 1.5, 0.4, angle=1.0)], box=[{"position": [3, 0], "size": [2, 2]}])
    assert not changed_pixels(alone, render(snapshot(both)))[:110].any()


def test_ghost_of_a_box_is_hollow():
    model = scene(box=[{"position": [-2, 0], "size": [2, 2]}])
    ghost = frame(model, position=np.asarray([[3.0, 0.0]]))
    differ = changed_pixels(render(snapshot(model)), render(snapshot(model, ghost=ghost)))
    column = int(CAMERA.to_screen(np.asarray((3.95, 0.0)))[0])
    assert differ[column, 55:65].all()
    assert not differ[165:170, 50:70].any()


def test_picked_box_has_a_line_around_its_outline():
    model = scene(box=[{"position": [0, 0], "size": [6, 1]}])
    picture = render(snapshot(model, picked=0))
    assert tuple(picture[100, 60 - 10 - 3]) == YELLOW
    assert not changed_pixels(render(snapshot(model)), picture)[95:105, 10:40].any()
