"""Incident waves: elevation, motion and pressure of the water anywhere, as pure functions of time and place.

Everything follows from one displacement potential over a flat bed at depth d,

    Psi = r(t) sum e_n C_n(z) cos theta_n,   theta_n = k_n s - omega_n t + phase_n,   C_n = cosh k_n (z + d) / cosh k_n d,

with z from the still water level and s along the way that each runs: water displaced by grad Psi has the velocity
d/dt grad Psi, of potential dPsi/dt, and Bernoulli's pressure. Linear waves have e = a g / omega^2, waves of finite height
a term for each harmonic. r is the ramp of a sea that begins at rest, 1 otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fsi.waves.linear import cosine_ramp, wavenumber

AT_ONCE = 2_000_000  # points times components in memory
PASSES = 6  # of the fixed point in `IncidentWaves.carried`; each gains a factor of the steepness


@dataclass(frozen=True)
class IncidentWaves:
    """Waves of `elevation` amplitudes (n,) [m] and `potential` amplitudes e (n,) [m2], wavenumbers `k` [1/m], `omega` [1/s] and
    `phase` (n,), in water of this depth [m].

    `heading`: direction they run to, from x towards y [rad]; `ramp`: of a sea that begins at rest [s]; `drift`: mean
    velocity of the water [m/s], the return flow of a closed tank; `steady`: harmonics of one wave of permanent form, whose
    C_n hold above still water too. In a sum of many waves they go on there by their tangent: short waves would grow
    without bound in the crests of long ones (Rodenbusch & Forristall 1986). `aligned`: crests that meet on purpose.
    `off` (n,): directions of the components from the heading [rad], of a sea that is spread over directions; `free`: how many
    of the components run by themselves where others are bound to them (`fsi.waves.second_order`). `current` (2,): uniform
    velocity [m/s] of the water that all this is seen from; a fixed place sees omega + k . current (`fsi.waves.current`)."""

    elevation_amplitude: np.ndarray
    potential: np.ndarray
    k: np.ndarray
    omega: np.ndarray
    phase: np.ndarray
    depth: float
    g: float
    heading: float = 0.0
    ramp: float = 0.0
    drift: float = 0.0
    steady: bool = False
    aligned: bool = False
    off: np.ndarray | None = None
    free: int | None = None
    current: np.ndarray | None = None

    # -------------------------------------------------------------------------------------- what is asked of it

    def elevation(self, t: float, feet: np.ndarray) -> np.ndarray:
        """Elevation (n,) [m] at places (n, dim - 1), x and in three dimensions y."""
        return self._sum(t, 0, feet, np.zeros(len(feet)), lambda w, *_: w.elevation_amplitude)[0]

    def displacement(self, t: float, points: np.ndarray) -> np.ndarray:
        """First-order displacement (n, dim) [m] of the water that belongs at points (n, dim)."""
        return self._vector(t, 0, points)

    def velocity(self, t: float, points: np.ndarray) -> np.ndarray:
        """Velocity (n, dim) [m/s] at points (n, dim)."""
        found = self._vector(t, 1, points)
        found[:, :-1] += self.flow(t, points.shape[1])
        return found

    def acceleration(self, t: float, points: np.ndarray) -> np.ndarray:
        """Acceleration du/dt (n, dim) [m/s2] at points (n, dim) that stand still in the current."""
        return self._vector(t, 2, points)

    def pressure(self, t: float, points: np.ndarray, density: float) -> np.ndarray:
        """Pressure (n,) [Pa] at points (n, dim) by Bernoulli's equation, 0 at still water; at the surface of a sum of
        linear waves it is off zero by rho g a k a."""
        u = self._vector(t, 1, points)
        return density * (-self.g * points[:, -1] - self._potential(t, 2, points) - 0.5 * (u * u).sum(1))

    def pressure_of(self, t: float, home: np.ndarray, density: float) -> np.ndarray:
        """Pressure (n,) [Pa] to first order of the water that belongs at `home` (n, dim), 0 on the free surface."""
        height = home[:, -1] + self._vector(t, 0, home)[:, -1]
        return density * (-self.g * height - self._potential(t, 2, home))

    def carried(self, t: float, home: np.ndarray) -> np.ndarray:
        """Where (n, dim) the water that belongs at `home` is, without its drift: it follows grad Psi for a unit of time.

        The midpoint rule x = home + grad Psi((home + x) / 2) keeps areas exactly (Hairer, Lubich & Wanner 2006, ch. VI), so
        that the water keeps its density; to second order in the steepness it is the path of the water (Stokes 1847)."""
        found = home.copy()
        for _ in range(PASSES):
            found = home + self._vector(t, 0, 0.5 * (home + found))
        return found

    def mean_flow(self, t: float) -> float:
        """Mean velocity along the heading [m/s]."""
        return self.drift * self.ramped(t)[0] ** 2

    def flow(self, t: float, dim: int) -> np.ndarray:
        """Mean velocity (dim - 1,) [m/s]: of the current, and along the heading."""
        mean = self.mean_flow(t) * self.along(dim)
        return mean if self.current is None else mean + self.current[: dim - 1]

    @property
    def crest(self) -> float:
        """Height [m] that crests hardly exceed: that of a steady wave, six standard deviations of a sum of many that do not
        meet on purpose."""
        if self.steady:
            s = np.linspace(0, 2 * math.pi / self.k[0], 181)[:, None]
            return float(self.elevation(2 * self.ramp, s).max())
        return self._most(self.elevation_amplitude)

    @property
    def excursion(self) -> float:
        """Largest horizontal displacement [m] at the still water level."""
        return self._most(self.k * self.potential)

    def _most(self, amplitude: np.ndarray) -> float:
        total = float(np.abs(amplitude).sum())
        return total if self.aligned else min(6 * math.sqrt(0.5 * float((amplitude**2).sum())), total)

    def turned(self, heading: float, ramp: float) -> IncidentWaves:
        """The same waves to another heading [rad], beginning with a ramp [s]."""
        return replace(self, heading=heading, ramp=ramp)

    def frame(self, dim: int) -> np.ndarray:
        """Horizontal directions (axes, dim - 1) along which the waves differ: the heading, or all of them."""
        return np.eye(dim - 1) if self.off is not None else self.along(dim)[None]

    def wavevectors(self, frame: np.ndarray) -> np.ndarray:
        """Wavenumbers (n, axes) [1/m] along the directions of a frame (axes, dim - 1)."""
        angle = self.heading + (np.zeros(len(self.k)) if self.off is None else self.off)
        way = np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, : frame.shape[1]]
        return self.k[:, None] * (way @ frame.T)

    # -------------------------------------------------------------------------------------- sums

    def along(self, dim: int) -> np.ndarray:
        """The direction of the heading in the horizontal axes (dim - 1,)."""
        return np.array([math.cos(self.heading), math.sin(self.heading)])[: dim - 1]

    def ramped(self, t: float) -> tuple[float, float, float]:
        """The ramp and its first two derivatives."""
        return cosine_ramp(t, self.ramp) if self.ramp > 0 else (1.0, 0.0, 0.0)

    def phasor(self, t: float, rate: int) -> np.ndarray:
        """The rate-th time derivative of r exp(i (phase - omega t)) (n,), for water that drifts with the current."""
        r, dr, ddr = self.ramped(t)
        turn, w = np.exp(1j * (self.phase - self.seen * t)), -1j * self.omega
        return turn * (r, dr + r * w, ddr + 2 * dr * w + r * w * w)[rate]

    @property
    def seen(self) -> np.ndarray:
        """Frequencies (n,) [rad/s] at a fixed place."""
        return self.omega if self.current is None else self.omega + self.wavevectors(np.eye(2)) @ self.current

    def profiles(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """C_n and dC_n/dz at heights z (m,), each (m, n)."""
        z = np.maximum(z, -self.depth)[:, None]
        low = z if self.steady else np.minimum(z, 0.0)
        rise, fall = np.exp(self.k * low), np.exp(-self.k * (low + 2 * self.depth))
        full = 1 + np.exp(-2 * self.k * self.depth)
        c, s = (rise + fall) / full, self.k * (rise - fall) / full
        above = z - low
        return c + above * s, s + above * self.k**2 * c

    def _sum(self, t: float, rate: int, feet: np.ndarray, z: np.ndarray, *modes: Mode) -> np.ndarray:
        """For each of the modes the real sums (n,) of mode exp(i theta), derived `rate` times by time, at feet (n, dim - 1) and
        heights z (n,)."""
        turn, frame = self.phasor(t, rate), self.frame(feet.shape[1] + 1)
        k, places = self.wavevectors(frame), feet @ frame.T
        found, step = np.empty((len(modes), len(z))), max(1, AT_ONCE // len(self.k))
        for at in range(0, len(z), step):
            part = slice(at, at + step)
            wave, shape = np.exp(1j * (places[part] @ k.T)) * turn, self.profiles(z[part])
            for total, mode in zip(found, modes, strict=True):
                total[part] = (wave * mode(self, k, *shape)).sum(1).real
        return found

    def _vector(self, t: float, rate: int, points: np.ndarray) -> np.ndarray:
        """grad Psi (n, dim), derived `rate` times by time."""
        frame = self.frame(points.shape[1])
        *ahead, up = self._sum(t, rate, points[:, :-1], points[:, -1], *(XI(d) for d in range(len(frame))), ZETA)
        return np.column_stack([np.transpose(ahead) @ frame, up])

    def _potential(self, t: float, rate: int, points: np.ndarray) -> np.ndarray:
        return self._sum(t, rate, points[:, :-1], points[:, -1], PSI)[0]


# Parts of Psi and of its derivatives by the directions d and e of a frame and by z, before exp(i theta): of the waves, their
# wavenumbers k (n, axes) in the frame, and C and dC/dz.
Mode = Callable[[IncidentWaves, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def PSI(w: IncidentWaves, k, c, s):
    return w.potential * c


def ZETA(w: IncidentWaves, k, c, s):
    return w.potential * s


def XI(d: int) -> Mode:
    return lambda w, k, c, s: 1j * k[:, d] * w.potential * c


def XI_ALONG(d: int, e: int) -> Mode:
    return lambda w, k, c, s: -k[:, d] * k[:, e] * w.potential * c


def XI_UP(d: int) -> Mode:
    return lambda w, k, c, s: 1j * k[:, d] * w.potential * s


class Table:
    """The sums at places (m, axes) of a frame and heights z (l,) [m], as products of matrices."""

    def __init__(
        self, waves: IncidentWaves, frame: np.ndarray, places: np.ndarray, z: np.ndarray, modes: Sequence[Mode]
    ):
        self.waves, self._shape, k = waves, (len(places), len(modes), len(z)), waves.wavevectors(frame)
        self._wave = np.exp(1j * (places @ k.T))
        shape = waves.profiles(z)
        found = np.concatenate([np.broadcast_to(mode(waves, k, *shape), shape[0].shape) for mode in modes]).T
        pairs = np.stack([found.real, -found.imag], axis=1)  # for the real part of a product
        self._modes = pairs.reshape(2 * len(found), found.shape[1])

    @property
    def products(self) -> int:
        """Multiplications that the table takes at an instant."""
        return len(self._wave) * self._modes.size

    def at(self, t: float, rate: int) -> np.ndarray:
        """The modes (modes, m, l), derived `rate` times by time."""
        found = (self._wave * self.waves.phasor(t, rate)).view(float) @ self._modes
        return found.reshape(self._shape).transpose(1, 0, 2)


class Paddle:
    """Flexible walls that move as the water of the waves does, at places (m, axes) of a frame and heights z (l,) [m]: without
    evanescent waves, and to second order in the steepness without free ones.

    A wall at x = D(z, t) lets no water through where dD/dt + w dD/dz = u at x = D. To second order the periodic solution is
    D = xi + ((xi . grad) xi - zeta xi_z) / 2; the water's drift, which is the rest of it, has no place in a closed tank."""

    def __init__(self, waves: IncidentWaves, frame: np.ndarray, places: np.ndarray, z: np.ndarray):
        self._axes = axes = range(len(frame))
        bends = [XI_ALONG(d, e) for d in axes for e in axes]
        self._table = Table(waves, frame, places, z, [*map(XI, axes), ZETA, *map(XI_UP, axes), *bends])

    @property
    def products(self) -> int:
        """Multiplications that the walls take at an instant."""
        return 3 * self._table.products

    def at(self, t: float) -> tuple[np.ndarray, ...]:
        """Displacement [m], velocity [m/s] and acceleration [m/s2] along the frame (axes, m, l), then the water's upward
        velocity and acceleration (m, l)."""
        n = len(self._axes)
        rates = []
        for rate in range(3):
            found = self._table.at(t, rate)
            rates.append(
                (found[:n], found[n], found[n + 1 : 2 * n + 1], found[2 * n + 1 :].reshape(n, n, *found.shape[1:]))
            )
        (x, z, xz, xx), (u, w, uz, ux), (a, b, az, ax) = rates

        def along(v, gradient):
            return np.einsum("emn,demn->dmn", v, gradient)

        return (
            x + 0.5 * (along(x, xx) - z * xz),
            u + 0.5 * (along(u, xx) + along(x, ux) - w * xz - z * uz),
            a + 0.5 * (along(a, xx) + 2 * along(u, ux) + along(x, ax) - b * xz - 2 * w * uz - z * az),
            w,
            b,
        )


# ------------------------------------------------------------------------------------------ waves of each sort


def linear_waves(amplitude: np.ndarray, omega: np.ndarray, phase: np.ndarray, depth: float, g: float) -> IncidentWaves:
    """A sum of linear waves of amplitudes (n,) [m]."""
    k = np.array([wavenumber(w, depth, g) for w in omega])
    drift = float(return_flow(amplitude, k, omega, depth, g).sum())
    return IncidentWaves(amplitude, amplitude * g / omega**2, k, omega, phase, depth, g, drift=drift)


def stokes_wave(height: float, period: float, depth: float, g: float) -> IncidentWaves:
    """A wave by Stokes' third order (Fenton 1985, table 1) in a closed tank, where the return flow carries it back."""
    w = 2 * math.pi / period
    k = wavenumber(w, depth, g)
    for _ in range(60):
        steepness, s, c0 = 0.5 * k * height, 1 / math.cosh(2 * k * depth), math.sqrt(math.tanh(k * depth))
        rest = 8 * (1 - s) ** 3
        b31 = -3 * (1 + 3 * s + 3 * s**2 + 2 * s**3) / rest
        first = (steepness + steepness**3 * b31) / k
        speed = math.sqrt(g / k) * c0 * (1 + steepness**2 * (2 + 7 * s * s) / (4 * (1 - s) ** 2))
        k = w / (speed + return_flow(first, k, w, depth, g))
    kd = k * depth
    a31, a33 = (-4 - 20 * s + 10 * s**2 - 13 * s**3) / rest, (-2 * s**2 + 11 * s**3) / rest  # times sinh kd
    a22, b22 = 3 * s**2 / (2 * (1 - s) ** 2), (1 + 2 * s) / (2 * (1 - s)) / math.tanh(kd)
    eta = np.array([steepness + steepness**3 * b31, steepness**2 * b22, -(steepness**3) * b31]) / k
    phi = steepness + steepness**3 * a31, steepness**2 * a22 * math.sinh(kd), steepness**3 * a33
    n = np.array([1, 2, 3])
    return steady_waves(eta, c0 * math.sqrt(g / k) / math.sinh(kd) * n * np.cosh(n * kd) * phi, k, w, depth, g)


def steady_waves(elevation, speed, k: float, omega: float, depth: float, g: float) -> IncidentWaves:
    """A wave of permanent form with a crest at s = 0 at t = 0, by its wavenumber, frequency and the amplitudes (n,) of the
    harmonics of its elevation [m] and of its horizontal velocity at the still water level [m/s]."""
    n = np.arange(1, len(elevation) + 1)
    drift = return_flow(elevation[0], k, omega, depth, g)
    potential, none = speed / (n * k) / (n * omega), np.zeros(len(n))
    return IncidentWaves(elevation, potential, n * k, n * omega, none, depth, g, drift=drift, steady=True)


def return_flow(a, k, omega, depth: float, g: float):
    """Mean velocity [m/s] under waves of amplitude a [m] in a closed tank against Stokes drift, -g a^2 k / (2 omega d)."""
    return -0.5 * g * a * a * k / (omega * depth)
