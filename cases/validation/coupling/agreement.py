"""The default scheme beside the fixed point, on a flap in regular waves over ten periods.

Both runs take the same steps and start alike. `angle`: root mean square of the difference of the flap's angles over the
last five periods, over the amplitude; `cost` is the processor time of the fixed point's steps over that of the default's,
`passes` the pressure updates that it takes a step.
"""

from __future__ import annotations

import time as clock

import numpy as np

from cases.validation.engine.case import Case, Measure
from fsi.scene.binding import bind
from fsi.simulation.loop import Simulation

PERIOD, PERIODS, HEIGHT = 1.4, 10, 0.08  # s, m
MODEL = "package://bodies/models/surge_flap.xml"


class Beside(Measure):
    """Takes each step with the fixed point as well."""

    def begin(self, sim: Simulation) -> None:
        coupler = sim.scene.coupler.model_copy(update={"scheme": "fixed_point"})
        scene = sim.scene.model_copy(update={"coupler": coupler})
        bodies, coupler, ground = bind(scene, scene.name)
        self.twin = Simulation(scene, bodies=bodies, coupler=coupler, ground=ground, threads=sim.threads)
        self.rows, self.seconds, self.own = [], 0.0, clock.process_time()

    def sample(self, sim: Simulation) -> None:
        start = clock.process_time()
        self.default = start - self.own if sim.step_count > 1 else 0.0
        self.twin.step(self.twin.scene.duration)
        if sim.step_count > 1:  # the first step compiles
            self.seconds += clock.process_time() - start
        self.rows.append((sim.time, *(s.bodies.joints()["joint_position"][0] for s in (sim, self.twin)), self.default))
        self.own = clock.process_time()

    def errors(self) -> dict[str, float]:
        self.twin.team.close()
        t, own, twin, seconds = np.array(self.rows).T
        late = t > 0.5 * t[-1]
        amplitude = 0.5 * np.ptp(own[late])
        return {
            "angle": np.sqrt(((own - twin)[late] ** 2).mean()) / amplitude,
            "cost": self.seconds / seconds.sum(),
            "passes": self.twin.coupling()["pressure_updates"],
        }


def _scene(spacing: float, folder) -> dict:
    return {
        "duration": PERIOD * PERIODS,
        "tank": {"min": [0.0, -0.7], "max": [5.0, 0.4]},
        "waves": {"wave_height": HEIGHT, "period": PERIOD},
        "damping": [{"start": 3.4, "end": 5.0}],
        "bodies": {"flap": {"mjcf": MODEL, "position": [2.0, 0.0, 0.0]}},
        "numerics": {"fixed_time_step": 0.15 * spacing},
    }


NAMES = ("schemes_flap",)
CASES = {
    "schemes_flap": Case(
        "schemes_flap",
        f"A hinged flap in regular waves, {PERIODS} periods: added_mass beside fixed_point, 2D",
        "The fixed point, to a tolerance of 1e-6.",
        {"coarse": 0.04, "medium": 0.02, "paper": 0.01},
        _scene, Beside, {"angle": 0.01},
        "the paths of single particles part: 0.1 to 1.2 % where the waves are 0.1 or 0.3 % higher or lower.",
    )
}  # fmt: skip
