"""A hinged flap in a wave flume: a body written in MJCF, regular waves, and the pitch that comes out."""

import sys

import numpy as np

import fsi

PERIOD = 1.8  # s

scene = fsi.Scene(
    name="flap",
    spacing=0.02,
    duration=15.0,
    tank={"min": (0.0, -0.7), "max": (10.0, 0.5)},  # z = 0 is the still water level
    waves={"wave_height": 0.1, "period": PERIOD},  # a piston at x = 0
    damping=[{"start": 7.0, "end": 10.0}],  # a beach
    gauges={"front": {"x": 3.0}},
    bodies={"flap": {"mjcf": "package://bodies/models/surge_flap.xml", "position": (4.0, 0.0, 0.0)}},
)

if __name__ == "__main__":
    until = float(sys.argv[1]) if len(sys.argv) > 1 else scene.duration
    run = fsi.run(scene, until=until)
    data = run.load()
    pitch = np.degrees(data.joint_position.sel(joint="hinge"))
    last = pitch[data.time > until - 2 * PERIOD]
    power = data.pto_power.sel(joint="hinge")[data.time > until - 2 * PERIOD]
    print(f"pitch over the last two periods: {float(last.min()):.1f} to {float(last.max()):.1f} degrees")
    print(f"mean absorbed power: {float(power.mean()):.2f} W; open the run with: fsi view {run.folder}")
    assert abs(last).max() < 60 and run.status == "done"
