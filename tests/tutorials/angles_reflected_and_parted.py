"""Two balls that meet reflect their directions at the tangent and swap their speeds, and are put a pixel apart."""

from math import atan2, cos, hypot, sin


def step(position, velocity, dt, scene):
    radius = scene.bodies.radius
    position += velocity * dt
    for i in range(len(position)):
        for axis, side in enumerate(scene.arena.size):
            too_low = position[i, axis] < radius[i] and velocity[i, axis] < 0
            too_high = position[i, axis] > side - radius[i] and velocity[i, axis] > 0
            if too_low or too_high:
                velocity[i, axis] *= -1
        for j in range(i):
            dx, dy = position[j] - position[i]
            vx, vy = velocity[j] - velocity[i]
            if hypot(dx, dy) < radius[i] + radius[j] and dx * vx + dy * vy < 0:
                tangent = atan2(dx, -dy)
                angle_i = 2 * tangent - atan2(velocity[i, 1], velocity[i, 0])
                angle_j = 2 * tangent - atan2(velocity[j, 1], velocity[j, 0])
                speed_i, speed_j = hypot(*velocity[j]), hypot(*velocity[i])
                velocity[i] = speed_i * cos(angle_i), speed_i * sin(angle_i)
                velocity[j] = speed_j * cos(angle_j), speed_j * sin(angle_j)
                beyond = (radius[i] + radius[j] - hypot(dx, dy) + 1) / 2
                position[i] -= beyond * cos(atan2(dy, dx)), beyond * sin(atan2(dy, dx))
                position[j] += beyond * cos(atan2(dy, dx)), beyond * sin(atan2(dy, dx))
