"""Two balls that overlap are put further into each other: the correction has the wrong sign."""


def step(position, velocity, dt, scene):
    balls = scene.bodies
    position += velocity * dt
    for i in range(len(position)):
        for axis, side in enumerate(scene.arena.size):
            too_low = position[i, axis] < balls.radius[i] and velocity[i, axis] < 0
            too_high = position[i, axis] > side - balls.radius[i] and velocity[i, axis] > 0
            if too_low or too_high:
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
                overlap = balls.radius[i] + balls.radius[j] - distance
                position[i] += overlap / 2 * normal
                position[j] -= overlap / 2 * normal
