"""Study files: what is read, and what is wrong with them in one line that names file, key, fault and fix."""

import pytest

from cases.study.points import points
from cases.study.study_file import load_study
from fsi.errors import SceneError


def read(here, text: str):
    (here / "study.toml").write_text(text)
    return load_study("study.toml")


def test_a_grid_runs_through_its_last_parameter_first(here):
    study = read(
        here,
        """
        scene = "tank.toml"
        [set]
        waves.period = 2.0
        "tank.max[1]" = 0.7
        [parameters.a]
        key = "waves.wave_height"
        min = 1
        max = 100
        count = 3
        scale = "log"
        [parameters.b]
        key = "fluid.density"
        values = [1, 2]
        """,
    )
    assert [tuple(p.values()) for p in points(study)] == [(1, 1), (1, 2), (10, 1), (10, 2), (100, 1), (100, 2)]
    assert study.settings == {"waves.period": 2.0, "tank.max[1]": 0.7}
    assert study.name == "study" and study.scene == str(here / "tank.toml")


def test_a_latin_hypercube_has_one_point_in_every_stratum(here):
    text = """
        scene = "tank.toml"
        [sampling]
        method = "latin_hypercube"
        samples = 8
        seed = 3
        [parameters.a]
        key = "x"
        min = 0.0
        max = 8.0
        [parameters.b]
        key = "y"
        min = 1.0
        max = 256.0
        scale = "log"
        """
    made = points(read(here, text))
    assert sorted(int(p["a"]) for p in made) == list(range(8))
    assert sorted(int(__import__("math").log2(p["b"])) for p in made) == list(range(8))
    assert points(read(here, text)) == made


def test_a_list_is_taken_as_it_is(here):
    text = 'scene = "tank.toml"\n[sampling]\nmethod = "list"\npoints = [{b = 1, a = 2}, {a = 3, b = 4}]\n'
    text += '[parameters.a]\nkey = "x"\nvalues = [1]\n[parameters.b]\nkey = "y"\nvalues = [1]\n'
    assert points(read(here, text)) == [{"a": 2, "b": 1}, {"a": 3, "b": 4}]


P = '[parameters.a]\nkey = "waves.period"\n'


@pytest.mark.parametrize(
    "text, line",
    [
        ("x = [", "study.toml: not TOML: "),
        (P + "values = [1]", "study.toml: scene: missing; add scene"),
        ('scene = "t"\nparameter = 1', "study.toml: parameter: unknown key; did you mean parameters?"),
        ('scene = "t"\n[parameters.a]\nvalues = [1]', "study.toml: parameters.a.key: missing; add it"),
        ('scene = "t"\n' + P, "study.toml: parameters.a: give either values or min and max; with min and max"),
        ('scene = "t"\n' + P + "min = 2\nmax = 1\ncount = 3", "study.toml: parameters.a: min must lie below max"),
        ('scene = "t"\n' + P + 'min = 0\nmax = 1\nscale = "log"', "parameters.a: min = 0 has no logarithm; use"),
        ('scene = "t"\n' + P + "min = 0\nmax = 1", "study.toml: parameters.a: a grid needs values, or a count"),
        ('scene = "t"\n' + P + "values = [1, 1]", "parameters.a: a value stands twice in values; remove one"),
        ('scene = "t"\n' + P + "values = [1.0, nan]", "parameters.a: values hold nan, which is no number; remove it"),
        (
            'scene = "t"\n' + P + 'values = [1]\n[parameters.b]\nkey = "waves . period"\nvalues = [2]',
            "parameters.b.key: 'waves . period' sets what parameters.a sets, 'waves.period'; remove one of them",
        ),
        (
            'scene = "t"\n[parameters.a]\nkey = "waves.Te"\nvalues = [1]\n'
            '[parameters.b]\nkey = "waves.peak_period"\nvalues = [2]',
            "parameters.b.key: 'waves.peak_period' sets what parameters.a sets, 'waves.Te'",
        ),
        (
            'scene = "t"\n[parameters.a]\nkey = "tank.max[0]"\nvalues = [1]\n[parameters.b]\nkey = "tank.max"\nvalues = [2]',
            "parameters.b.key: 'tank.max' sets what parameters.a sets, 'tank.max[0]'",
        ),
        ('scene = "t"\n[parameters.run]\nkey = "x"\nvalues = [1]', "parameters.run: cannot be the name of a param"),
        ('scene = "t"\n[sampling]\nmethod = "gird"', "sampling.method: 'gird' is not one of"),
        ('scene = "t"\n[sampling]\nmethod = "list"', "sampling.points: a list needs its points; add e.g."),
        ('scene = "t"\n[sampling]\nmethod = "optimise"\n' + P + "values = [1]", "sampling.samples: optimise needs"),
        (
            'scene = "t"\n[sampling]\nmethod = "optimise"\nsamples = 3\n' + P + "values = [1]",
            "study.toml: objective: an optimisation needs one; add [objective]",
        ),
        (
            'scene = "t"\n' + P + 'values = [1]\n[sampling]\nmethod = "list"\npoints = [{b = 1}]',
            "sampling.points[0]: has no parameter 'b'; name every parameter of the study: a",
        ),
        ('scene = "t"\n[objective]\nmaximise = "x"\nminimise = "y"', "objective: give one of maximise and minimise"),
        ('scene = "t"\n[constraints.x]', "study.toml: constraints.x: give min, max or both"),
        ('scene = "t"\nscript = "no.py"', "study.toml: script: no such file: "),
        ('scene = "t"\n[parameters.a]\nkey = "script.h"\nvalues = [1]', "'script.h' needs a script; add script ="),
    ],
)
def test_faults_name_file_key_fault_and_fix(here, text, line):
    with pytest.raises(SceneError) as fault:
        read(here, text)
    assert line in str(fault.value)


def test_a_file_and_its_own_attributes_go_together(here):
    text = 'scene = "tank.toml"\n[parameters.file]\nkey = "bodies.a.mjcf"\nvalues = ["a.xml", "b.xml"]\n'
    text += '[parameters.size]\nkey = "bodies.a.mjcf.geom.hull.size[0]"\nvalues = [1, 2]\n'
    text += '[parameters.width]\nkey = "bodies.a.mjcf.geom.hull.size[1]"\nvalues = [1, 2]\n'
    assert len(points(read(here, text))) == 8
