"""Comparison with linear theory, from a dataset written as Capytaine writes its own."""

import math

import numpy as np
import pytest
import xarray

from cases.report.wave_figures import energy_period_ratio
from cases.study.bem import as_omega, check_power, compare, compare_power, rao, read_bem
from cases.study.plan import Bem, Parameter, Study
from cases.study.routines import check_routine
from fsi.errors import SceneError
from fsi.waves import load_kind
from fsi.waves.kinds.irregular import spectrum

OMEGA = np.linspace(1.0, 8.0, 57)
DOFS = ["Pitch", "Heave"]


def capytaine(path, **left_out):
    """A dataset of two uncoupled degrees of freedom with constant coefficients, complex numbers along `complex`."""
    n = len(OMEGA)

    def matrix(pitch, heave):
        return np.broadcast_to(np.diag([pitch, heave]), (n, 2, 2))

    force = np.zeros((n, 1, 2), complex)
    force[:, 0, 0] = 300.0 * np.exp(0.4j)
    parts = {"diffraction_force": 0.25 * force, "Froude_Krylov_force": 0.75 * force}
    data = xarray.Dataset(
        {
            "added_mass": (("omega", "radiating_dof", "influenced_dof"), matrix(20.0, 3.0)),
            "radiation_damping": (("omega", "radiating_dof", "influenced_dof"), matrix(15.0, 1.0)),
            "inertia_matrix": (("influenced_dof", "radiating_dof"), np.diag([30.0, 5.0])),
            "hydrostatic_stiffness": (("influenced_dof", "radiating_dof"), np.diag([800.0, 90.0])),
            **{
                name: (
                    ("complex", "omega", "wave_direction", "influenced_dof"),
                    np.stack([value.real, value.imag]),
                )
                for name, value in parts.items()
            },
        },
        coords={
            "omega": OMEGA,
            "radiating_dof": DOFS,
            "influenced_dof": DOFS,
            "wave_direction": [0.0],
            "complex": ["re", "im"],
        },
    )
    data.drop_vars(list(left_out)).to_netcdf(path, engine="h5netcdf")
    return path


def exact(omega, damping):
    return 300.0 * np.exp(0.4j) / (-(omega**2) * 50.0 - 1j * omega * (15.0 + damping) + 800.0)


def test_rao_of_a_dataset_is_that_of_its_oscillator(tmp_path):
    data = read_bem(capytaine(tmp_path / "flap.nc"))
    assert np.allclose(rao(data, "Pitch", 40.0), exact(OMEGA, 40.0), rtol=1e-12)
    stiff = rao(data, "Pitch", 0.0, 200.0).values[0]
    assert stiff == pytest.approx(300.0 * np.exp(0.4j) / (-50.0 - 15.0j + 1000.0))


def test_a_study_is_set_beside_linear_theory(tmp_path):
    period, damping = np.array([1.0, 2.0, 12.0]), np.array([10.0, 40.0])
    omega = 2 * math.pi / period
    at = OMEGA[np.argmin(abs(OMEGA[:, None] - omega), axis=0)]  # of the file, so that nothing is interpolated
    period[:2] = 2 * math.pi / at[:2]
    values = np.array([[abs(exact(2 * math.pi / T, b)) for T in period] for b in damping])
    results = xarray.Dataset(
        {"rao": (("damping", "period", "joint"), 1.1 * values[..., None], {"units": "rad/m"})},
        coords={"damping": damping, "period": period, "joint": ["hinge"]},
    )
    bem = Bem(file=capytaine(tmp_path / "flap.nc"), dof="Pitch", damping="damping")
    found = compare(results, bem)
    assert np.allclose(found.rao_ratio.values[:, :2], 1.1)
    assert np.isnan(found.rao_bem.values[:, 2]).all()  # 12 s lies outside the file
    lead = -np.angle(exact(2 * math.pi / period[1], 40.0))
    assert found.rao_phase_bem.sel(damping=40.0).values[1] == pytest.approx(lead)
    assert found.rao_bem.attrs["units"] == "rad/m"


def test_what_a_dataset_lacks_is_named(tmp_path):
    with pytest.raises(SceneError, match=r"bem\.file: has no inertia_matrix; compute it"):
        read_bem(capytaine(tmp_path / "a.nc", inertia_matrix=True))
    with pytest.raises(SceneError, match="has no excitation_force"):
        read_bem(capytaine(tmp_path / "b.nc", diffraction_force=True))
    (tmp_path / "c.nc").write_text("no netCDF")
    with pytest.raises(SceneError, match="cannot be read"):
        read_bem(tmp_path / "c.nc")
    with pytest.raises(SceneError, match="no degree of freedom 'Surge'; the dataset has Pitch, Heave"):
        rao(read_bem(capytaine(tmp_path / "d.nc")), "Surge")


def test_frequencies_by_any_name():
    for name, value in (("period", 2.0), ("frequency", 0.5), ("omega", math.pi)):
        assert as_omega([value], name)[0] == pytest.approx(math.pi)


def test_a_power_matrix_is_set_beside_linear_theory(tmp_path):
    """Regular waves: c/2 omega^2 |X|^2 (H/2)^2. A sea: the same of its components, here of a million of them."""
    bem = Bem(file=capytaine(tmp_path / "flap.nc"), dof="Pitch", damping=40.0)
    height, omega = np.array([0.1, 0.2]), OMEGA[[10, 20, 30]]
    coords = {"wave_height": height, "period": 2 * math.pi / omega, "joint": ["hinge"]}
    of_runs = {"power_matrix": (("wave_height", "period"), np.ones((2, 3)), {"units": "W"})}
    regular = load_kind("regular")(kind="regular", wave_height=0.1, period=2.0)
    found = compare_power(xarray.Dataset(of_runs, coords=coords), bem, regular)
    expected = 20.0 * (omega * abs(exact(omega, 40.0))) ** 2 * (height[:, None] / 2) ** 2
    assert np.allclose(found.power_matrix_bem, expected) and np.allclose(found.power_matrix_ratio, 1 / expected)

    waves = load_kind("irregular")(kind="irregular", Hm0=0.1, peak_period=1.6)
    coords = {"Hm0": height, "Te": np.array([0.7, 2.0])}
    of_runs = {"power_matrix": (("Te", "Hm0"), np.ones((2, 2)), {"units": "W"})}
    found = compare_power(xarray.Dataset(of_runs, coords=coords), bem, waves).power_matrix_bem
    peak = 2.0 / energy_period_ratio(waves)
    f = np.linspace(0.5, 2.5, 100_000) / peak
    share = spectrum(f, 1 / peak, 3.3)
    of_waves = 40.0 * (2 * math.pi * f * abs(exact(2 * math.pi * f, 40.0))) ** 2
    assert float(found.sel(Te=2.0, Hm0=0.2)) == pytest.approx(0.2**2 / 16 * share @ of_waves / share.sum(), rel=2e-3)
    assert np.isnan(found.sel(Te=0.7)).all()  # most of that sea lies above the file's frequencies

    check_power(bem, waves, ["Hm0", "Te", "seed"])
    for wrong in ((bem, waves, ["Hm0", "Te", "spacing"]), (bem, None, ["Hm0", "Te"])):
        with pytest.raises(SceneError, match="linear theory has no power for this matrix"):
            check_power(*wrong)
    with pytest.raises(SceneError, match="a power matrix has one damping"):
        check_power(bem.model_copy(update={"damping": "damping"}), waves, ["Hm0", "Te"])


def study(folder, **bem):
    """A power matrix of a flap with a linear power take-off of 20 N m s, beside a dataset."""
    given = {"file": str(capytaine(folder / "flap.nc")), "dof": "Pitch", "damping": 20.0} | bem
    axes = {"wave_height": ("waves.wave_height", (0.1, 0.2)), "period": ("waves.period", (1.5, 2.0))}
    return Study(
        scene="flap",
        routine="power_matrix",
        parameters={name: Parameter(key=key, values=values) for name, (key, values) in axes.items()},
        settings={"bodies.flap.pto.damping": 20.0},
        bem=Bem(**given),
    )


def test_linear_theory_is_checked_before_anything_is_run(tmp_path):
    check_routine(study(tmp_path))
    with pytest.raises(
        SceneError, match=r"flap\.nc: bem\.dof: no degree of freedom 'pitch'; the dataset has Pitch, Heave"
    ):
        check_routine(study(tmp_path, dof="pitch"))
    with pytest.raises(SceneError, match=r"flap\.nc: bem\.dofs: no degree of freedom 'Surge'"):
        check_routine(study(tmp_path, dof="", dofs={"hinge": "Surge"}))
    with pytest.raises(SceneError, match=r"bem\.damping: 30, where the scene's bodies\.flap\.pto has a damping of 20"):
        check_routine(study(tmp_path, damping=30.0))
