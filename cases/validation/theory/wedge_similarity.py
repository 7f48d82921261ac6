"""Self-similar entry of a wedge into water at rest, without gravity: Dobrovol'skaya's flow, solved numerically.

A symmetric wedge of deadrise angle beta enters at constant speed V. In the stretched plane zeta = (x + i z) / (V t) the
flow is steady (Dobrovol'skaya 1969, J. Fluid Mech. 36, 805-829). The half of the fluid left of the axis is the image of the
upper half of a tau plane: axis for tau < 0, wedge for 0 < tau < 1, free surface for tau > 1. With psi(tau) the angle of the
free surface to its direction far away,

    zeta' = C exp(i (pi - beta)) tau^(beta/pi - 1/2) (1 - tau)^(-beta/pi) exp( 1/pi int_1^oo psi(s) / (s - tau) ds )

and Wagner's function, whose square w'' zeta'^2 is real on solids and imaginary on the free surface, is that of a triangle:
w'' zeta'^2 = K^2 / (tau (tau - 1)^(3/2)). On the free surface the particles move along it relative to the pattern, by their
distance s from the jet's tip, which leaves one equation for psi, solved here by Newton's method on tau = 1 + e^y:

    -s s' psi' = K^2 / (tau (tau - 1)^(3/2)),  psi(oo) = 0.

K follows from the tip, where fluid and pattern move alike, C from water at rest far below. For 30 degrees the largest
pressure coefficient, its place and the force agree with the table of Zhao & Faltinsen (1993, J. Fluid Mech. 246, 593-612)
within 1 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

STEP, LOW, HIGH = 0.2, -60.0, 20.0  # of y = log(tau - 1); what lies below is a power of tau - 1
SURE = 2e-3  # least angle [rad] of the jet's tip in the search


@dataclass(frozen=True)
class Entry:
    """Flow along one face of the wedge, for V = V t = rho = 1: height z above the still water (the apex is at -1),
    pressure, and the pressure impulse of a sudden unit speed. `force` and `mass` are integrals over both faces: the force at
    constant speed V is force rho V^3 t, the added mass of an acceleration is mass rho (V t)^2."""

    height: np.ndarray
    pressure: np.ndarray
    impulse: np.ndarray
    force: float
    mass: float


class _Flow:
    """The equation for psi, and what follows from a solution."""

    def __init__(self, beta: float):
        self.beta, self.b = beta, beta / math.pi
        self.y = np.arange(LOW - 15 + STEP / 2, HIGH, STEP)  # where psi stands
        self.x = np.arange(LOW, HIGH + STEP / 2, STEP)  # half way between, where principal values are taken
        self.principal = STEP / math.pi / (1 - np.exp(-np.clip(self.y - self.x[:, None], -60, 60)))
        face = np.arange(LOW + STEP / 2, 40, STEP)
        self.out, self.into = -np.log1p(np.exp(-face)), -np.log1p(np.exp(face))  # log (1 - tau), log tau on the face
        self.face = STEP / math.pi / (1 + np.exp(np.clip(self.out[:, None] - self.y, -300, 300)))

    def face_stretch(self, psi: np.ndarray) -> np.ndarray:
        """log |zeta'| / C on the face."""
        return (self.b - 0.5) * self.into - self.b * self.out + self.face @ psi

    def tip(self, psi: np.ndarray) -> float:
        """Angle of the jet's tip [pi]; distances from the tip go with this power of |tau - 1|."""
        return max(1 - (self.beta + psi[0]) / math.pi, 1e-3)

    def lengths(self, psi: np.ndarray) -> tuple[float, float]:
        """Length of the face [C], and the constant K^2 [C^2]."""
        stretch, tip = self.face_stretch(psi), self.tip(psi)
        beyond = math.exp(stretch[0] + self.out[0] - tip * STEP / 2) / tip
        length = float(np.exp(stretch + self.out + self.into).sum() * STEP) + beyond
        return length, length / float(np.exp(-stretch - 0.5 * self.out).sum() * STEP)

    def residual(self, psi: np.ndarray) -> np.ndarray:
        """What the equation makes of psi, less psi."""
        x, tau, tip = self.x, 1 + np.exp(self.x), self.tip(psi)
        stretch = (self.b - 0.5) * np.log(tau) - self.b * x + self.principal @ psi
        rate = np.exp(stretch + x)  # ds/dy
        s = rate[0] / tip + np.concatenate([[0.0], np.cumsum(0.5 * STEP * (rate[1:] + rate[:-1]))])
        fall = self.lengths(psi)[1] * np.exp(-0.5 * x - stretch) / (tau * s)  # -dpsi/dy
        steps = 0.5 * STEP * (fall[1:] + fall[:-1])
        ends = np.concatenate([np.cumsum(steps[::-1])[::-1], [0.0]]) + fall[-1] / 1.5
        below = ends[0] + (fall[0] / (0.5 - 2 * tip) if tip < 0.24 else 0.0)
        return np.where(self.y < LOW, below, np.interp(self.y, x, ends)) - psi


def _solve(flow: _Flow) -> np.ndarray:
    """psi by Newton's method with damped steps."""
    psi = (math.pi - flow.beta - 0.15) / (1 + np.exp(flow.y)) ** 1.5
    for _ in range(30):
        residual = flow.residual(psi)
        worst = np.abs(residual).max()
        if worst < 1e-9:
            return psi
        shifts = 1e-6 * np.eye(len(psi))
        jacobian = np.array([(flow.residual(psi + shift) - residual) / 1e-6 for shift in shifts]).T
        step, share = np.linalg.solve(jacobian, -residual), 1.0
        while share > 1e-3:
            trial = psi + share * step
            if trial[0] < math.pi - flow.beta - SURE and np.abs(flow.residual(trial)).max() < (1 - 0.2 * share) * worst:
                break
            share /= 2
        psi = psi + share * step
    raise ArithmeticError(f"no self-similar flow found for a deadrise of {math.degrees(flow.beta):g} degrees")


@cache
def entry(deadrise: float) -> Entry:
    """The flow around a wedge of this deadrise angle [rad]; about 30 to 45 degrees converge."""
    flow = _Flow(deadrise)
    psi = _solve(flow)
    scale = 1 / _axis_speed(flow, psi)
    length, constant = flow.lengths(psi)
    stretch = flow.face_stretch(psi)
    run = (np.exp(stretch + flow.out + flow.into) * STEP * scale)[::-1]  # from the apex up
    gain = (constant * scale * np.exp(-stretch - 0.5 * flow.out) * STEP)[::-1]
    down = -math.sin(deadrise)  # along the face: of the apex and of the fluid there
    place = down + np.cumsum(run) - 0.5 * run
    speed = down + np.cumsum(gain) - 0.5 * gain
    rise = (speed - place) * gain
    pressure = np.cumsum(rise[::-1])[::-1] - 0.5 * rise
    impulse = _impulse(flow, run * math.cos(deadrise))
    height = (place - down) * math.sin(deadrise) - 1
    force, mass = (2 * math.cos(deadrise) * float((y * run).sum()) for y in (pressure, impulse))
    inside = place - down < 0.999 * length * scale
    return Entry(height[inside], pressure[inside], impulse[inside], force, mass)


def _impulse(flow: _Flow, width: np.ndarray) -> np.ndarray:
    """Pressure impulse along the face, from the apex up, that a sudden unit speed of the wedge makes in fluid of this
    shape: zero on the free surface. `width` is dx of each piece of the face, by which the stream function grows along it;
    the mixed problem in the tau plane is solved by the weight (1 - tau)^(1/2)."""
    tau, out = np.exp(flow.into[::-1]), np.exp(flow.out[::-1])  # and 1 - tau, which is exact where tau is nearly one
    mid = np.sqrt(tau[1:] * tau[:-1]), np.sqrt(out[1:] * out[:-1])
    mid = mid[0] / (mid[0] + mid[1]), mid[1] / (mid[0] + mid[1])  # half way in log (tau / (1 - tau))
    low = (mid[0] < 0.5)[:, None]
    gap = np.where(low, tau - mid[0][:, None], mid[1][:, None] - out)
    pull = (np.sqrt(out) * width / -gap).sum(1) / math.pi
    steps = pull / np.sqrt(mid[1]) * np.where(low[:, 0], np.diff(tau), -np.diff(out))
    return np.concatenate([np.cumsum(steps[::-1])[::-1], [0.0]])


def _axis_speed(flow: _Flow, psi: np.ndarray) -> float:
    """Speed that the fluid gains along the axis from far below up to the apex, for C = 1."""
    y = np.arange(-80.0, 60.0, 0.1)
    q = np.exp(y)  # -tau
    pull = np.array([(STEP / math.pi * psi / (1 + (1 + v) * np.exp(-flow.y))).sum() for v in q])
    stretch = (flow.b - 0.5) * y - flow.b * np.log1p(q) + pull
    return float((flow.lengths(psi)[1] * np.exp(-1.5 * np.log1p(q) - stretch)).sum() * 0.1)


def free_entry(deadrise: float, mass: float, speed: float, rho: float, g: float, times: np.ndarray) -> np.ndarray:
    """Depth, speed and acceleration (len(times), 3), downwards, of a wedge of `mass` [kg/m] that meets the water with
    `speed` [m/s]: (mass + rho s^2 m) dV/dt = mass g - rho V^2 s f with the similarity flow's f and m of the depth s. This
    takes the flow as that of the present speed and depth, with the added mass of an acceleration (as Wagner 1932 does)."""
    flow = entry(deadrise)

    def rate(s: float, v: float) -> float:
        return (mass * g - rho * v * v * s * flow.force) / (mass + rho * s * s * flow.mass)

    steps, out, s, v, t = 4000, [], 0.0, speed, 0.0
    dt = float(times[-1]) / steps
    for wanted in times:
        while t < wanted - 0.5 * dt:
            half = v + 0.5 * dt * rate(s, v)
            v, s, t = v + dt * rate(s + 0.5 * dt * v, half), s + dt * half, t + dt
        out.append((s, v, rate(s, v)))
    return np.array(out)
