"""Slingshot: drag the bird back with the mouse, release it, and hit the pigs in the castle. R loads the next bird.

At 60 Hz and 1 substep the heavy stones press the castle up to 4.8 px down and 14.7 px aside before the bird flies;
with 4 substeps it stays within 0.3 px of 64 substeps, with 30 iterations within 1.6 px, and with 15 it still leans. The
bird hits the pig in all runs; 8 substeps hold all positions of the 7 s within 1.5 px, 40 iterations within 7.5 px.
"""

import pygame
import pymunk
from pymunk import Vec2d

WIDTH, HEIGHT = 960, 540
GROUND_Y = 480
SLING = Vec2d(170, 370)
MAX_PULL = 110
POWER = 9.5  # px/s of launch speed for each px of pull
PIG_LIFE = 1200  # impulse that knocks a pig out
MAX_BIRDS = 3

BIRD, PIG, BLOCK, GROUND = range(1, 5)

SKY, GRASS, WOOD, STONE, GLASS = "#bde0fe", "#588157", "#c58940", "#6c757d", "#a8dadc"
RED, GREEN, BROWN, INK = "#d62828", "#80b918", "#5b3a1e", "#22223b"

# centre x, size, mass, color of the blocks of a row, and the rows from below
CASTLE = [
    [(640, (18, 70), 1, WOOD), (760, (18, 70), 1, WOOD)],
    [(700, (170, 16), 2, WOOD)],
    [(655, (18, 60), 1, WOOD), (745, (18, 60), 1, WOOD)],
    [(700, (140, 16), 2, WOOD)],
    [(675, (50, 34), 30, STONE), (735, (34, 34), 8, STONE)],
]


class Game:
    def __init__(self):
        self.space = pymunk.Space()
        self.space.gravity = 0, 900
        self.hits = 0
        self.birds_left = MAX_BIRDS

        ground = pymunk.Segment(self.space.static_body, (-500, GROUND_Y + 30), (WIDTH + 500, GROUND_Y + 30), 30)
        ground.friction = 0.9
        ground.collision_type = GROUND
        self.space.add(ground)

        self.blocks = []
        self.add_castle()
        self.pigs = {}  # pig: impulse that it still bears
        self.add_pig(700, GROUND_Y - 15)
        self.add_pig(560, GROUND_Y - 15)

        self.mouse_body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self.mouse_joint = None
        self.load_bird()

        self.space.on_collision(BIRD, PIG, begin=self.bird_hits_pig)
        self.space.on_collision(PIG, None, post_solve=self.hurt_pig)

    def add_castle(self):
        y = GROUND_Y
        for row in CASTLE:
            height = row[0][1][1]
            for x, size, mass, color in row:
                body = pymunk.Body(mass, pymunk.moment_for_box(mass, size))
                body.position = x, y - size[1] / 2
                shape = pymunk.Poly.create_box(body, size)
                shape.friction = 0.7
                shape.collision_type = BLOCK
                self.space.add(body, shape)
                self.blocks.append((shape, color))
            y -= height

    def add_pig(self, x, y):
        body = pymunk.Body(3, pymunk.moment_for_circle(3, 0, 15))
        body.position = x, y
        shape = pymunk.Circle(body, 15)
        shape.friction = 0.9
        shape.collision_type = PIG
        self.space.add(body, shape)
        self.pigs[shape] = PIG_LIFE

    def load_bird(self):
        self.birds_left -= 1
        body = pymunk.Body(5, pymunk.moment_for_circle(5, 0, 14))
        body.position = SLING
        self.bird = pymunk.Circle(body, 14)
        self.bird.friction = 0.8
        self.bird.elasticity = 0.2
        self.bird.collision_type = BIRD
        self.holder = pymunk.PivotJoint(self.space.static_body, body, SLING)
        self.space.add(body, self.bird, self.holder)

    def grab(self, position):
        if self.holder and self.bird.point_query(position).distance < 10:
            self.space.remove(self.holder)
            self.holder = None
            self.mouse_body.position = position
            self.mouse_joint = pymunk.PivotJoint(self.mouse_body, self.bird.body, (0, 0), (0, 0))
            self.mouse_joint.max_force = 60_000
            self.space.add(self.mouse_joint)

    def drag(self, position):
        pull = Vec2d(*position) - SLING
        if pull.length > MAX_PULL:
            pull = pull.scale_to_length(MAX_PULL)
        self.mouse_body.position = SLING + pull

    def release(self):
        self.space.remove(self.mouse_joint)
        self.mouse_joint = None
        self.bird.body.velocity = (SLING - self.bird.body.position) * POWER

    def bird_hits_pig(self, arbiter, space, data):
        self.hits += 1

    def hurt_pig(self, arbiter, space, data):
        pig = arbiter.shapes[0]
        if pig in self.pigs and arbiter.total_impulse.length > self.pigs[pig]:
            del self.pigs[pig]
            space.remove(pig, pig.body)

    def draw(self, screen, font):
        screen.fill(SKY)
        pygame.draw.rect(screen, GRASS, (0, GROUND_Y, WIDTH, HEIGHT - GROUND_Y))
        bird = self.bird.body
        in_sling = self.holder or self.mouse_joint
        band_end = bird.position if in_sling else SLING + Vec2d(0, 4)
        pygame.draw.line(screen, BROWN, SLING + Vec2d(0, 20), (SLING.x, GROUND_Y), 12)
        for side in (-16, 16):
            pygame.draw.line(screen, BROWN, SLING + Vec2d(0, 24), SLING + Vec2d(side, -8), 8)
            pygame.draw.line(screen, INK, SLING + Vec2d(side, -6), band_end, 4)
        for shape, color in self.blocks:
            corners = [shape.body.local_to_world(corner) for corner in shape.get_vertices()]
            pygame.draw.polygon(screen, color, corners)
            pygame.draw.polygon(screen, INK, corners, 1)
        for pig in self.pigs:
            pygame.draw.circle(screen, GREEN, pig.body.position, 15)
            pygame.draw.circle(screen, INK, pig.body.local_to_world((5, -4)), 2)
            pygame.draw.circle(screen, INK, pig.body.local_to_world((-5, -4)), 2)
        pygame.draw.circle(screen, RED, bird.position, 14)
        pygame.draw.circle(screen, INK, bird.local_to_world((6, -4)), 3)
        text = f"hits {self.hits}   pigs {len(self.pigs)}   birds {self.birds_left}"
        screen.blit(font.render(text, True, INK), (16, 12))


def main():
    pygame.init()
    screen = pygame.display.set_mode((WIDTH, HEIGHT))
    pygame.display.set_caption("Slingshot")
    font = pygame.font.Font(None, 32)
    clock = pygame.time.Clock()
    game = Game()
    space = game.space
    while True:
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                pygame.quit()
                return
            if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
                game.grab(event.pos)
            if event.type == pygame.MOUSEBUTTONUP and event.button == 1 and game.mouse_joint:
                game.release()
            if event.type == pygame.KEYDOWN and event.key == pygame.K_r and game.birds_left and not game.holder:
                game.load_bird()
        if game.mouse_joint:
            game.drag(pygame.mouse.get_pos())
        space.step(1 / 60)
        game.draw(screen, font)
        pygame.display.flip()
        clock.tick(60)


if __name__ == "__main__":
    main()
