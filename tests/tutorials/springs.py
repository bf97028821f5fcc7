"""Overlapping balls push each other like springs: a touch lasts many steps, and balls sink into each other."""

STIFFNESS = 500  # kg/s²


def step(position, velocity, dt, scene):
    radius, mass = scene.bodies.radius, scene.bodies.mass
    for i in range(len(position)):
        for axis, side in enumerate(scene.arena.size):
            below = max(0, radius[i] - position[i, axis])
            above = max(0, position[i, axis] + radius[i] - side)
            velocity[i, axis] += STIFFNESS * (below - above) / mass[i] * dt
        for j in range(i):
            away = position[j] - position[i]
            distance = (away @ away) ** 0.5
            overlap = radius[i] + radius[j] - distance
            if overlap > 0:
                force = STIFFNESS * overlap * away / distance
                velocity[i] -= force / mass[i] * dt
                velocity[j] += force / mass[j] * dt
    position += velocity * dt
