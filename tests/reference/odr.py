#!/usr/bin/env python3
"""An orthogonal distance regression of twelve noisy shots, done another way: writes odr/ beside this file.

Needs numpy and scipy. All parameters and all shots' true inputs are unknowns of one least-squares problem, whose residuals
are those of the inputs and of the observations, each over its standard deviation (Boggs, Byrd and Schnabel 1987, without
their staircase). The collision (Kim 2024, arXiv:2402.13258, sign of the cloth's torque corrected, energetic restitution) is
integrated over u, the fraction of v_z left, by 40 Gauss nodes; no shot sticks.
"""

import json
import pathlib

import numpy as np
from scipy.optimize import brentq, least_squares

R, NU = 0.028575, 0.4
TRUTH = np.array([0.05, 0.3, 0.94])
# line of centres rad, velocities m/s, spins rad/s; observations m/s
SD_IN = np.array([np.radians(1.0), 0.004, 0.004, 3.0, 3.0, 3.0])
SD_OUT = 0.004
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def impulses(k, vy, vz, mu, mu_s, e):
    ms = mu_s if vz > 0 else 0.0
    beta_y, beta_z = (1 + NU) / NU, (2 + NU - ms) / (2 * NU)
    gamma = (NU + ms) / (2 + NU - ms)
    a = ms * vz / (2 * beta_z)

    def integral(u, power):
        s = u + (1 - u) * (NODES + 1) / 2
        return (1 - u) / 2 * np.sum(WEIGHTS * s**power * np.sqrt(vz**2 + vy**2 * s ** (2 * gamma)))

    def q(u):
        return integral(u, 0) / (2 * mu * beta_z)

    def vx(u):
        return -k + 2 * q(u) - a * (1 - u)

    def work(u):
        p = q(u) - integral(u, 1) / (2 * mu * beta_z)
        return -k * q(u) + q(u) ** 2 - a * p

    low = 1e-3
    assert q(low) > k, "sticks"
    c = brentq(vx, low, 1, xtol=1e-16, rtol=1e-15)
    target = (1 - e**2) * work(c)
    f = brentq(lambda u: work(u) - target, low, c, xtol=1e-16, rtol=1e-15)
    jy = vy * (f ** (1 + gamma) - 1) / (2 * beta_y)
    jz = vz * (f - 1) / (2 * beta_z)
    return q(f), jy, jz, ms


def predict(state, parameters):
    """Velocities of cue ball and object ball after the impact, table frame."""
    alpha, ux, uy, wx, wy, wz = state
    cos, sin = np.cos(alpha), np.sin(alpha)
    k, across = cos * ux + sin * uy, cos * uy - sin * ux
    q, jy, jz, ms = impulses(k, -across - R * wz, R * (cos * wy - sin * wx), *parameters)
    cue, ball = (k - q, across - jy), (q + ms * jz, jy)
    table = lambda v: [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]]  # noqa: E731
    return np.array(table(cue) + table(ball))


def made():
    random = np.random.default_rng(1987)
    inputs, outputs = [], []
    for number in range(12):
        speed, alpha = random.uniform(1, 4), random.uniform(-np.pi, np.pi)
        cut = np.radians(random.uniform(15, 50)) * random.choice([-1, 1])
        roll = 1.0 if number % 2 == 0 else random.uniform(-1, -0.3)
        velocity = speed * np.array([np.cos(alpha + cut), np.sin(alpha + cut)])
        state = np.array([alpha, *velocity, -roll * velocity[1] / R, roll * velocity[0] / R, 0])
        inputs.append(state + SD_IN * random.standard_normal(6))
        outputs.append(predict(state, TRUTH) + SD_OUT * random.standard_normal(4))
    return np.array(inputs), np.array(outputs)


def main():
    folder = pathlib.Path(__file__).parent / "odr"
    inputs, outputs = made()
    columns = ["cue_vx", "cue_vy", "cue_wx", "cue_wy", "cue_wz"]
    after = ["cue_vx_after", "cue_vy_after", "obj_vx_after", "obj_vy_after"]
    names = ["nx", "ny", *columns, *after]
    lines = [",".join(["shot", *names, *(name + "_sd" for name in names)])]
    for number, (x, y) in enumerate(zip(inputs, outputs)):
        cos, sin = np.cos(x[0]), np.sin(x[0])
        sds = [SD_IN[0] * abs(sin), SD_IN[0] * abs(cos), *SD_IN[1:], *[SD_OUT] * 4]
        lines.append(",".join(map(repr, map(float, [number + 1, cos, sin, *x[1:], *y, *sds]))).replace(".0,", ",", 1))
    (folder / "shots.csv").write_text("\n".join(lines) + "\n")

    def residuals(z):
        parameters, states = z[:3], z[3:].reshape(-1, 6)
        own = [(predict(s, parameters) - y) / SD_OUT for s, y in zip(states, outputs)]
        return np.concatenate([((states - inputs) / SD_IN).ravel(), np.ravel(own)])

    scale = np.concatenate([[1e-3, 1e-2, 1e-3], np.tile(SD_IN, len(inputs))])
    fit = least_squares(
        residuals, np.concatenate([TRUTH, inputs.ravel()]), jac="3-point", x_scale=scale, xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    # a few plain Gauss-Newton steps more, in scaled unknowns
    z = fit.x
    for _ in range(4):
        h = 1e-3 * scale
        j = np.empty((len(fit.fun), len(z)))
        for i in range(len(z)):
            d = np.zeros_like(z)
            d[i] = h[i]
            # fourth order
            j[:, i] = (8 * (residuals(z + d) - residuals(z - d)) - residuals(z + 2 * d) + residuals(z - 2 * d)) / 12e-3
        step = np.linalg.lstsq(j, -residuals(z), rcond=None)[0]
        z = z + step * scale
        print("step in standard errors:", np.abs(step).max())
    errors = np.sqrt(np.diag(np.linalg.inv(j.T @ j))) * scale
    result = dict(mu=z[0], mu_s=z[1], e=z[2], errors=list(errors[:3]), chi2=float(np.sum(residuals(z) ** 2)))
    (folder / "minimum.json").write_text(json.dumps(result, indent=1) + "\n")
    print(result)


if __name__ == "__main__":
    main()
