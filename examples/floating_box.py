"""A box of half the water's density, free in six degrees of freedom, comes to rest at Archimedes' draft."""

import sys

import fsi

SIDE, HEIGHT, DENSITY = 0.4, 0.24, 500.0
DRAFT = DENSITY / 1000.0 * HEIGHT
BOX = f"""<mujoco>
  <option timestep="0.01" integrator="implicitfast"/>
  <worldbody>
    <body name="box" pos="0 0 {HEIGHT / 2 - DRAFT + 0.05}">
      <freejoint/>
      <geom type="box" size="{SIDE / 2} {SIDE / 2} {HEIGHT / 2}" density="{DENSITY}"/>
    </body>
  </worldbody>
</mujoco>"""

if __name__ == "__main__":
    with open("floating_box.xml", "w") as file:
        file.write(BOX)
    scene = fsi.Scene(
        name="floating_box",
        dimension=3,
        spacing=0.04,
        duration=float(sys.argv[1]) if len(sys.argv) > 1 else 6.0,
        tank={"min": (-0.8, -0.8, -0.48), "max": (0.8, 0.8, 0.4)},
        bodies={"box": {"mjcf": "floating_box.xml"}},
    )
    run = fsi.run(scene)
    height = run.load().body_position.sel(body="box", axis="z")
    draft = HEIGHT / 2 - float(height[len(height) // 2 :].mean())
    print(f"draft {draft:.3f} m over the second half of the run; Archimedes, in an endless sea: {DRAFT:.3f} m")
    assert abs(draft - DRAFT) < 0.05
