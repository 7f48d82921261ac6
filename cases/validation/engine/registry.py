"""Validation: every case measures a run against an exact answer or an experiment.

To add a case, write a module here that holds a `Case` in its `CASES`, and name it below; modules are imported on use.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from importlib import import_module

from cases.validation.engine.case import LEVELS, Case
from cases.validation.engine.solvers import SOLVERS
from fsi.errors import SceneError

MODULES = {
    "fluid.operators": ("kernel_2d", "kernel_3d", "free_2d", "free_3d"),
    "fluid.still_water": ("still_water", "still_water_long", "still_water_3d"),
    "fluid.still_shapes": ("still_step", "still_slope", "still_corner", "still_planes_3d"),
    "fluid.standing_wave": ("standing_wave",),
    "waves.wavemaker": ("wavemaker_0.5", "wavemaker_1", "wavemaker_2", "wavemaker_3", "wave_decay"),
    "waves.solitary_wave": ("solitary_wave",),
    "waves.irregular_sea": ("irregular_sea",),
    "waves.active_absorption": ("active_absorption",),
    "fluid.dam_front": ("dam_front", "dam_energy"),
    "fluid.drop": ("elliptical_drop", "oscillating_drop"),
    "fluid.taylor_green": ("taylor_green",),
    "fluid.poiseuille": ("poiseuille",),
    "fluid.bingham": ("bingham_channel",),
    "fluid.layers": ("two_layers", "layers_100", "water_and_air"),
    "fluid.channels": ("two_liquids_channel", "implicit_viscosity", "eddy_viscosity"),
    "fluid.tall_column": ("column_tall",),
    "fluid.short_box": ("box_short",),
    "fluid.jet_step": ("jet_step",),
    "fluid.frames": ("moving_frame", "turned_frame", "askew_frame", "mirror"),
    "fluid.stability": ("stability",),
    "fluid.violent": (
        "violent_corner",
        "violent_jet",
        "violent_fill",
        "violent_columns",
        "violent_droplet",
        "long_run",
    ),
    "coupling.archimedes": ("archimedes_box", "archimedes_ball", "archimedes_box_3d", "archimedes_ball_3d"),
    "coupling.decay": ("decay_heave_2d", "decay_pitch_2d", "decay_roll_2d", "decay_sphere", "decay_spar"),
    "coupling.forced_heave": ("forced_heave_3", "forced_heave_4", "forced_heave_5"),
    "coupling.agreement": ("schemes_flap",),
    "coupling.stability": ("stability_heave", "stability_flap", "stability_box", "stability_raft"),
    "coupling.added_mass": ("added_mass_annulus", "added_mass_shaken", "added_mass_sphere"),
    "bodies.wedge_entry": ("wedge_entry",),
    "coupling.stiff": ("stiff_mechanisms",),
    "coupling.slams": ("drops_box", "drops_wedge", "plate_slap"),
    "coupling.several": ("float_chain", "mooring", "collision", "light_and_heavy"),
    "coupling.edges": ("zero_gravity", "free_flight", "leave_and_return", "pinned"),
    "coupling.long_run": ("flap_200_periods",),
    "coupling.slide": ("slide_contact", "slide_glued"),
    "waves.scott_russell": ("scott_russell",),
    "bodies.slide_submarine": (
        "slide_submarine",
        "slide_submarine_contact",
        "slide_submarine_glued",
        "slide_submarine_prescribed",
    ),
    "bodies.rigid_slide": (
        "slide_channel",
        "slide_channel_prescribed",
        "slide_basin",
        "slide_basin_prescribed",
        "solitary_channel",
    ),
    "waves.deck": ("deck_overtopping", "deck_waves"),
    "bodies.spars": ("spar", "spar_heave", "spar_free"),
    "bodies.owsc": ("owsc", "owsc_2d", "owsc_2d_surface"),
    "fluid.plain_tanks": ("tank_still", "column_collapse", "dam_tank"),
}
NAMES = tuple(name for names in MODULES.values() for name in names)

__all__ = ["LEVELS", "NAMES", "SOLVERS", "Case", "choose", "load"]


def module_of(name: str) -> str:
    """The module of a case below `cases.validation`."""
    return next(module for module, names in MODULES.items() if name in names)


def load(name: str) -> Case:
    """The case of that name."""
    return import_module(f"cases.validation.{module_of(name)}").CASES[name]


def choose(patterns: tuple[str, ...] | list[str]) -> list[Case]:
    """The cases that these names, groups such as `still_shapes` or `coupling`, or patterns such as `still_*` ask for, all
    of them if there are none.

    Raises SceneError for a pattern that names no case."""
    chosen = set()
    for pattern in patterns:
        groups = [names for module, names in MODULES.items() if f".{pattern}." in f".{module}."]
        found = (
            [pattern] if pattern in NAMES else sum(groups, ()) or [name for name in NAMES if fnmatchcase(name, pattern)]
        )
        if not found:
            raise SceneError(f"no validation case {pattern!r}", key="CASE", fix=f"known are {', '.join(NAMES)}")
        chosen.update(found)
    return [load(name) for name in NAMES if not patterns or name in chosen]
