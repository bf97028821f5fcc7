"""Balls that meet swap the parts of their velocities along the tangent; those along the line of centres stay."""

import numpy as np


def step(position, velocity, dt, scene):
    radius, size = scene.bodies.radius, scene.arena.size
    position += velocity * dt
    for i in range(len(position)):
        for axis in (0, 1):
            if position[i, axis] < radius[i]:
                velocity[i, axis] = abs(velocity[i, axis])
            if position[i, axis] > size[axis] - radius[i]:
                velocity[i, axis] = -abs(velocity[i, axis])
        for j in range(i):
            dx, dy = position[j] - position[i]
            distance = np.hypot(dx, dy)
            if distance < radius[i] + radius[j]:
                tangent = np.array([-dy, dx]) / distance
                difference = (velocity[j] - velocity[i]) @ tangent
                velocity[i] += difference * tangent
                velocity[j] -= difference * tangent
