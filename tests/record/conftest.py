import sys
from types import ModuleType

import pytest
import stand_in

from fsi.scene.model import Gauge, Probe, Scene, Tank


@pytest.fixture
def solver(monkeypatch):
    """The stand-in in the place of `fsi.simulation.loop`; its class, to be altered."""
    module = ModuleType("fsi.simulation.loop")
    module.Simulation = type("Simulation", (stand_in.Simulation,), {})
    monkeypatch.setitem(sys.modules, "fsi.simulation.loop", module)
    return module.Simulation


@pytest.fixture
def scene():
    return Scene(
        name="small",
        spacing=0.02,
        duration=1.0,
        tank=Tank(min=(0, -0.5), max=(2, 0.5)),
        gauges={"near": Gauge(x=0.5), "far": Gauge(x=1.5)},
        probes={"wall": Probe(position=(0.1, -0.2))},
        output={"timeline": False},
    )


@pytest.fixture
def flap():
    return stand_in.Flap()
