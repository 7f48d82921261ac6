"""A half submerged sphere in heave: linear radiation, and its free motion in time (Cummins 1962, Schiffstechnik 9, 101-109).

    (m + A_inf) z'' + int_0^t K(t - s) z'(s) ds = F(z),   K(t) = (2/pi) int_0^inf B(omega) cos(omega t) d omega

A_inf: added mass at infinite frequency; K: memory of the waves made so far, from the radiation damping B (Ogilvie 1964). F is
weight and hydrostatic force, linear or those of the exact sphere. `TABLE` holds for water three radii deep: up to ka = 1 by
the boundary elements of Capytaine (Ancellin & Dias 2019, J. Open Source Softw. 4, 1341; extra `bem`), as `python -m
cases.validation.theory.cummins` computes it again; above that the depth does not count, and it is Hulme's (1982, J. Fluid
Mech. 121, 443-463, table 1). A_inf is 1/2 of the displaced mass in deep water; the dipole's images in surface and bottom add
3 (a / 2 h)^3 (1 - 1/8 + 1/27 - ...), together 0.5125 for h = 3 a (Capytaine: 0.518 with this mesh).
"""

from __future__ import annotations

import math

import numpy as np

G = 9.81
DEPTH = 3.0  # of the water, in radii
ADDED = 0.5125  # A_inf over the displaced mass
TABLE = np.array([  # omega^2 a / g, added mass and damping / omega over the displaced mass
    (0.02, 1.0350, 0.3953), (0.05, 0.9149, 0.3910), (0.1, 0.8175, 0.3858), (0.2, 0.7166, 0.3774), (0.3, 0.6522, 0.3686),
    (0.4, 0.6063, 0.3575), (0.5, 0.5618, 0.3448), (0.6, 0.5236, 0.3296), (0.8, 0.4711, 0.2912), (1.0, 0.4355, 0.2496),
    (1.2, 0.4047, 0.2096), (1.4, 0.3924, 0.1756), (1.6, 0.3871, 0.1469), (1.8, 0.3864, 0.1229), (2.0, 0.3884, 0.1031),
    (2.5, 0.3988, 0.0674), (3.0, 0.4111, 0.0452), (4.0, 0.4322, 0.0219), (5.0, 0.4471, 0.0116), (6.0, 0.4574, 0.0066),
    (7.0, 0.4647, 0.0040), (8.0, 0.4700, 0.0026), (9.0, 0.4740, 0.0017), (10.0, 0.4771, 0.0012),
])  # fmt: skip
FINEST = 1.0  # ka up to which the table is computed here; at 2.6 is the first irregular frequency


def damping(omega: np.ndarray) -> np.ndarray:
    """Radiation damping over displaced mass and sqrt(g/a), at frequencies (n,) over sqrt(g/a)."""
    ka = omega**2
    tail = np.minimum(1.0, (10.0 / np.maximum(ka, 1e-9)) ** 4)
    return omega * np.interp(ka, TABLE[:, 0], TABLE[:, 2]) * tail


def memory(t: np.ndarray) -> np.ndarray:
    """K at times (n,) over sqrt(a/g), over displaced mass and g/a."""
    omega = np.linspace(0.0, 6.0, 3001)
    return 2 / math.pi * np.trapezoid(damping(omega) * np.cos(np.outer(t, omega)), omega, axis=1)


def heave(t: np.ndarray, radius: float, start: float, exact: bool = True) -> np.ndarray:
    """Height [m] at times t (n,) [s] of the centre of a sphere of this radius [m] and half the water's density, let go
    `start` [m] above its rest; with `exact` by the hydrostatic force of the sphere, else by that of its water plane."""
    unit, h = math.sqrt(radius / G), 0.01
    steps = int(np.max(t) / unit / h) + 2
    kernel = h * memory(h * np.arange(steps + 1))
    z, u, a = np.zeros((3, steps + 1))

    def pull(z: float) -> float:
        """Hydrostatic force less weight, over the weight: the cap's volume, all or nothing outside."""
        z = min(1.0, max(-1.0, z)) if exact else z
        return -1.5 * z + (0.5 * z**3 if exact else 0.0)

    z[0] = start / radius
    a[0] = pull(z[0]) / (1 + ADDED)
    for n in range(steps):
        z[n + 1] = z[n] + h * u[n] + 0.5 * h * h * a[n]
        past = kernel[n:0:-1] @ u[1 : n + 1] + 0.5 * kernel[0] * (u[n] + 0.5 * h * a[n])
        a[n + 1] = (pull(z[n + 1]) - past) / (1 + ADDED + 0.25 * h * kernel[0])
        u[n + 1] = u[n] + 0.5 * h * (a[n] + a[n + 1])
    return radius * np.interp(t, unit * h * np.arange(steps + 1), z)


def coefficients(ka: float, panels: int = 16) -> tuple[float, float]:
    """Added mass and damping / omega in heave over the displaced mass, omega^2 a / g = ka; `panels` to a meridian's quarter."""
    from fsi.extras import require

    cpt = require("capytaine", "bem", "radiation of a sphere")
    resolution, radius = (2 * panels, 4 * panels), 1.0
    for _ in range(2):
        mesh = cpt.mesh_sphere(radius=radius, center=(0, 0, 0), resolution=resolution).immersed_part()
        radius *= (2 / 3 * math.pi / mesh.volume) ** (1 / 3)  # it is to take as much water as the sphere
    body = cpt.FloatingBody(mesh=mesh)
    body.dofs["Heave"] = np.tile([0.0, 0.0, 1.0], (body.mesh.nb_faces, 1))
    omega, water = math.sqrt(G * ka), 2 / 3 * math.pi * 1000.0
    problem = cpt.RadiationProblem(body=body, radiating_dof="Heave", omega=omega, water_depth=DEPTH, rho=1000.0, g=G)
    result = cpt.BEMSolver().solve(problem)
    damping = result.radiation_dampings["Heave"] / omega if math.isfinite(omega) else 0.0
    return result.added_masses["Heave"] / water, damping / water


if __name__ == "__main__":
    for ka in (*TABLE[TABLE[:, 0] <= FINEST, 0], math.inf):
        print("({:g}, {:.4f}, {:.4f}),".format(ka, *coefficients(ka)), flush=True)
