"""Small scenes that between them use everything that remembers something between steps: the text of a scene file or a
built-in name, and its settings."""

from cases.bench.identity import CHANNEL, LAYERS, SEA
from cases.bench.rank_trials import OPEN_SEA
from fsi.scene.file import load_scene

CLOSED = """
spacing = 0.05
duration = 1.0
[tank]
min = [0.0, 0.0]
max = [1.0, 0.5]
walls = ["x-", "x+", "z-", "z+"]
[fluid]
still_water_level = 0.5
start = "zero"
"""
FLUME = ("spacing=0.07", "tank.max=[5.0, 0.49]", "tank.min=[0.0, -0.7]", "bodies.flap.position=[2.1, 0.0, 0.0]",
         "gauges.lee.x=3.0", "damping[0].start=4.0", "damping[0].end=5.0", "probes=", "waves.wave_height=0.2")  # fmt: skip
IRREGULAR = ("waves.wave_height=", "waves.period=", "waves.kind=irregular", "waves.Hm0=0.15", "waves.peak_period=1.6")
LATCHING = (
    "bodies.flap.pto.kind=latching",
    "bodies.flap.pto.hold=0.004",
    "bodies.flap.pto.stiffness=1e6",
    "bodies.flap.pto.least_speed=1e-7",
)
OPEN = ("sea.waves.wave_height=0.1", "sea.waves.period=1.2", "sea.zone=0.9")
SCENES = {
    "sea": (
        SEA,
        (
            "spacing=0.06",
            "tank.min=[0.0, -0.5]",
            "tank.max=[3.0, 0.4]",
            "waves.peak_period=1.2",
            "damping[0].start=2.4",
            "damping[0].end=3.0",
            "gauges.front.x=1.0",
        ),
    ),
    "open_sea": (OPEN_SEA, ()),
    "flap_sea": ("flap", (*FLUME[:-1], *IRREGULAR, "waves.absorb=true")),
    "flap_fixed_point": ("flap", (*FLUME, "coupler.scheme=fixed_point")),
    "flap_lagged": ("flap", (*FLUME, "coupler.scheme=lagged")),
    "flap_latching": ("flap", (*FLUME, *LATCHING)),
    "floating_box": ("floating_box", ("spacing=0.075", "tank.min=[-0.8, -0.6, -0.3]", "tank.max=[0.8, 0.6, 0.3]")),
    "floating_box_2d": ("floating_box_2d", ("spacing=0.05",)),
    "box_at_sea": ("floating_box_2d", ("spacing=0.05", "damping=", *OPEN)),
    "slide_contact": ("slide_submarine_contact", ("spacing=0.05", "tank.min=[-0.025, -1]", "tank.max=[3.975, 0.5]")),
    "slide_glued": ("slide_submarine_glued", ()),
    "prescribed": ("slide_submarine_prescribed", ("spacing=0.05", "tank.min=[-0.025, -1]", "tank.max=[3.975, 0.5]")),
    "sand": ("sand_column", ("spacing=0.05",)),
    "layers": (LAYERS, ("spacing=0.04", "duration=1.0")),
    "channel": (CHANNEL, ()),
    "closed": (CLOSED, ()),
    "iisph_box": ("floating_box_2d", ("spacing=0.05", "numerics.solver=iisph")),
    "iisph_source": ("dam_break", ("numerics.solver=iisph", "numerics.density_relaxation=1", "spacing=0.08")),
    "converged": ("dam_break", ("numerics.solver=converged", "numerics.precision=double", "spacing=0.08")),
}


def load(name: str, folder, *more: str):
    """A scene of the table; folder: where to put its file. `more` settings replace its own."""
    source, settings = SCENES[name]
    if "\n" in source:
        file = folder / f"{name}.toml"
        file.write_text(source)
        source = file
    return load_scene(source, [*settings, "output.series=1e-6", *more])
