import numpy as np
import pytest

from bodies import load
from fsi.scene.model import BodyFile, Scene, Tank


class LinearFluid:
    """A fluid of known added mass: wrench = base - matrix @ acceleration of the bodies (b, 6); its pressure field is
    that acceleration itself."""

    def __init__(self, matrix, base):
        self.matrix, self.base, self.field, self.solutions = matrix, np.atleast_2d(base).astype(float), None, 0

    def pressure(self, acceleration):
        self.field = acceleration.copy()
        return self.base - self._reaction(acceleration)

    def respond(self, acceleration, units):
        self.solutions += len(units)
        return self.pressure(acceleration), units.copy(), -np.array([self._reaction(each) for each in units])

    def add(self, response, factor):
        self.field = self.field + factor * response

    def _reaction(self, acceleration):
        return (self.matrix @ acceleration.ravel()).reshape(acceleration.shape)


@pytest.fixture
def make_bodies(tmp_path):
    """MJCF of a world to a loaded BodySet, spacing 0.05 m, no gravity unless asked for."""

    def make(world, *, dimension=3, gravity=0.0, option='timestep="0.01"', **scene):
        path = tmp_path / "body.xml"
        gravity_option = f'gravity="0 0 {-gravity}"'
        path.write_text(f"<mujoco><option {option} {gravity_option}/><worldbody>{world}</worldbody></mujoco>")
        tank = Tank(min=(-9,) * dimension, max=(9,) * dimension)
        files = {"body": BodyFile(mjcf=path)}
        return load(
            Scene(spacing=0.05, duration=1, dimension=dimension, gravity=gravity, tank=tank, bodies=files, **scene)
        )

    return make


@pytest.fixture
def linear_fluid():
    return LinearFluid


@pytest.fixture
def without_reserve(monkeypatch):
    """The default scheme without the reserve of very light bodies, for what is to be exact in every step."""
    monkeypatch.setattr("couplers.added_mass.LIGHT", np.inf)
