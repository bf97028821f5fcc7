"""Verlet: a velocity is the way since the last step, and what overlaps is moved apart, which stops the approach."""

import numpy as np


def step(position, velocity, dt, scene):
    radius = scene.bodies.radius
    previous = position - velocity * dt
    current = position.copy()
    position += current - previous + np.array(scene.gravity) * dt**2
    for i in range(len(position)):
        for j in range(i):
            away = position[j] - position[i]
            distance = (away @ away) ** 0.5
            overlap = radius[i] + radius[j] - distance
            if overlap > 0:
                position[i] -= away / distance * overlap / 2
                position[j] += away / distance * overlap / 2
        position[i] = np.clip(position[i], radius[i], np.array(scene.arena.size) - radius[i])
    velocity[:] = (position - current) / dt
