"""A player is caught on a flat floor of tiles: at the seams, its corner hits the side of the next tile."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 1200
for x in [0] if MENDED else range(0, 3000, 50):
    tile = pymunk.Poly.create_box_bb(space.static_body, pymunk.BB(x, 300, 3000 if MENDED else x + 50, 350))
    tile.friction = 0.2
    space.add(tile)
player = pymunk.Body(1, float("inf"))
player.position, player.velocity = (130, 100), (300, 0)
box = pymunk.Poly.create_box(player, (30, 60))
box.friction = 0.2
space.add(player, box)
for k in range(300):
    player.apply_force_at_local_point((500, 0))
    if k % 50 == 40:
        player.apply_impulse_at_local_point((0, -500))
    space.step(1 / 60)
