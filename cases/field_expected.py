"""What inputs that users met are expected to answer, for `cases.field_report`: of the check, and of a run in figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from xarray import Dataset

REST = 0.02  # largest speed at the end of a run of water at rest [sqrt(g H)]
REFUSED = 2  # exit code of input that is wrong


@dataclass(frozen=True)
class Figure:
    """A figure of a run that must lie between `low` and `high`."""

    what: str
    of: Callable[[Dataset], float]
    low: float
    high: float


@dataclass(frozen=True)
class Expected:
    """`code`: exit code of `fsi check`, of a study that of the study; `says`: words that the answer holds; `until`: simulated
    time [s] of the run, 0 for none; `run`: how it ends; `rest`: water that stays at rest; `figures`: of the run."""

    code: int = 0
    says: tuple[str, ...] = ()
    until: float = 0.2
    run: str = "done"
    rest: bool = False
    figures: tuple[Figure, ...] = field(default=())

    @property
    def words(self) -> str:
        """The expectation in a line."""
        if self.code:
            return f"{'refused' if self.code == REFUSED else 'points fail'}: {'; '.join(self.says)}"
        said = [f"says {'; '.join(self.says)}"] if self.says else []
        ends = [self.run if self.run != "done" else "", "at rest" if self.rest else "", *(f.what for f in self.figures)]
        return ", ".join([*said, *filter(None, ends)]) or "runs"


def refused(*says: str) -> Expected:
    return Expected(REFUSED, says)


def says(*words: str, **more) -> Expected:
    return Expected(says=words, **more)


def rest(until: float, *figures: Figure) -> Expected:
    return Expected(until=until, rest=True, figures=figures)


def gauges(tolerance: float, *dry: str) -> Figure:
    """Every gauge reads the still water level, to a tolerance [m], but for those that are `dry` and read nan."""

    def worst(data: Dataset) -> float:
        wet = data.elevation.sel(gauge=[name for name in data.gauge.values if name not in dry])
        return math.inf if np.isnan(wet).any() else float(abs(wet).max())

    return Figure(f"gauges 0 within {1e3 * tolerance:g} mm", worst, 0.0, tolerance)


def mean_level(gauge: str, start: float, tolerance: float) -> Figure:
    """The mean elevation [m] at a gauge from `start` [s] on."""
    return Figure(
        f"mean level at {gauge}", lambda d: float(d.elevation.sel(gauge=gauge, time=slice(start, None)).mean()),
        -tolerance, tolerance,
    )  # fmt: skip


def probe(name: str, value: float, share: float = 0.02) -> Figure:
    """The pressure [Pa] of a probe at the start."""
    what = f"{value:.0f} Pa at {name} at the start"
    low, high = (1 - share) * value, (1 + share) * value
    return Figure(what, lambda d: float(d.pressure.sel(probe=name)[0]), low, high)


def placed(body: int, axis: str, value: float, tolerance: float = 1e-3, at: int = 0, what: str = "position") -> Figure:
    """Place [m] or another series of a body at the start, or at the end (`at` = -1)."""
    return Figure(
        f"{what} {axis} = {value:g} at the {'end' if at else 'start'}",
        lambda d: float(d[f"body_{what}"].isel(body=body, time=at).sel(axis=axis)), value - tolerance, value + tolerance,
    )  # fmt: skip


def extreme(what: str, low: float, high: float, of: Callable[[Dataset], np.ndarray]) -> Figure:
    """A series that stays between `low` and `high`: its value farthest from the middle."""

    def farthest(data: Dataset) -> float:
        values = np.asarray(of(data))
        return float(values.flat[np.argmax(np.abs(values - 0.5 * (low + high)))])

    return Figure(what, farthest, low, high)


def kept(share: float = 0.0) -> Figure:
    """No more than a share of the particles is lost."""
    return Figure(
        "nothing lost" if not share else f"at most {share} lost", lambda d: float(d.lost_particles[-1]), 0, share
    )


FLAG, LOOKS, TWICE = "flag {} is disabled", "touches nothing, as one for looks", "sets what parameters.a sets"
HULL = (("as drawn: mass 13.2 kg, displaces 14.9 kg, draft 0.151 m"),)
HYDROSTATIC = (probe("low", 4905.0), probe("mid", 2452.5))
TABLE = "F17/t.toml with {}.csv"

EXPECTED: Mapping[str, Expected] = {
    "F01/scene.toml": says(
        "'one/arm' as drawn: mass 4.8 kg", "heel 11 degrees", "'two/arm' as drawn: mass 9.6 kg", "heel 10 "
    ),
    "F02/one.toml": Expected(figures=(placed(0, "x", 1.0), placed(0, "z", 0.05), placed(0, "x", 0.4, what="velocity"))),
    "F02/two.toml": Expected(
        figures=(placed(0, "x", 1.0), placed(0, "z", 0.05), placed(1, "x", 3.0), placed(1, "z", 0.0))
    ),
    "F02/inside.toml": Expected(figures=(placed(0, "x", 2.5), placed(0, "z", 0.05))),
    "F03/a.toml": says("'buoy' as drawn: mass 9 kg"),
    "F03/ab.toml": says("'a/buoy' as drawn: mass 9 kg", "'b/barge' as drawn: mass 9 kg, displaces 6 kg"),
    "F03/b.toml": says("'barge' as drawn: mass 9 kg, displaces 6 kg"),
    "F04/clash.toml": says("'body1' as drawn: mass 4 kg"),
    "F04/replicate.toml": says("'float0' as drawn: mass 6 kg", "'float2' as drawn: mass 6 kg"),
    "F05/bigger.toml": says(LOOKS),
    "F05/mast.toml": refused("beyond the tank's z = 0.6 m", LOOKS),
    "F05/visual.toml": says(LOOKS, "mass 9 kg, displaces 9 kg"),
    **{f"F06/{flag}.toml": says(FLAG.format(flag)) for flag in ("constraint", "contact", "limit", "spring")},
    "F06/energy.toml": Expected(),
    "F06/gravity.toml": refused("flag gravity is disabled where the scene has 9.81 m/s2"),
    "F06/passive.toml": refused("unrecognized attribute: 'passive'"),
    **{
        f"F07/{mesh}.toml": says("'buoy' as drawn: mass 9 kg, displaces 9 kg")
        for mesh in ("good", "inside_out", "offset_origin", "quads", "solid_header")
    },
    **{f"F07/{mesh}.toml": refused("perhaps this is an ASCII file", "export") for mesh in ("ascii", "multi_ascii")},
    **{
        f"F07/{mesh}.toml": refused("not watertight", "repair") for mesh in ("dup_faces", "hole", "noisy", "t_junction")
    },
    **{f"F07/{mesh}.toml": refused("300 m long", 'scale="0.001') for mesh in ("mm", "mm_3d", "mm_box")},
    **{
        f"F07/{mesh}.toml": refused("parts of its mesh overlap", "unite")
        for mesh in ("overlapping", "overlapping_deep")
    },
    "F07/catamaran.toml": says("'buoy' as drawn: mass 6 kg"),
    "F07/cm.toml": refused("beyond the tank's z = -0.6 m"),
    "F07/hollow.toml": says("is hollow: its mesh encloses a cavity of 0.00806 m3, which stays dry"),
    "F07/one_flipped.toml": refused("triangles face different ways"),
    "F08/beach.toml": rest(2.0, kept()),
    "F08/beach_beside.toml": refused("lies beside the tank", "move it"),
    "F08/beach_inside_out.toml": rest(2.0, kept()),
    "F08/beach_mm.toml": refused("if the file is in millimetres, scale it by 0.001"),
    "F08/two_ascii.toml": rest(2.0, kept()),
    "F09/barge.toml": says("starts with 0.105 m2 of water inside", "dry_inside = true", until=0.5),
    "F09/barge_dry.toml": Expected(until=4.0, figures=(kept(), placed(0, "z", 0.0855, 0.03, at=-1))),
    "F11/ball.toml": Expected(  # 1 % of its weight moves it by 33 mm in a second, with the added mass
        until=1.0, figures=(kept(), placed(0, "x", 0.0, 0.01, -1), placed(0, "z", -0.45, 0.033, -1))
    ),
    "F12/buoy.toml": Expected(
        until=6.0, figures=(kept(), extreme("joint within its range", -0.033, 0.033, lambda d: d.joint_position))
    ),
    "F13/rm3.toml": Expected(
        until=6.0,
        figures=(kept(), Figure("absorbs power", lambda d: float(d.pto_power[:, -1].mean()), 1e-3, 20.0)),
    ),
    "F14/owc.toml": Expected(
        until=4.0,
        figures=(
            kept(),
            Figure("chamber starts 80 mm high", lambda d: float(d.elevation.sel(gauge="inside")[0]), 0.078, 0.082),
            Figure("period of the chamber", lambda d: chamber_period(d), 1.25, 1.6),
        ),
    ),
    "F15/slosh.toml": Expected(
        until=6.0,
        figures=(
            kept(),
            probe("floor", 2845.0),
            Figure(  # linear sloshing of the first four modes under this motion, ramp included: 11.8 mm
                "wave at the wall", lambda d: 0.5 * float(np.ptp(d.elevation.sel(gauge="right").values)), 0.0107, 0.013
            ),
        ),
    ),
    "F16/awas.toml": Expected(
        until=45.0, figures=(kept(), *(mean_level(name, 45.0 - 3 * 4.03, 0.004) for name in ("g2", "g5", "g8")))
    ),
    "F17/t.toml": Expected(),
    **{TABLE.format(name): Expected() for name in ("good", "bom", "crlf", "blank")},
    TABLE.format("late"): says("has no effect: its first row is at 5 s", until=0),
    TABLE.format("backwards"): refused("row 3, column time"),
    TABLE.format("cm"): refused("row 1, column time: is in ms"),
    TABLE.format("nan"): refused("row 3, column position: nan"),
    TABLE.format("noheader"): refused("row 1: has numbers"),
    TABLE.format("repeat"): refused("row 4, column time"),
    TABLE.format("semicolon"): refused("row 2: '0;0' has its columns between semicolons"),
    TABLE.format("short"): refused("has 2 rows of numbers"),
    TABLE.format("tabs"): refused("columns between tabs"),
    TABLE.format("three"): refused("row 2: has 3 columns"),
    TABLE.format("twoheads"): refused("row 2, column time: '[s]' is not a number"),
    TABLE.format("utf16"): refused("is not UTF-8 text"),
    "F18/still.toml": refused("probes.in_column", "probes.ground", "inside a solid"),
    "F18/still.toml, probes in solids left out": says(
        "gauges in_column, dry, end: no free surface there at the start",
        until=1.5,
        rest=True,
        figures=(
            gauges(0.0025, "in_column", "dry", "end", "waterline"),
            *(
                probe(name, 9810 * depth, 0.03)
                for name, depth in (("mid", 0.3), ("floor", 0.6), ("corner", 0.6), ("wall", 0.3))
            ),
        ),
    ),
    "F20/block.toml": says("it sinks", until=1.0, run="failed: has left the tank through its z- wall"),
    "F20/block_bed.toml": Expected(until=1.5, figures=(kept(), placed(0, "z", -0.4, 0.01, at=-1))),
    "F22/plunger.toml": Expected(
        until=5.0,
        figures=(
            kept(),
            Figure(
                "left as right",
                lambda d: float(abs(d.elevation.sel(gauge="l1").values - d.elevation.sel(gauge="r1").values).max()),
                0.0,
                0.006,
            ),
        ),
    ),
    "F23/names.toml": Expected(
        figures=(Figure("sensor by its name", lambda d: float("wave.pos;1" in d.sensor.values), 1, 1),)
    ),
    "F24/tiny.toml": says("1.0 particles over the wave height"),
    "F24/s_bool.toml": Expected(),
    "F24/s_logzero.toml": refused("min = 0 has no logarithm"),
    "F24/s_mjcf.toml": Expected(1, ("1 of 2 runs failed",)),
    "F24/s_nan.toml": refused("values hold nan"),
    "F24/s_neg.toml": Expected(1, ("1 of 2 runs failed",)),
    "F24/s_one.toml": refused("parameters.c.count"),
    "F24/s_optdup.toml": Expected(),
    "F24/s_repeat.toml": refused("a value stands twice"),
    "F24/s_samekey.toml": refused(TWICE),
    "F24/s_space.toml": refused("cannot be the name of a parameter"),
    "F24/s_status.toml": refused("cannot be the name of a parameter"),
    "F24/s_text.toml": Expected(),
    **{f"F25/{name}.toml": rest(0.5, kept(), *HYDROSTATIC) for name in ("one", "side", "two")},
    "F26/walls.toml": Expected(until=0.1, figures=(gauges(0.002),)),
    "F26/corner3d.toml": Expected(until=0.05, figures=(gauges(0.003),)),
    "F26/periodic.toml": Expected(until=0.05, figures=(gauges(0.002),)),
    "F28/plain.toml": says(*HULL, figures=(placed(0, "x", 1.225, 2e-3),)),
    "F28/mirror.toml": says(*HULL, figures=(placed(0, "x", 1.275, 2e-3),)),
    "F28/ref.toml": says(*HULL, figures=(placed(0, "x", 1.225, 2e-3),)),
    "F29/attach.toml": says(
        "'a_buoy' as drawn: mass 6 kg", "'b_buoy' as drawn: mass 6 kg", until=1.0, figures=(kept(),)
    ),
    "F29/cable.toml": Expected(until=1.0, figures=(kept(), placed(0, "z", 0.0, 0.05, at=-1))),
    "F29/include.toml": says("'buoy' as drawn: mass 6 kg", until=1.0, figures=(kept(),)),
    "F30/boat.toml": Expected(
        until=4.0,
        figures=(
            kept(),
            placed(0, "x", 0.8, what="velocity"),
            placed(0, "x", 0.15, 0.25, -1, "velocity"),
            extreme("boat stays afloat", -0.06, 0.06, lambda d: d.body_position.isel(body=0).sel(axis="z")),
        ),
    ),
    "F31/f.toml": says("is not run by a check", until=0.4),
    **{
        f"F31/f.toml, function {name}": Expected(until=0.4, run=f"failed: {fault}")
        for name, fault in (
            ("none", "TypeError"),
            ("array", "TypeError"),
            ("isnan", "returned nan"),
            ("boom", "ZeroDivisionError"),
            ("two", "TypeError"),
        )
    },
    **{f"F31/f.toml, function {name}": Expected(until=0.4) for name in ("integer", "text")},
    "F31/t.toml": Expected(until=0.4),
    "F31/t.toml with nan.csv": refused("row 3, column force: nan"),
    "F31/t.toml with nohead.csv": refused("row 1: has numbers"),
    "F31/t.toml with ok.csv": Expected(until=0.4),
    "F31/t.toml with semi.csv": refused("columns between semicolons"),
    "F31/t.toml with wrongsign.csv": says("drives the joint", until=0),
    "F32/steep.toml": says(
        "at which such waves break", until=10.0, figures=(kept(), *(mean_level(name, 4.0, 0.01) for name in "ab"))
    ),
    "F35/out.toml": refused("lies outside the tank: x = 249.9 to 250.1 m"),
    "bed/A.toml": rest(5.0, kept()),
    "bed/coincident.toml": rest(2.0, kept()),
    "bed/dry.toml": refused("water would pass through 'wall'", '<tuple name="wet">'),
    "bed/half.toml": rest(2.0, kept()),
    "bed/inside.toml": rest(2.0, kept()),
    "bed/min.toml": rest(1.0, kept()),
    "bed/plant_mini.toml": Expected(until=0),
    "house/depth.toml": says("waves are made for the 0.4 m of water there", until=1.0),
    "house/sparse.toml": Expected(until=0.1, figures=(kept(),)),
    "level/key.toml": Expected(until=0.01, figures=(placed(0, "z", 0.2), placed(0, "z", -2.0, 0.1, what="velocity"))),
    "level/key2.toml": Expected(
        until=0.01,
        figures=(
            placed(0, "z", 0.2),
            placed(0, "z", -2.0, 0.1, what="velocity"),
            placed(1, "x", 0.3),
            placed(1, "z", 0.2),
        ),
    ),
    "level/still.toml": rest(0.05, gauges(0.0015)),
    **{f"level/still.toml, floor at {z} m": rest(0.05, gauges(0.0015)) for z in (-0.453, -0.4575)},
    "u2/fish.toml": refused("no file", "ctl.py"),
}

VARIANTS: Mapping[str, tuple[str, ...]] = {  # inputs that are a scene under other settings
    "F18/still.toml, probes in solids left out": ("probes.in_column=", "probes.ground="),
    **{
        f"F31/f.toml, function {name}": (f'bodies.buoy.pto.function="{{folder}}/laws.py:{name}"',)
        for name in ("none", "array", "isnan", "boom", "text", "two", "integer")
    },
    **{f"level/still.toml, floor at {z} m": (f"tank.min[1]={z}",) for z in (-0.453, -0.4575)},
}


def chamber_period(data: Dataset) -> float:
    """Period [s] of the level in a chamber that is let go from above: twice the time between its first two crossings of
    still water, nan where it does not cross twice."""
    eta, time = data.elevation.sel(gauge="inside").values, data.time.values
    crossings = np.flatnonzero(np.diff(np.signbit(eta)))
    return 2 * float(time[crossings[1]] - time[crossings[0]]) if len(crossings) > 1 else math.nan


def disagreements(
    expected: Expected, code: int | None, said: str, run: str, speed: float, data: Dataset | None
) -> list[str]:
    """What an answer lacks of what is expected; `data` of a run that went on to `expected.until`."""
    wrong = [f"exit {code}, not {expected.code}"] if code != expected.code else []
    wrong += [f"does not say {words!r}" for words in expected.says if words not in said]
    if (
        run
        and not run.startswith(expected.run)
        and not (expected.run.startswith("failed: ") and expected.run[8:] in run)
    ):
        wrong.append(f"run {run.partition(':')[0]}, not {expected.run}")
    if data is None:
        return wrong
    if expected.rest and not speed <= REST:
        wrong.append(f"speed {speed:.3g}, not {REST}")
    for figure in expected.figures:
        try:
            value = figure.of(data)
        except (KeyError, IndexError, AttributeError) as fault:  # a series that the run does not have
            wrong.append(f"{figure.what}: {type(fault).__name__}: {fault}")
            continue
        if not figure.low <= value <= figure.high:
            wrong.append(f"{figure.what}: {value:.4g}, not {figure.low:.4g} to {figure.high:.4g}")
    return wrong
