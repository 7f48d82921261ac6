"""Linear theory of the float and plate by Capytaine, into `wec.nc`: those of a slice of 1 m out of bodies 15 m long."""

import capytaine
import numpy as np
import xarray

LENGTH, PERIODS = 15.0, np.linspace(1.0, 2.6, 9)  # m, s


def prism(name, beam, height, z, density):
    size, panels = (beam, LENGTH, height), (6, 24, 3)
    mesh = capytaine.mesh_parallelepiped(size=size, center=(0, 0, z), resolution=panels, name=name)
    body = capytaine.FloatingBody(mesh=mesh.immersed_part(), center_of_mass=(0, 0, z), name=name)
    body.add_translation_dof(name="Heave")
    body.inertia_matrix = body.add_dofs_labels_to_matrix(np.array([[density * beam * LENGTH * height]]))
    body.hydrostatic_stiffness = body.compute_hydrostatic_stiffness(rho=1000.0)
    return body


bodies = prism("float", 0.6, 0.36, 0.0, 500.0) + prism("plate", 0.9, 0.12, -0.9, 1000.0)
wanted = {
    "omega": 2 * np.pi / PERIODS,
    "wave_direction": [0.0],  # of a flume
    "radiating_dof": list(bodies.dofs),
    "water_depth": [np.inf],
    "rho": [1000.0],
}
data = capytaine.BEMSolver().fill_dataset(xarray.Dataset(coords=wanted), bodies)
for name in data.data_vars:
    if name.endswith(("_mass", "_damping", "_force", "_matrix", "_stiffness")):
        data[name] = data[name] / LENGTH
capytaine.export_dataset("wec.nc", data)
