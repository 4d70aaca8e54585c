"""Game with pygame and pymunk that the rows of rehearsals play: 100 boxes and balls fall into a pit and are thrown.

python -m tools.benchmarks.hundred_bodies plays it in a window.
"""

import random

import pygame
import pymunk

WIDTH, HEIGHT = 800, 600
BODIES = 100
BALL, FLOOR = 1, 2


def build_space() -> pymunk.Space:
    """Return a pit with boxes and balls above it."""
    space = pymunk.Space()
    space.gravity = (0, 900)
    for ends in (((20, 0), (20, 580)), ((20, 580), (780, 580)), ((780, 580), (780, 0))):
        wall = pymunk.Segment(space.static_body, *ends, 5)
        wall.friction, wall.elasticity, wall.collision_type = 0.8, 0.2, FLOOR
        space.add(wall)
    for k in range(BODIES):
        body = pymunk.Body(1, pymunk.moment_for_box(1, (20, 20)))
        body.position = 60 + 70 * (k % 10) + random.uniform(-5, 5), 560 - 45 * (k // 10)
        shape = pymunk.Poly.create_box(body, (20, 20)) if k % 2 else pymunk.Circle(body, 11)
        shape.friction, shape.elasticity, shape.collision_type = 0.6, 0.3, BALL
        space.add(body, shape)
    return space


def main() -> None:
    """Play until the window is closed."""
    pygame.init()
    screen = pygame.display.set_mode((WIDTH, HEIGHT))
    clock = pygame.time.Clock()
    space = build_space()
    landings = 0

    def land(_arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        nonlocal landings
        landings += 1

    space.on_collision(BALL, FLOOR, begin=land)
    is_running = True
    while is_running:
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                is_running = False
            elif event.type == pygame.MOUSEBUTTONDOWN:
                hit = space.point_query_nearest(event.pos, 60, pymunk.ShapeFilter())
                body = None if hit is None or hit.shape is None else hit.shape.body
                if body is not None and body.body_type == pymunk.Body.DYNAMIC:
                    body.velocity = (100, -500)
        if pygame.key.get_pressed()[pygame.K_SPACE]:
            for body in list(space.bodies)[:10]:
                body.apply_force_at_world_point((0, -1500), body.position)
        space.step(1 / 60)
        screen.fill((250, 250, 250))
        for shape in space.shapes:
            assert shape.body is not None
            if isinstance(shape, pymunk.Circle):
                pygame.draw.circle(screen, (200, 80, 60), shape.body.position, shape.radius)
            elif isinstance(shape, pymunk.Segment):
                pygame.draw.line(screen, (60, 60, 60), shape.a, shape.b, 10)
            elif isinstance(shape, pymunk.Poly):
                corners = [shape.body.local_to_world(corner) for corner in shape.get_vertices()]
                pygame.draw.polygon(screen, (60, 110, 200), corners)
        pygame.display.flip()
        clock.tick(60)


if __name__ == "__main__":
    main()
