"""Semi-implicit gravity, damping, balls put on walls and pushed apart by halves: several small mistakes at once."""

import numpy as np


def step(position, velocity, dt, scene):
    balls, size = scene.bodies, np.array(scene.arena.size)
    velocity += np.array(scene.gravity) * dt
    velocity *= 0.999
    position += velocity * dt
    for i in range(len(position)):
        for axis in (0, 1):
            if position[i, axis] < balls.radius[i] or position[i, axis] > size[axis] - balls.radius[i]:
                velocity[i, axis] *= -balls.elasticity[i] * scene.arena.elasticity
        position[i] = np.clip(position[i], balls.radius[i], size - balls.radius[i])
        for j in range(i + 1, len(position)):
            away = position[j] - position[i]
            distance = np.hypot(*away)
            overlap = balls.radius[i] + balls.radius[j] - distance
            if overlap > 0:
                normal = away / distance
                position[i] -= overlap / 2 * normal
                position[j] += overlap / 2 * normal
                approach = (velocity[i] - velocity[j]) @ normal
                if approach > 0:
                    restitution = balls.elasticity[i] * balls.elasticity[j]
                    impulse = (1 + restitution) * approach / (1 / balls.mass[i] + 1 / balls.mass[j])
                    velocity[i] -= impulse / balls.mass[i] * normal
                    velocity[j] += impulse / balls.mass[j] * normal
