"""Balls that meet go on at the velocity of their centre of mass, as if they stuck."""


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
                both = balls.mass[i] * velocity[i] + balls.mass[j] * velocity[j]
                velocity[i] = velocity[j] = both / (balls.mass[i] + balls.mass[j])
