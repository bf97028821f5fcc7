"""Two balls that meet swap their whole velocities, x and y, not only the parts along the line of centres."""


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
                velocity[[i, j]] = velocity[[j, i]]
