"""What a move leads into a wall or another ball is put back to where it was before, with its new velocity."""


def step(position, velocity, dt, scene):
    balls, before = scene.bodies, position.copy()
    position += velocity * dt
    for i in range(len(position)):
        for axis, side in enumerate(scene.arena.size):
            if not balls.radius[i] <= position[i, axis] <= side - balls.radius[i]:
                velocity[i, axis] *= -balls.elasticity[i] * scene.arena.elasticity
                position[i] = before[i]
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
                position[i], position[j] = before[i], before[j]
