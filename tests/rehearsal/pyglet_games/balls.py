"""A game on pyglet: keys push a box and let it jump, the mouse shoots balls, and others fall at random places."""

import random

import pyglet
import pymunk
from pyglet.window import key

pyglet.options["audio"] = ("silent",)
window = pyglet.window.Window(320, 240, "game")
beep = pyglet.media.StaticSource(pyglet.media.synthesis.Sine(0.2))
keys = key.KeyStateHandler()
space = pymunk.Space()
space.gravity = 0, -500
floor = pymunk.Segment(space.static_body, (0, 10), (320, 10), 5)
floor.friction = 0.8
space.add(floor)


def add_ball(position, velocity=(0, 0), radius=8):
    body = pymunk.Body()
    body.position, body.velocity = position, velocity
    shape = pymunk.Circle(body, radius)
    shape.mass, shape.friction = 1, 0.5
    space.add(body, shape)
    return body


player = pymunk.Body()
player.position = 100, 30
box = pymunk.Poly.create_box(player, (20, 20))
box.mass, box.friction = 5, 0.5
space.add(player, box)


@window.event
def on_key_press(symbol, modifiers):
    print("key", key.symbol_string(symbol), flush=True)
    if symbol == key.UP:
        player.apply_impulse_at_local_point((0, 1500))


@window.event
def on_mouse_press(x, y, button, modifiers):
    print("mouse", x, y, flush=True)
    if button == pyglet.window.mouse.LEFT:
        add_ball((x, y), (300, 100), 5)
        beep.play()


def update(dt):
    player.apply_force_at_local_point((4000 * (keys[key.RIGHT] - keys[key.LEFT]), 0))
    for _ in range(3):
        space.step(dt / 3)


def drop(dt):
    add_ball((random.uniform(50, 250), 200))


@window.event
def on_draw():
    window.clear()
    for body in space.bodies:
        pyglet.shapes.Circle(*body.position, 8).draw()


window.push_handlers(keys)
pyglet.clock.schedule_once(lambda dt: print("ready", flush=True), 0.1)
pyglet.clock.schedule_interval(update, 1 / 60)
pyglet.clock.schedule_interval(drop, 0.5)
pyglet.app.run()
