"""Linear theory of floating sections in two dimensions, by boundary elements; and the motion of a body that is let go.

Potential phi exp(-i omega t) of the fluid around a body symmetric in x that moves with unit velocity in one mode, over a
flat bottom. Green's third identity with ln r and its images at the bottom and across x = 0 gives one equation for each
straight panel with a constant potential on the body, on the free surface (phi_n = omega^2/g phi) and on a vertical line
far out (phi_n = i k phi: waves leave). On the body, rho integral phi n ds = A + i B / omega (Newman 1977, Marine
Hydrodynamics, sec. 6.16-6.18).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fsi.waves import wavenumber


def _influence(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of ln r and of its derivative along the normal over the panels `start` to `end` (m, 2), seen from the
    points (n, 2); the normal lies to the right of a panel's direction."""
    along = end - start
    length = np.linalg.norm(along, axis=1)
    tangent = along / length[:, None]
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]])
    arm = points[:, None] - start
    s, y = np.einsum("nmk,mk->nm", arm, tangent), np.einsum("nmk,mk->nm", arm, normal)

    def potential(t):
        r2 = np.maximum(t * t + y * y, 1e-300)
        return 0.5 * t * np.log(r2) - t + np.abs(y) * np.arctan2(t, np.abs(y))

    single = potential(length - s) - potential(-s)
    y = np.where(np.abs(y) < 1e-12 * length, 0.0, y)
    angle = np.arctan2((length - s) * y, y * y) - np.arctan2(-s * y, y * y)
    return single, -np.where(y == 0, 0.0, angle)


def _line(a, b, size: float, grow: float = 1.0) -> np.ndarray:
    """Points from a to b, `size` apart at first and further apart by the factor `grow` from one to the next."""
    a, b = np.array(a, float), np.array(b, float)
    span = np.linalg.norm(b - a)
    count = max(2, round(span / size) if grow == 1 else round(math.log(1 + span / size * (grow - 1)) / math.log(grow)))
    steps = grow ** np.arange(count)
    share = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    return a + share[:, None] * (b - a)


class Section:
    """A rectangular section of this width and draft [m], with bilges of the radius `bilge` [m], in water of this depth [m];
    `centre` (z) [m] is the point that pitch turns about."""

    def __init__(
        self,
        width: float,
        draft: float,
        depth: float,
        bilge: float = 0.0,
        centre: float = 0.0,
        g: float = 9.81,
        rho: float = 1e3,
    ):
        self.width, self.draft, self.depth, self.bilge, self.centre, self.g, self.rho = (
            width, draft, depth, bilge, centre, g, rho,
        )  # fmt: skip

    def contour(self, size: float) -> np.ndarray:
        """Points (n, 2) from the water line on the right down to the middle of the bottom, `size` apart [m]."""
        half, r = 0.5 * self.width, self.bilge
        angle = np.linspace(0, 0.5 * math.pi, 1 + max(1, math.ceil(0.5 * math.pi * r / size)) if r else 1)[:, None]
        corner = np.array([half - r, r - self.draft]) + r * np.hstack([np.cos(angle), -np.sin(angle)])
        side, bottom = _line((half, 0), (half, r - self.draft), size), _line(corner[-1], (0, -self.draft), size)
        points = np.vstack([side[:-1], corner, bottom[1:]])
        apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9 * self.width  # no sides are left of a half circle
        return points[np.concatenate([[True], apart])]

    def coefficients(self, omega: float, mode: str) -> tuple[float, float]:
        """Added mass and damping per length for `mode` "heave" [kg/m, kg/(m s)] or "pitch" [kg m, kg m/s]."""
        k, sign = wavenumber(omega, self.depth, self.g), 1 if mode == "heave" else -1
        size = min(0.03 * self.width, 0.03 * 2 * math.pi / k)
        far = 0.5 * self.width + max(2 * self.depth, 2 * math.pi / k)
        half = 0.5 * self.width
        body = self.contour(size)
        surface = _line((half, 0), (far, 0), size, 1.04)[::-1]
        out = _line((far, 0), (far, -self.depth), 2 * size)[::-1]
        lines = [body, surface, out]  # the normal, to the right of the direction, points out of the fluid
        start, end = np.vstack([p[:-1] for p in lines]), np.vstack([p[1:] for p in lines])
        counts = np.cumsum([len(p) - 1 for p in lines])
        middle = 0.5 * (start + end)
        single, double = np.zeros((2, len(start), len(start)))
        for flip, factor in ((1, 1), (-1, sign)):
            for shift in (False, True):
                seen = middle * [flip, -1 if shift else 1] - [0, 2 * self.depth if shift else 0]
                a, b = _influence(seen, start, end)
                single, double = single + factor * a, double + factor * b
        b, s = counts[0], counts[1]
        along = (end - start)[:b]
        length = np.linalg.norm(along, axis=1)
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / length[:, None]
        arm = middle[:b] - [0, self.centre]
        drive = normal[:, 1] if mode == "heave" else arm[:, 1] * normal[:, 0] - arm[:, 0] * normal[:, 1]
        follow = np.concatenate([np.zeros(b), np.full(s - b, omega**2 / self.g), np.full(len(start) - s, 1j * k)])
        matrix = math.pi * np.eye(len(start)) - double + single * follow
        potential = np.linalg.solve(matrix, -single[:, :b] @ drive)
        total = 2 * self.rho * (potential[:b] * drive * length).sum()
        return total.real, omega * total.imag

    def stiffness(self, mode: str) -> float:
        """Restoring force per heave [N/m2], or moment per pitch of a body whose weight acts at `centre` [N]."""
        if mode == "heave":
            return self.rho * self.g * self.width
        x, z = self.contour(1e-3 * self.width).T
        moment = -((x[1:] + x[:-1]) * (z[1:] + z[:-1]) / 2 * np.diff(z)).sum()  # of the area under water
        return self.rho * self.g * (self.width**3 / 12 + moment - self.area() * self.centre)

    def area(self) -> float:
        """Area under water [m2]."""
        return self.width * self.draft - (2 - 0.5 * math.pi) * self.bilge**2


def release(
    t: np.ndarray, inertia: float, stiffness: float, coefficients: Callable[[float], tuple[float, float]], top: float
) -> np.ndarray:
    """Displacement at t (n,) of a body let go from a displacement of one, by linear theory with added mass and damping
    that depend on the frequency: x = 1 - C step(t), with the step response (2/pi) int Re H sin(omega t) / omega, H =
    1 / (C - omega^2 (M + A) - i omega B) of frequencies up to `top` [1/s]."""
    knots = np.linspace(top / 40, top, 40)
    A, B = np.array([coefficients(w) for w in knots]).T
    omega = np.linspace(top / 4000, 3 * top, 12000)
    a = np.interp(omega, knots, A)
    b = np.interp(omega, knots, B) * np.where(omega > top, (top / omega) ** 4, 1.0)
    b[omega < knots[0]] *= (omega / knots[0])[omega < knots[0]]
    real = (1 / (stiffness - omega**2 * (inertia + a) - 1j * omega * b)).real
    kernel = np.sin(np.outer(t, omega)) / omega * real
    return 1 - stiffness * 2 / math.pi * (np.trapezoid(kernel, omega, axis=1) + 0.5 * kernel[:, 0] * omega[0] * 2)
