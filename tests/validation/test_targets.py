"""Every target can be missed: by the wrong result that is named for it, and, where a measure can read a signal without a run,
by that signal made larger, later, or still. The right signal meets them all."""

import contextlib
import math

import numpy as np
import pytest

from cases.validation.bodies import owsc, rigid_slide, slide_submarine, spars, wedge_entry
from cases.validation.coupling import decay, forced_heave, long_run
from cases.validation.engine.case import met
from cases.validation.engine.registry import MODULES, load
from cases.validation.engine.report import unit
from cases.validation.engine.wrong import BY_NAME, COUNTED, LARGEST, wrong
from cases.validation.fluid import (
    channels,
    dam_front,
    drop,
    plain_tanks,
    short_box,
    standing_wave,
    tall_column,
    violent,
)
from cases.validation.theory.wedge_similarity import free_entry
from cases.validation.waves import scott_russell, solitary_wave, wavemaker
from fsi.waves import wavenumber

TURN = math.radians(20)  # of a phase: an engineer would call that late


@pytest.mark.parametrize("name", [name for names in MODULES.values() for name in names])
def test_every_target_catches_a_wrong_result(name):
    case = load(name)
    for measure, target in case.target.items():
        named = wrong(case, measure)
        assert named and named.what, f"{name}: say what wrong result the target of {measure} catches (fails_when)"
        assert not met(named.error, target), f"{name}: {measure} may be {target:g}, which lets pass: {named.what}"
        assert not met(math.nan, target)
        if unit(measure) == "%" and not measure.startswith(COUNTED):
            assert abs(named.error) <= LARGEST, f"{name}: {measure} is said to fail by {named.error:g} only"


def made(kind, **facts):
    """A measure that has seen these facts instead of a run."""
    measure = object.__new__(kind)
    vars(measure).update(facts)
    return measure


def flap(name, factor=1.0, late=0.0, lost=0):
    f, t = owsc.FLAPS[name], np.arange(0, 8 * owsc.PERIOD, 0.02)
    k, linear = wavenumber(owsc.OMEGA, f.depth, 9.81), owsc.linear_pitch(name)
    waves = 0.5 * owsc.HEIGHT * np.cos(k * owsc.GAUGES - owsc.OMEGA * t[:, None])
    pitch = factor * owsc.EXPERIMENT * np.cos(owsc.OMEGA * t - late)
    return made(owsc.Pitch, time=t, pitch=pitch, level=np.pad(waves, ((0, 0), (0, 1))), before=owsc.GAUGES, leaks=lost,
                linear=linear * owsc.EXPERIMENT / linear, depth=f.depth)  # fmt: skip


def heave(omega, factor=1.0, late=0.0, lost=0):
    t = np.linspace(0, 5 * math.pi / omega, 600)
    z = 0.06 * np.cos(omega * t)
    extra = (forced_heave.theory(omega) + forced_heave.STIFFNESS) * factor * np.exp(1j * late)
    force = ((extra - forced_heave.STIFFNESS) * 0.06 * np.exp(-1j * omega * t)).real + 986
    return made(forced_heave.Load, omega=omega, rows=list(zip(t, z, force, strict=True)))


def spar(factor=1.0, late=0.0, lost=0, period=spars.PERIOD):
    t = np.linspace(0, 6, 1200)
    rows = np.zeros((len(t), 5))
    rows[:, 2] = factor * 0.06 * np.cos(2 * math.pi * t / period)
    return made(spars.Free, time=t, rows=rows, leaks=lost)


def crests(factor=1.0, late=0.0, lost=0):
    t = np.arange(0, 8, 0.007)
    k = math.sqrt(0.75 * 0.3 / 1.3) / solitary_wave.DEPTH
    passes = 1.0 + (solitary_wave.GAUGES - solitary_wave.GAUGES[0]) / solitary_wave.SPEED * (1 + late / math.tau)
    y = factor * 0.06 / np.cosh(k * solitary_wave.SPEED * (t[:, None] - passes)) ** 2
    return made(solitary_wave.Crests, time=t, elevation=y)


def paddle(factor=1.0, late=0.0, lost=0):
    flume = wavemaker.Flume(2.0, 0.1, 0.5)
    t, x = np.arange(0, 3 * flume.period, flume.period / 40), flume.gauges[0]
    y = 0.5 * factor * flume.height * np.cos(flume.k * x - flume.omega * t[:, None])
    return made(wavemaker.Heights, flume=flume, time=t, elevation=y)


def column(factor=1.0, late=0.0, lost=0):
    t = np.arange(0, 1.5, 0.001)
    force = factor * np.interp(t - late / 5, *tall_column.FORCE.T, left=0.0)
    force[np.abs(t - late / 5 - 0.396) < 0.011] = factor * 33.1  # as a mean over 20 ms has it
    speed = np.where(t < 0.24 + late / 5, 0.0, factor * np.interp(t - 0.24 - late / 5, *tall_column.SPEED.T))
    return made(tall_column.ColumnLoads, time=t, force=force, speed=speed, leaks=lost)


def box(factor=1.0, late=0.0, lost=0):
    t = np.arange(0, 6, 0.005)
    table = short_box.TABLE
    height = np.stack([np.interp(t - late, table[:, 0], factor * h) for h in table[:, 5:].T], 1)
    for n, arrives in ((0, 0.92), (1, 0.37), (2, 0.22)):  # too steep for the table
        height[t < arrives + late, n] = 0.001
        height[(t >= arrives + late) & (height[:, n] < 0.011), n] = factor * 0.011
    pressure = np.stack([np.interp(t - late, table[:, 0], p) for p in table[:, 1:5].T], 1)
    sums = [short_box.impulse(t, p, *short_box.SPAN) for p in pressure.T]
    pressure *= factor * np.array(short_box.IMPULSE) / (sums if late == 0 else np.array(sums) * 0.8)
    return made(short_box.BoxLoads, time=t, height=height, pressure=pressure, leaks=lost)


def front(factor=1.0, late=0.0, lost=0):
    time = np.linspace(0, 8, 400)
    x = 1 + factor * (np.interp(time, dam_front.TIME, dam_front.FRONT) - 1)
    lost_energy = 0.0 if factor == 1 and not late else 0.1
    return made(dam_front.Front, time=time, front=x, rise=0.0, at_start=1.0, energy=1 - lost_energy, leaks=lost)


def dam(factor=1.0, late=0.0, lost=0):
    t = np.linspace(0, 1.5, 400)
    ritter = 2 * math.sqrt(9.81 * plain_tanks.DAM[1])
    x = np.minimum(plain_tanks.DAM[0] + factor * plain_tanks.MEASURED * ritter * t, plain_tanks.LENGTH)
    return made(plain_tanks.Dam, time=t, front=x, rise=late, start=1.0, potential=0.2, lopsided=0.0, leaks=lost)


def slide(factor=1.0, late=0.0, lost=0):
    t = np.arange(0, 6, 0.01)
    way = 0.5 * factor * rigid_slide.PULL * t**2
    loss = 0.0 if factor == 1 else 0.2
    levels = 0.13 * np.linspace(1, 1 - loss, 7) * np.exp(-((t[:, None] - np.linspace(1, 5, 7)) ** 2))
    x = np.arange(0.4, 12.0, 0.02)
    waves = {place: rigid_slide.solitary(0.13 * (1 - loss) ** n, x - 0.24 * place) for n, place in enumerate(rigid_slide.HELD)}
    return made(rigid_slide.Crests, time=t, way=way + late * t, start=0.55, deep=2, leaks=lost, spacing=0.02, along=x,
                name="slide_channel", places=np.append(rigid_slide.PLACES, rigid_slide.FAR), level=levels,
                profiles=waves)  # fmt: skip


def generator(factor=1.0, late=0.0, lost=0):
    x = np.linspace(0.35, 0.8, 40)
    z = factor * (scott_russell.CREST - scott_russell.DEPTH) * np.exp(-((x - 0.5 - late) ** 2) / 0.01)
    return made(scott_russell.Crest, profile=np.array([x, z]), leaks=lost)


def released(factor=1.0, late=0.0, lost=0):
    free = decay.ROUNDS["sphere"]
    t = np.linspace(0.0, free.duration, 301)
    path = decay.release(t, free.inertia, free.stiffness, free.coefficients, free.top)
    return made(decay.Swing, free=free, time=t * (1 + late / math.tau), path=path * np.where(t > 0.3, factor, 1.0))


def sloshing(factor=1.0, late=0.0, lost=0):
    omega = standing_wave.standing_frequency(standing_wave.K, standing_wave.DEPTH, 0.04, 9.81)
    t = np.linspace(0.01, 7, 2000)
    loss = 0.05 * (factor - 1)
    y = factor * 0.04 * np.exp(-abs(loss) * t) * np.sin(omega * t * (1 - late / math.tau / 6))
    return made(standing_wave.Sloshing, time=t, mode=y, omega=omega)


def ellipse(factor=1.0, late=0.0, lost=0):
    axes = np.array(drop.exact_axes(0.8 * (1 + late / math.tau))) * [factor, 1 / max(factor, 1e-9)]
    return made(drop.Axes, axes=axes, time=0.8, start=1.0, energy=1.0)


def plates(factor=1.0, late=0.0, lost=0):
    z = np.linspace(0, channels.GAP, 200)
    return made(channels.Flow, z=z, u=factor * channels.single_speed(np.clip(z + 0.1 * late * channels.GAP, 0, None)))


def tired(factor=1.0, late=0.0, lost=0):
    t = np.arange(0, long_run.PERIODS * long_run.PERIOD, long_run.PERIOD / 60)
    angle = np.where(t > 0.75 * t[-1], factor, 1.0) * 0.1 * np.sin(math.tau / long_run.PERIOD * t)
    return made(long_run.Amplitudes, time=t, angle=angle, volume_at_start=1.0, volume=1.0)


SIGNALS = {  # case -> signal(factor, late [rad], lost); what the measure reads of a right run
    **{name: lambda name=name, **wrongly: flap(name, **wrongly) for name in owsc.NAMES},
    **{f"forced_heave_{w:g}": lambda w=w, **wrongly: heave(w, **wrongly) for w in forced_heave.COEFFICIENTS},
    "spar": lambda **wrongly: heave(4.0, **wrongly), "spar_heave": spar, "solitary_wave": crests, "wavemaker_2": paddle,
    "column_tall": column, "box_short": box, "dam_front": front, "dam_tank": dam, "slide_channel": slide,
    "scott_russell": generator, "decay_sphere": released, "standing_wave": sloshing,
    "elliptical_drop": ellipse, "implicit_viscosity": plates, "flap_200_periods": tired,
}  # fmt: skip
BLIND = {  # what a case does not ask for
    "late": {"spar_heave", "wavemaker_2", "scott_russell", "flap_200_periods", *owsc.NAMES},
    "larger": {"spar_heave", "standing_wave"},
}


def missed(name, **wrongly):
    """Measures whose targets the signal misses."""
    case, found = load(name), SIGNALS[name](**wrongly).errors()
    return [measure for measure, target in case.target.items() if not met(float(found[measure]), target)]


@pytest.mark.parametrize("name", SIGNALS)
def test_the_right_signal_meets_every_target(name):
    assert missed(name) == []


@pytest.mark.parametrize("name", [name for name in SIGNALS if name not in BLIND["larger"]])
@pytest.mark.parametrize("factor", [1.5, 0.5])
def test_half_as_large_again_or_half_as_large_is_missed(name, factor):
    assert missed(name, factor=factor)


@pytest.mark.parametrize("name", [name for name in SIGNALS if name not in BLIND["late"]])
def test_twenty_degrees_late_is_missed(name):
    assert missed(name, late=TURN)


@pytest.mark.parametrize("name", [name for name in SIGNALS if "leaks" in load(name).target])
def test_a_lost_particle_is_missed(name):
    assert missed(name, lost=1) == ["leaks"]


@pytest.mark.parametrize("name", SIGNALS)
def test_nothing_that_moves_is_missed(name):
    """An answer of zero: no error can be read of it, or a target is missed."""
    with (
        np.errstate(all="ignore"),
        contextlib.suppress(ValueError, ArithmeticError, IndexError),
    ):  # such a row has failed
        assert missed(name, factor=0.0)


def test_a_spar_without_added_mass_is_missed():
    bare = 2 * math.pi * math.sqrt(spars.MASS / spars.STIFFNESS)
    found = spar(period=bare).errors()["heave_period"]
    assert not met(found, load("spar_heave").target["heave_period"])


def test_a_wedge_that_nothing_slows_is_missed():
    moments = wedge_entry.MOMENTS[1:]
    exact = free_entry(wedge_entry.DEADRISE, wedge_entry.MASS, wedge_entry.SPEED, 1000.0, 9.81, moments)[0, 1]
    assert wedge_entry.SPEED / exact - 1 == pytest.approx(BY_NAME["velocity"].error, rel=0.01)


def test_no_law_of_rigid_bodies_fits_a_slide_that_stops():
    t = np.arange(0, 0.61, 0.01)
    s = slide_submarine.law(np.minimum(t, 0.45), 2.3, 1.5)
    misfit = np.sqrt(((slide_submarine.law(t, *slide_submarine.best_law(t, s)) - s) ** 2).mean()) / s[-1]
    assert misfit == pytest.approx(BY_NAME["law"].error, rel=0.01)


def test_a_dam_that_stands_is_missed_and_one_as_fast_as_ritters():
    assert missed("dam_tank", factor=0.0) == ["front_speed"]
    assert missed("dam_tank", factor=1 / plain_tanks.MEASURED) == ["front_speed"]


def test_the_hydrostatic_part_does_not_hide_the_rest():
    """Damping six times as large as theory's, and a phase of 15 degrees: the whole force was within 1.5 % and 0.01 cycles."""
    _, damping = forced_heave.COEFFICIENTS[4.0]
    found = forced_heave.theory(4.0) + 4j * (7.4 - 1) * damping
    assert abs(found / forced_heave.theory(4.0)) - 1 < 0.05
    errors = forced_heave.against_theory(found, 4.0)
    assert errors["added_mass"] == pytest.approx(0)
    assert errors["damping_kgps"] == pytest.approx(6.4 * damping) and errors["hydrodynamic_phase_deg"] > 12


def test_water_that_stays_where_it_is_has_kept_no_books():
    books = {"leaks": 0.0, "infinite": 0.0, "rise": 0.0, "at_start": 1.0, "spacing": 0.02, "balance": NoAudit}
    case = load("violent_fill")
    for way, missing in ((0.5, ["momentum"]), (0.0, ["energy_rise", "momentum"])):
        found = made(violent.Bookkeeping, way=way, **books).errors()
        assert [name for name, target in case.target.items() if not met(found[name], target)] == missing


class NoAudit:
    audits = 0
