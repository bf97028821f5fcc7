"""Velocities after a collision by the centre-of-mass formula, which knows no elasticity: all are elastic."""

import numpy as np


def step(position, velocity, dt, scene):
    radius, mass = scene.bodies.radius, scene.bodies.mass
    position += velocity * dt
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    for i, j in np.argwhere(np.triu(distance < radius[:, None] + radius, 1)):
        away = position[i] - position[j]
        relative = velocity[i] - velocity[j]
        centre = (mass[i] * velocity[i] + mass[j] * velocity[j]) / (mass[i] + mass[j])
        reflected = relative - 2 * away * (relative @ away) / (away @ away)
        velocity[i] = centre + reflected * mass[j] / (mass[i] + mass[j])
        velocity[j] = centre - reflected * mass[i] / (mass[i] + mass[j])
    low = position < radius[:, None]
    high = position > np.array(scene.arena.size) - radius[:, None]
    velocity[low | high] *= -1
    position[:] = np.clip(position, radius[:, None], np.array(scene.arena.size) - radius[:, None])
