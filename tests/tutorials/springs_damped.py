"""Overlapping balls push each other like damped springs: a touch lasts many steps and takes energy."""

STIFFNESS = 500  # kg/s²
DAMPING = 5  # kg/s


def step(position, velocity, dt, scene):
    radius, mass = scene.bodies.radius, scene.bodies.mass
    for i in range(len(position)):
        for axis, side in enumerate(scene.arena.size):
            below = max(0, radius[i] - position[i, axis])
            above = max(0, position[i, axis] + radius[i] - side)
            force = STIFFNESS * (below - above) - (DAMPING * velocity[i, axis] if below or above else 0)
            velocity[i, axis] += force / mass[i] * dt
        for j in range(i):
            away = position[j] - position[i]
            distance = (away @ away) ** 0.5
            overlap = radius[i] + radius[j] - distance
            if overlap > 0:
                normal = away / distance
                force = STIFFNESS * overlap + DAMPING * (velocity[i] - velocity[j]) @ normal
                velocity[i] -= force / mass[i] * dt * normal
                velocity[j] += force / mass[j] * dt * normal
    position += velocity * dt
