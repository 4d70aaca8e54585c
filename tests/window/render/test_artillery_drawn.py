"""Drawing of artillery: terrain, craters, falling dirt, tanks, explosions and wind; and play in the window."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.action import Reshape
from sandbox.games.artillery.rules import ArtilleryRules
from sandbox.games.artillery.scene import course_of
from sandbox.games.artillery.view import sky_image, sky_tone
from sandbox.games.artillery.view_state import ArtilleryViewState, ExplosionView, FallingDirt
from sandbox.games.players import NoInput
from sandbox.games.session import HeadlessGame
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.window.app import App
from sandbox.window.camera import Camera
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedRun
from tests.toml_text import toml
from tests.window.pressing import key, key_up
from tests.window.render import drawn
from tests.window.windowed import open_window, run_frame

SIZE = (400, 240)
AIM_TIME = 0.05
"""s"""
CAMERA = Camera((50.0, 20.0), 4.0, SIZE)
"""100 m wide and 60 m high, from −10 m upwards."""


def duel_text(edges: str = "open") -> str:
    return (
        toml("world", gravity=[0.0, -9.81], linear_drag=0.05, duration=5.0, seed=1)
        + toml("terrain", width=100.0, columns=100, base=10.0, height=2.0)
        + toml("artillery", wind=5.0, edges=edges, tracer=True, speed=30.0)
        + toml("artillery.player", name="Red", position=20.0)
        + toml("artillery.player", name="Blue", position=80.0, bot=1.0)
    )


def duel(edges: str = "open") -> Scene:
    return loads(duel_text(edges))


def render(scene: Scene, view_state: ArtilleryViewState | None = None, camera: Camera = CAMERA) -> np.ndarray:
    return drawn.render(drawn.snapshot(scene, game=view_state), camera).astype(int)


def sky() -> np.ndarray:
    return pygame.surfarray.array3d(sky_image(SIZE)).astype(int)


def pixel(x: float, y: float) -> tuple[int, int]:
    across, down = CAMERA.to_screen(np.array([x, y])).tolist()
    return int(across), int(down)


def rules_at_aim(scene: Scene) -> ArtilleryRules:
    rules = ArtilleryRules(scene, scene.bodies)
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": AIM_TIME})})
    run(short, bout=HeadlessGame(rules, NoInput(), "none"))
    assert rules.phase == "aim"
    return rules


def test_terrain_is_drawn_below_its_surface_and_sky_above() -> None:
    picture, above = render(duel()), sky()
    for x in (35.0, 50.0, 65.0):
        assert (picture[pixel(x, 16.0)] == above[pixel(x, 16.0)]).all()
        red, _, blue = picture[pixel(x, 8.5)].tolist()
        assert red > blue  # soil, under a blue sky
        assert picture[pixel(x, 2.0)].sum() < picture[pixel(x, 8.5)].sum()  # darker with depth


def test_crater_shows_the_sky_behind_it() -> None:
    scene = duel()
    heights = [12.0] * 100
    heights[45:55] = [2.0] * 10
    wall = scene.walls[0].model_copy(update={"points": course_of(heights, 100.0)})
    picture = render(scene.model_copy(update={"walls": (wall,)}))
    above = sky()
    assert (picture[pixel(50.0, 6.0)] == above[pixel(50.0, 6.0)]).all()
    assert (picture[pixel(40.0, 6.0)] != above[pixel(40.0, 6.0)]).any()


@pytest.mark.parametrize("edges", ["rubber", "wrap"])
def test_closed_side_edges_are_drawn(edges: str) -> None:
    edge = int(CAMERA.to_screen(np.array([100.0, 0.0]))[0])
    columns = slice(edge - 3, min(edge + 3, SIZE[0]))
    rows = slice(0, 100)  # above the ground
    assert (render(duel(edges))[columns, rows] != render(duel())[columns, rows]).any()


def test_falling_dirt_is_drawn_in_the_air() -> None:
    scene = duel()
    rules = ArtilleryRules(scene, scene.bodies)
    plain = rules.view_state(0.0)
    clod = FallingDirt(left=48.0, right=52.0, bottom=22.0, top=26.0, floor=8.0)
    falling = ArtilleryViewState(plain.guns, plain.size, 0.0, clods=(clod,))
    picture, above = render(scene, falling), sky()
    red, _, blue = picture[pixel(50.0, 23.0)].tolist()
    assert red > blue
    assert (picture[pixel(50.0, 9.0)] == above[pixel(50.0, 9.0)]).all()  # its final position is still empty


def test_tanks_and_explosions_are_drawn_at_their_positions() -> None:
    scene = duel()
    rules = rules_at_aim(scene)
    view_state = rules.view_state(AIM_TIME)
    assert [gun.name for gun in view_state.guns] == ["Red", "Blue"]
    assert [gun.aiming for gun in view_state.guns] == [True, False]
    assert view_state.tracer is not None
    plain = render(scene)
    picture = render(scene, view_state)
    for x in (20.0, 80.0):
        i, j = pixel(x, float(scene.bodies.position[0, 1]) + 2.0)
        assert (picture[i - 12 : i + 12, j - 10 : j + 20] != plain[i - 12 : i + 12, j - 10 : j + 20]).any()
    burst = ExplosionView(0.1, (50.0, 30.0), 6.0, dirt=False)
    bright = render(scene, ArtilleryViewState((), view_state.size, 0.0, bursts=(burst,)))[pixel(50.0, 30.0)]
    assert bright.sum() > plain[pixel(50.0, 30.0)].sum()


def test_view_state_of_the_past_has_only_guns() -> None:
    scene = duel()
    rules = rules_at_aim(scene)
    past, between = rules.view_state(0.0), rules.view_state(AIM_TIME - 0.5 * scene.solver.dt)
    assert [(gun.name, gun.health, gun.aiming) for gun in past.guns] == [("Red", None, False), ("Blue", None, False)]
    assert (past.wind, past.tracer) == (None, None)
    assert between.wind is not None


@pytest.mark.parametrize(
    ("centre", "scale"), [((50.0, 10.0), 1e-9), ((50.0, 10.0), 1e3), ((-1e9, 1e9), 1e-3), ((1e15, 0.0), 1e9)]
)
def test_any_camera_draws_the_state_over_the_same_landscape(centre: tuple[float, float], scale: float) -> None:
    scene = duel("rubber")
    rules = rules_at_aim(scene)
    clods = (FallingDirt(48.0, 52.0, 22.0, 26.0, 8.0),)
    path = np.array([[20.0, 12.0], [1e9, 1e9], [60.0, 12.0]])
    state = rules.view_state(AIM_TIME)
    extreme = ArtilleryViewState(
        state.guns, state.size, 900.0, (path,), (0,), (ExplosionView(0.2, (50.0, 1e12), 5.0, True),), clods, path
    )
    camera = Camera(centre, scale, SIZE)
    landscape, picture = render(scene, None, camera), render(scene, extreme, camera)
    assert (picture == landscape).all(axis=2).mean() > 0.2  # the state covers a part of the picture at most


def test_sky_tone_reaches_its_first_and_last_colour() -> None:
    assert (sky_tone(0.0), sky_tone(2.0)) == ((13, 17, 34), (240, 186, 140))


def test_film_shows_the_terrain_of_its_time() -> None:
    scene = duel()
    pit = Reshape(time=1.0, thing="terrain", points=course_of([2.0] * 100, 100.0))
    film = RecordedRun(run(scene, actions=[pit]))
    before, after = film.snapshot(0.5, frozenset()).scene, film.snapshot(1.5, frozenset()).scene
    assert before.walls == scene.walls
    assert after.walls[0].points == pit.points
    assert film.snapshot(1.6, frozenset()).scene is after  # the same object, so that its picture stays cached


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with open_window(duel_text(), tmp_path, (640, 400)) as window:
        yield window


def frame_rules(window: App, *events: pygame.event.Event) -> ArtilleryRules:
    run_frame(window, *events)
    assert window.app_state.host is not None
    rules = window.app_state.host.rules
    assert isinstance(rules, ArtilleryRules)
    return rules


@pytest.mark.fail_slow(60)  # takes over half a second
def test_keys_aim_and_fire_and_seeking_back_undoes_the_shot(window: App) -> None:
    rules = frame_rules(window)
    red = rules.shooter
    angle, power = red.angle, red.power
    frame_rules(window, key(pygame.K_LEFT))
    frame_rules(window, key_up(pygame.K_LEFT), key(pygame.K_UP))
    rules = frame_rules(window, key_up(pygame.K_UP), key(pygame.K_w))
    red = rules.shooter
    assert red.angle > angle
    assert red.power > power
    assert red.weapon == 1
    fire_step = window.app_state.view.step_number if window.app_state.view is not None else 0
    frame_rules(window, key_up(pygame.K_w), key(pygame.K_SPACE))
    while (rules := frame_rules(window)).phase == "fly":
        pass
    live = window.app_state.view
    assert isinstance(live, LiveView)
    crater = live.scene.walls[0].points
    assert rules.phase == "settle"
    assert rules.field.ground.points == crater
    assert any("shell: landed at" in text for _, text in window.app_state.messages.visible())
    assert live.session.recording().score == rules.score
    live.seek(fire_step)
    live.finish_seek()
    rules = frame_rules(window)
    assert rules.shots == []
    assert live.scene.walls[0].points != crater
