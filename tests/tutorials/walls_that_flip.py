"""A ball found in a wall is only reversed, in every step that it is there: slow balls stick in the wall."""

import numpy as np


def step(position, velocity, dt, scene):
    balls = scene.bodies
    gravity = np.array(scene.gravity)
    position += velocity * dt + gravity * dt**2 / 2
    velocity += gravity * dt
    for i in range(len(position)):
        for axis, side in enumerate(scene.arena.size):
            if not balls.radius[i] <= position[i, axis] <= side - balls.radius[i]:
                velocity[i, axis] *= -balls.elasticity[i] * scene.arena.elasticity
        for j in range(i):
            away = position[j] - position[i]
            distance = (away @ away) ** 0.5
            normal = away / distance
            approach = (velocity[i] - velocity[j]) @ normal
            if distance < balls.radius[i] + balls.radius[j] and approach > 0:
                restitution = balls.elasticity[i] * balls.elasticity[j]
                impulse = (1 + restitution) * approach / (1 / balls.mass[i] + 1 / balls.mass[j])
                velocity[i] -= impulse / balls.mass[i] * normal
                velocity[j] += impulse / balls.mass[j] * normal
