"""Wrong results that targets have to catch: for each measure one that an engineer would call wrong, and the error that it
gives.

A target that lets it pass says nothing, whatever the rows are; `tests/validation/test_targets.py` goes through all of them.
A case states its own in `fails_when`; the others are those of measures of that name, here. Relative ones are small on
purpose: an answer half as large again must never be needed to miss a target.
"""

from __future__ import annotations

import math

from cases.validation.engine.case import Case, Wrong

LARGEST = 0.5  # of a relative error that stands for a wrong result
COUNTED = (  # measures that are no share of an answer: counts, shares of a limit, what has not moved at all
    "unstable_cells", "stays_in_water", "fastest_point", "step_share", "standing",
)  # fmt: skip

QUARTER = Wrong("a quarter too much or too little", 0.25)
TENTH = Wrong("a tenth too much or too little", 0.1)
PERIOD = Wrong("a twentieth too long or too short: stiffness or mass off by a tenth", 0.05)
ONE = Wrong("one particle of a million leaves the water", 1e-6)
HEAVY = "water of 1025 in place of 1000 kg/m3"
PROFILE = Wrong("a profile a tenth too fast", 0.1 * math.sqrt(8 / 15))  # root mean square of a parabola
LATE = Wrong("0.1 s late", 0.1)

BY_NAME = {
    # answers
    **dict.fromkeys(("height", "wave_height", "elevation", "peak_force", "impulse", "displacement", "theory", "drive",
                     "decay", "front_speed", "pitch_over_linear", "pitch_over_30", "face_pressure_early",
                     "face_pressure_late"), QUARTER),
    **dict.fromkeys(("added_mass", "hydrodynamic_amplitude", "height_over_stroke", "speed", "force_impulse", "tension",
                     "buoyancy", "plug_speed", "steady_centre", "first_stretch", "minor_axis", "major_axis", "decay_rate",
                     "velocity_linf", "Hm0", "peak_period", "p1", "p2", "p3", "p4", "gradient", "laplacian", "integral",
                     "first_moment"), TENTH),
    **{f"p{n}_impulse": QUARTER for n in (1, 2, 3, 4)},
    **dict.fromkeys(("period", "pitch_period"), PERIOD),
    "velocity_l2": PROFILE,
    "plastic_l2": PROFILE,
    "gradient_strewn": Wrong("a fifth too steep", 0.2),
    "eddy_viscosity_l2": Wrong("a quarter too large", 0.25 / math.sqrt(3)),
    "hydrodynamic_phase_deg": Wrong("a phase 20 degrees late", 20.0),
    "damping_kgps": Wrong("twice the damping of the spar at 3 rad/s", 4.0),
    "damping": Wrong("a resistance of a tenth of the inertial force", 0.1),
    "law": Wrong("a slide that stops after 0.45 of 0.6 s", 0.073),
    "velocity": Wrong("nothing slows the wedge", 0.207),
    "crest_height_m": Wrong("a crest a tenth too low", 0.033),
    "dry_fall": Wrong("friction of 0.2 in place of 0.3 on the ramp", 0.1 / 0.7),
    "spreading_short_of_six": Wrong("lower by five in place of six", 1 - 5 / 6),
    # still water
    "pressure_l2": Wrong(HEAVY, 0.025 / math.sqrt(3)),  # root mean square over the depth
    "pressure_linf": Wrong(HEAVY, 0.025),
    "rms_speed": Wrong("water that never comes to rest, at 0.02 sqrt(g H)", 0.02),
    "volume_drift": Wrong("the level creeps by a hundredth of the depth", 0.01),
    "volume": Wrong("the water grows by a twentieth", 0.05),
    "draft": Wrong("half a spacing too deep", 0.5),
    "drift": Wrong("a body that still sinks or an amplitude that still falls by a fifth", 0.2),
    "spread": TENTH,
    "angle": Wrong("two schemes a twentieth apart", 0.05),
    # books
    "energy_rise": Wrong("energy from nowhere, of which the run itself warns", 0.02),
    "energy_created": TENTH,
    "energy_loss": Wrong("a tenth of the energy is lost", 0.1),
    "energy_rate": Wrong("a tenth of the energy is lost in a turn", 0.1),
    "momentum": Wrong("a hundredth of the momentum is missing", 0.01),
    "angular_momentum": Wrong("a millionth of the angular momentum is missing", 1e-6),
    "difference": Wrong("results that depend on the frame", 1e-3),
    "difference_early": Wrong("single precision", 1e-7),
    "speed_gained": Wrong("a body in a fluid at rest gets faster", 0.01),
    "leaks": ONE,
    "mixed": ONE,
    "not_finite": ONE,
    "fluid_in_bodies": ONE,
    "lost": Wrong("a twentieth of the particles is lost", 0.05),
    "asymmetry": Wrong("the water stands a fifth of its radius off the middle", 0.04),
    # waves
    "reflection": Wrong("a fifth of the wave comes back", 0.2),
    "height_loss": Wrong("a tenth of the height is lost", 0.1),
    "wave_loss": Wrong("a tenth of the height is lost", 0.1),
    "wave_loss_far": Wrong("a tenth of the height is lost", 0.1),
    # bodies and stops
    "heave_period": PERIOD,
    "tilt_growth": Wrong("the tilt grows by half", 0.5),
    "sway_m": Wrong("10 mm out of its plane", 0.01),
    "way_m": Wrong("a welded body moves by 10 mm", 0.01),
    "off_ramp_m": Wrong("10 mm off the ramp", 0.01),
    "stop_penetration_m": Wrong("twice as deep as the stop allows", 0.003),
    "soft_stop_penetration_m": Wrong("twice as deep as the stop allows", 0.012),
    "stays_in_water": Wrong("a body that comes up to the surface and no further", 1.0),
    "unstable_cells": Wrong("one density ratio is unstable", 1.0),
    "fastest_point": Wrong("2 m/s, three times what a fall of 20 mm gives", 1.0),
    **{f"step_share_{what}": Wrong("the rule takes the largest stable step", 1.0)
       for what in ("half_depth", "depth", "double_depth", "viscous")},
    # times
    **{f"arrival_h{n}_s": LATE for n in (1, 2, 3)},
    "bore_arrival_s": LATE,
    "peak_time_s": LATE,
}  # fmt: skip


def wrong(case: Case, measure: str) -> Wrong | None:
    """The wrong result that the target of this measure has to catch; None where nobody has named one."""
    return case.fails_when.get(measure, BY_NAME.get(measure))
