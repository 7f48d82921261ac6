"""A submerged slide on Heinrich's ramp held in five ways: one, two and three layers of fluid glued to its face, contact alone,
and a prescribed way.

The slide is that of `slide_submarine` (Heinrich 1992). Without friction all have about the way of a rigid body with the
added mass and the drag of `coupling.slide`; glued fluid takes part with its mass, so that every layer slows the slide, the
less the finer. The source glues one layer. `*_way`: way after 0.4 s over that of the theory with the mass of the layers, less
1; `prescribed_drive`: what leads the slide on the way of the theory, over its weight in water along the ramp;
`slowed_by_layers`: by how much a way with more layers is longer than one with fewer, as a share of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cases.validation.bodies.slide_submarine import PULL, S, Way
from cases.validation.coupling.slide import way_of
from cases.validation.engine.case import Case, Wrong
from cases.validation.engine.scenes import builder, spacings
from cases.validation.engine.several import runs

LAYERS = {"one": 1, "two": 2, "three": 3}
TIME, END = 0.4, 0.6  # of the comparison, of the runs [s]


def variants(spacing: float, folder: Path) -> dict[str, dict]:
    """Scenes by the way the slide is held; layers keep it off the ramp by their thickness."""
    scenes = {
        name: builder(f"slide_submarine_{name}")(spacing, folder) | {"duration": END}
        for name in ("contact", "prescribed", "glued")
    }
    glued = scenes.pop("glued")
    for name, layers in LAYERS.items():
        slide = glued["bodies"]["slide"] | {"glued_layers": layers, "position": [layers * spacing / S, 0.0, 0.0]}
        scenes[name] = glued | {"bodies": glued["bodies"] | {"slide": slide}}
    return scenes


def way(seen: Way) -> float:
    """Way after `TIME` [m]."""
    return float(np.interp(TIME, seen.time, seen.way))


def judge(seen: Mapping[str, Way]) -> dict[str, float]:
    """Ways over those of the theory, and their order."""
    ways = {name: way(seen[name]) for name in ("contact", *LAYERS)}
    errors = {f"{name}_way": s / float(way_of(np.array([TIME]), seen[name].glued)[0]) - 1 for name, s in ways.items()}
    fewer, more = (ways["contact"], ways["one"], ways["two"]), (ways["one"], ways["two"], ways["three"])
    return errors | {
        "slowed_by_layers": max(0.0, *(b / a - 1 for a, b in zip(fewer, more, strict=True))),
        "prescribed_drive": seen["prescribed"].drive() / PULL,
        "leaks": float(sum(one.leaks for one in seen.values())),
    }


QUARTER = Wrong("a slide that carries a quarter less of its weight in water", 0.25)

NAMES = ("slide_layers",)
CASES = {
    "slide_layers": Case(
        "slide_layers",
        "A triangular slide on a ramp of 45 degrees under water: one to three glued layers, contact, a prescribed way",
        "Rigid-body theory with the added mass of potential flow and the drag of a plate, glued fluid by its mass; way after"
        " 0.4 s. Case of Heinrich (1992).",
        spacings("slide_submarine_glued"), builder("slide_submarine_glued"), None,
        {
            "contact_way": 0.05, "one_way": 0.1, "two_way": 0.1, "three_way": 0.1, "slowed_by_layers": 0.01,
            "prescribed_drive": 0.1, "leaks": 0.0,
        },
        "A layer at 25 mm is a fourteenth of the slide's height across the ramp: 12, 14 and 20 % short with one, two and three;"
        " at 12.5 mm 5, 9 and 9 %. Theory counts the mass of the layers and not that they make the body larger.",
        run=runs(variants, Way, judge),
        fails_when={f"{name}_way": QUARTER for name in ("contact", *LAYERS)} | {
            "slowed_by_layers": Wrong("layers that push the slide on, by a twentieth of its way", 0.05),
            "prescribed_drive": QUARTER,
        },
    )
}  # fmt: skip
