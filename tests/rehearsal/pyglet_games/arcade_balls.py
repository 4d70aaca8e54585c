"""A game on Arcade: keys push a box and let it jump, the mouse shoots balls, and others fall at random places."""

import random

import arcade
import pymunk


class Game(arcade.Window):
    def __init__(self):
        super().__init__(320, 240, "game", center_window=True)
        self.space = pymunk.Space()
        self.space.gravity = 0, -500
        floor = pymunk.Segment(self.space.static_body, (0, 10), (320, 10), 5)
        floor.friction = 0.8
        self.player = pymunk.Body()
        self.player.position = 100, 30
        box = pymunk.Poly.create_box(self.player, (20, 20))
        box.mass, box.friction = 5, 0.5
        self.space.add(floor, self.player, box)
        self.sprites = arcade.SpriteList()
        arcade.schedule(self.drop, 0.5)

    def drop(self, dt):
        self.add_ball((random.uniform(50, 250), 200))

    def add_ball(self, position, velocity=(0, 0)):
        body = pymunk.Body()
        body.position, body.velocity = position, velocity
        shape = pymunk.Circle(body, 8)
        shape.mass, shape.friction = 1, 0.5
        self.space.add(body, shape)
        sprite = arcade.SpriteCircle(8, arcade.color.RED)
        sprite.body = body
        self.sprites.append(sprite)

    def on_key_press(self, symbol, modifiers):
        if symbol == arcade.key.UP:
            self.player.apply_impulse_at_local_point((0, 1500))

    def on_mouse_press(self, x, y, button, modifiers):
        if button == arcade.MOUSE_BUTTON_LEFT:
            self.add_ball((x, y), (300, 100))

    def on_update(self, dt):
        direction = self.keyboard[arcade.key.RIGHT] - self.keyboard[arcade.key.LEFT]
        self.player.apply_force_at_local_point((4000 * direction, 0))

    def on_fixed_update(self, dt):
        self.space.step(dt)

    def on_draw(self):
        self.clear()
        for sprite in self.sprites:
            sprite.position = sprite.body.position
        self.sprites.draw()
        arcade.draw_rect_filled(arcade.XYWH(*self.player.position, 20, 20), arcade.color.BLUE)


Game()
arcade.run()
