"""Instruments that cannot read anything are refused, with the key and the way out."""

import pytest

from fsi.errors import SceneError
from fsi.scene.file import load_scene

FAULTS = {
    "gauges.a={x = 99.0}": "gauges.a.x: 99 m is outside the tank",
    "depths.a={x = 99.0}": "depths.a.x: 99 m is outside the tank",
    "gauges.a={x = 0.1, reading = 'sonar'}": "gauges.a.reading",
    "probes.a={}": "needs either a position or a site",
    "probes.a={position = [0.1, -0.1], site = 's'}": "needs either a position or a site",
    "probes.a={site = 's', body = 'b'}": "leave the body out",
    "probes.a={site = 's'}": "probes.a.site: the scene has no bodies",
    "probes.a={position = [0.1, 9.0]}": "probes.a.position: .* is outside the tank",
    "velocimeters.a={position = [0.1, 0.1, 0.1]}": "velocimeters.a.position: .* 3 components in 2 dimensions",
    "velocimeters.a={position = [0.1, -0.1], end = [0.1, 9.0]}": "velocimeters.a.end: .* is outside the tank",
    "fluxes.a={min = [0.1, -0.1], max = [0.2, 0.1]}": "the same on exactly one axis",
    "fluxes.a={min = [0.1, 0.1], max = [0.1, -0.1]}": "must lie below max",
    "fluxes.a={min = [99.0, -0.1], max = [99.0, 0.1]}": "fluxes.a: lies outside the tank",
    "runups.a={start = [0.1, 0.2], end = [0.3, 0.2]}": "runups.a.start: .* has 2 components, not 1",
    "runups.a={start = [0.1], end = [0.1]}": "runups.a: start and end are the same place",
    "runups.a={start = [0.1], end = [99.0]}": "runups.a.end: .* is outside the tank",
    "areas.a={min = [0.3], max = [0.1]}": "must lie below max",
    "areas.a={min = [0.1], max = [99.0]}": "areas.a.max: .* is outside the tank",
    "loads.a={}": "needs `on`, or a box",
    "loads.a={min = [0.0, 0.0]}": "only one of min and max",
    "loads.a={min = [0.1, 0.1], max = [0.0, 0.2]}": "must lie below max",
    "loads.a={on = 'z+'}": "loads.a.on: the tank has no wall 'z.'",
    "loads.a={on = 'bathymetry'}": "loads.a.on: the scene has no bathymetry",
    "loads.a={on = 'x+', about = [0.0, 0.0, 0.0]}": "loads.a.about: .* 3 components in 2 dimensions",
}


@pytest.mark.parametrize("given, told", FAULTS.items(), ids=FAULTS)
def test_fault_is_told(scene_file, given, told):
    with pytest.raises(SceneError, match=told):
        load_scene(scene_file(), [given])


def test_the_piston_has_no_load_of_its_own(scene_file):
    waves = ["waves.wave_height=0.1", "waves.period=1.5", "loads.a={on = 'x-'}"]
    with pytest.raises(SceneError, match=r"loads\.a\.on: the wall x- is the piston, which moves"):
        load_scene(scene_file(), waves)
