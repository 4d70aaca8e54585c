"""The driver of the window tests: a key reaches a window once, however long it is held."""

import subprocess
import sys
from collections.abc import Iterator
from time import sleep

import pytest

from tests.driven.driving import LIMIT, SIZE, environment

pytestmark = pytest.mark.full  # a window or a film

LISTENER = f"""
import pygame

pygame.init()
pygame.display.set_mode({SIZE}).fill("white")
pygame.display.flip()
pygame.key.start_text_input()
print("ready", flush=True)
while True:
    event = pygame.event.wait()
    if event.type in (pygame.KEYDOWN, pygame.KEYUP):
        print(pygame.event.event_name(event.type), pygame.key.name(event.key), flush=True)
    elif event.type == pygame.TEXTINPUT:
        print("TextInput", event.text, flush=True)
    if event.type == pygame.KEYUP and event.key == pygame.K_b:
        break
"""
"""Program that writes each keyboard event until the key b is released."""

HOLD_TIME = 2.0
"""s; a server that repeats keys begins after 0.66 s, and continues at 25 Hz"""


@pytest.fixture
def listener(display: str) -> Iterator[subprocess.Popen[str]]:
    """Open a window that writes keyboard events to its standard output."""
    env = environment(SDL_VIDEODRIVER="x11", DISPLAY=display)
    process = subprocess.Popen([sys.executable, "-c", LISTENER], env=env, stdout=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def xdotool(display: str, *words: str) -> str:
    done = subprocess.run(
        ["xdotool", *words],
        env=environment(DISPLAY=display),
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=True,
    )
    return done.stdout.strip()


def test_held_key_does_not_repeat_and_its_release_arrives(display: str, listener: subprocess.Popen[str]) -> None:
    assert listener.stdout is not None
    lines = iter(line.strip() for line in listener.stdout)
    assert "ready" in lines
    window = xdotool(display, "search", "--sync", "--onlyvisible", "--pid", str(listener.pid)).split()[0]
    xdotool(display, "windowfocus", "--sync", window)
    xdotool(display, "keydown", "a")
    sleep(HOLD_TIME)
    xdotool(display, "keyup", "a", "key", "b")
    assert sorted(lines) == sorted(["KeyDown a", "TextInput a", "KeyUp a", "KeyDown b", "TextInput b", "KeyUp b"])
