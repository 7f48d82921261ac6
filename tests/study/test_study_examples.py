"""The study files of examples/studies: all are read, and their first point is a scene whose bodies load."""

from pathlib import Path

import pytest

from cases.study.design import design
from cases.study.points import hypercube, points
from cases.study.routines import check_routine
from cases.study.study_file import load_study
from fsi.scene.binding import bind

FILES = [f for f in sorted((Path(__file__).parents[2] / "examples/studies").glob("*.toml")) if "tank" not in f.name]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_study_of_the_examples_is_sound(file, tmp_path):
    study = load_study(file)
    check_routine(study)
    chosen = hypercube(study, 3) if study.sampling.method == "optimise" else points(study)
    made = [design(study, values, tmp_path) for values in (chosen[0], chosen[-1])]
    assert made[0].hash != made[1].hash
    bodies, _, _ = bind(made[0].scene, file.name)
    assert not made[0].scene.bodies or bodies.joint_names == ("hinge",)
