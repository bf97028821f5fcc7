"""Position-based dynamics: overlaps are removed by inverse mass, and velocities follow from where the balls end."""

import numpy as np


def step(position, velocity, dt, scene):
    radius, share = scene.bodies.radius, 1 / scene.bodies.mass
    before = position.copy()
    velocity += np.array(scene.gravity) * dt
    position += velocity * dt
    for _ in range(4):
        for i in range(len(position)):
            for j in range(i):
                away = position[j] - position[i]
                distance = (away @ away) ** 0.5
                overlap = radius[i] + radius[j] - distance
                if overlap > 0:
                    move = overlap * away / distance / (share[i] + share[j])
                    position[i] -= share[i] * move
                    position[j] += share[j] * move
            position[i] = np.clip(position[i], radius[i], np.array(scene.arena.size) - radius[i])
    velocity[:] = (position - before) / dt
