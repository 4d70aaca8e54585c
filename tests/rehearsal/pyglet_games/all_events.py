"""A program on pyglet with an event loop of its own, which prints the events that reach its window."""

import time

import pyglet
import pymunk
from pyglet.window import key

window = pyglet.window.Window(200, 100, resizable=True)
space = pymunk.Space()
ball = pymunk.Body(1, 1)
ball.velocity = 10, 0
space.add(ball, pymunk.Circle(ball, 3))


def on_key_press(symbol, modifiers):
    print("press", key.symbol_string(symbol), key.modifiers_string(modifiers))
    if symbol == key.F1:
        window.set_size(300, 150)
    if symbol == key.F2:
        window.set_fullscreen(True)


def on_key_release(symbol, modifiers):
    print("release", key.symbol_string(symbol), key.modifiers_string(modifiers))


def printer(name):
    return lambda *arguments: print(name, *arguments)


window.push_handlers(on_key_press, on_key_release)
names = ("on_text", "on_text_motion", "on_mouse_motion", "on_mouse_drag", "on_mouse_press", "on_mouse_release")
for name in (*names, "on_resize"):
    window.set_handler(name, printer(name))
start = time.perf_counter()
while not window.has_exit:
    space.step(pyglet.clock.tick())
    window.dispatch_events()
    window.flip()
print(f"{time.perf_counter() - start:.9f} s, {window.width} px")
