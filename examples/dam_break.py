"""A column of water collapses on a dry bed: no bodies, no MuJoCo. The front runs at up to 2 sqrt(g H) (Ritter 1892)."""

import sys

import numpy as np

import fsi

HEIGHT = 1.0  # m, and half as wide

scene = fsi.Scene(
    name="dam_break",
    spacing=0.02,
    duration=1.2,
    tank={"min": (0.0, 0.0), "max": (2.0, 2.0), "walls": ("x-", "x+", "z-", "z+")},  # with a lid
    fluid={"start": "converged", "blocks": [{"min": (0.0, 0.0), "max": (HEIGHT / 2, HEIGHT)}]},
    probes={"wall": {"position": (2.0, 0.1)}},
)

if __name__ == "__main__":
    until = float(sys.argv[1]) if len(sys.argv) > 1 else scene.duration
    run = fsi.run(scene, until=until)
    data = run.load()
    energy = (data.kinetic_energy + data.potential_energy) / float(data.potential_energy[0])
    speed = float(data.max_speed.where(data.time < 0.45).max()) / np.sqrt(9.81 * HEIGHT)
    print(
        f"energy left {float(energy[-1]):.3f}; front speed {speed:.2f} sqrt(g H); lost {int(data.lost_particles[-1])}"
    )
    print(f"largest pressure on the far wall {float(data.pressure.max()) / 9810:.2f} rho g H")
    assert "mujoco" not in sys.modules and "trimesh" not in sys.modules
    assert float(energy.max()) < 1.001 and speed < 2.2
