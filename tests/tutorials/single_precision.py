"""The state is kept in single precision: all else is right, so there are only errors of rounding."""

import numpy as np


def step(position, velocity, dt, scene):
    position += velocity * dt
    for i, radius in enumerate(scene.bodies.radius):
        for axis, side in enumerate(scene.arena.size):
            for wall, outward in ((radius, -1), (side - radius, 1)):
                if outward * (position[i, axis] - wall) > 0:
                    position[i, axis] = 2 * wall - position[i, axis]
                    velocity[i, axis] *= -1
    position[:], velocity[:] = position.astype(np.float32), velocity.astype(np.float32)
