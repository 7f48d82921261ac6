"""A run on several ranks is the run on one, bit for bit; it can be resumed on another number of them, and never hangs."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cases.bench import rank_trials, scaling
from fsi.errors import SceneError
from fsi.ranks import kernels
from fsi.ranks.balance import SERIAL, measured_weights, shared_work
from fsi.ranks.decomposition import WEIGHTS, Decomposition, chosen_shape, imbalance
from fsi.ranks.halo import NearWalls

sys.path.insert(0, str(Path(__file__).parent))
import runs  # beside this file

pytest.importorskip("mpi4py")
started = pytest.mark.skipif(runs.MPIEXEC is None, reason="no mpiexec of the wheel of mpich")


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "column.toml"
    file.write_text(runs.COLUMN)
    return file


def done(outcome) -> None:
    assert outcome.returncode == 0, outcome.stderr


def forget_the_end(folder: Path) -> None:
    """Leave a run that is done as if it had been stopped one step before."""
    sorted((folder / "checkpoints").iterdir())[-1].unlink()
    manifest = json.loads((folder / "run.json").read_text()) | {"status": "interrupted"}
    (folder / "run.json").write_text(json.dumps(manifest))


@started
def test_two_ranks_compute_what_one_does_and_are_resumed_by_one(scene, tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    settings = "--threads", 1, "--quiet"
    every_step = "--set", "output.checkpoint=1e-6"
    done(runs.run(1, "run", scene, "--out", one, *settings))
    done(runs.run(2, "run", scene, "--out", two, "--ranks", "2x1", *settings, *every_step))
    assert json.loads((two / "run.json").read_text())["particles"]["fluid"] == 96
    assert runs.differing(one, two) == []
    forget_the_end(two)
    done(runs.run(1, "resume", two, *settings))
    assert runs.differing(one, two) == []


@started
def test_a_rank_that_is_killed_ends_all_of_them(scene, tmp_path):
    out = tmp_path / "run"
    settings = "--threads", 1, "--set", "output.checkpoint=1e-6", "--until", 1000
    process = subprocess.Popen(
        runs.command(2, "run", scene, "--out", out, *settings), stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        cwd=runs.ROOT, start_new_session=True,
    )  # fmt: skip
    try:
        wait_for(lambda: any((out / "checkpoints").glob("*.checkpoint")), 120)
        os.kill(rank_of(process.pid, 1), signal.SIGKILL)
        process.communicate(timeout=30)
        assert process.returncode != 0
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    done(runs.run(1, "resume", out, "--until", 0.3, "--quiet", "--threads", 1))


BROKEN = """
import sys
from fsi.command import main
from fsi.fluid.fluid import Fluid

predict = Fluid.predict

def breaking(fluid):
    fluid.steps = getattr(fluid, "steps", 0) + 1
    if fluid.halo.ranks.rank == 1 and fluid.steps > 5:
        raise ValueError("something broke")
    predict(fluid)

Fluid.predict = breaking
sys.argv[0] = "fsi"
main()
"""


@started
@pytest.mark.slow
def test_a_rank_that_fails_alone_ends_all_of_them_with_its_message(scene, tmp_path):
    out, program = tmp_path / "run", tmp_path / "broken.py"
    program.write_text(BROKEN)
    settings = "--threads", "1", "--quiet", "--set", "output.checkpoint=1e-6"
    outcome = subprocess.run(
        [runs.MPIEXEC, "-n", "2", sys.executable, program, "run", scene, "--out", out, *settings], capture_output=True,
        text=True, cwd=runs.ROOT, timeout=300, env=os.environ | {"PYTHONPATH": str(runs.ROOT)},
    )  # fmt: skip
    assert outcome.returncode != 0 and "rank 1 failed: something broke" in outcome.stderr
    facts = json.loads((out / "run.json").read_text())
    assert facts["status"] == "failed" and "something broke" in facts["reason"]
    done(runs.run(1, "resume", out, "--quiet", "--threads", 1))


@started
@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 1])
def test_a_rank_that_stands_still_ends_all_of_them(scene, tmp_path, which):
    out = tmp_path / "run"
    settings = "--threads", 1, "--set", "output.checkpoint=1e-6", "--until", 1000, "--quiet"
    process = subprocess.Popen(
        runs.command(2, "run", scene, "--out", out, *settings), stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        cwd=runs.ROOT, start_new_session=True,
    )  # fmt: skip
    try:
        wait_for(lambda: any((out / "checkpoints").glob("*.checkpoint")), 120)
        os.kill(rank_of(process.pid, which), signal.SIGSTOP)
        _, told = process.communicate(timeout=30)
        assert process.returncode != 0
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    assert f"rank {which} has not been heard of" in told
    if which:
        assert json.loads((out / "run.json").read_text())["status"] == "failed"
    done(runs.run(1, "resume", out, "--until", 0.3, "--quiet", "--threads", 1))


def wait_for(come, seconds: float) -> None:
    begin = time.monotonic()
    while not come():
        assert time.monotonic() - begin < seconds
        time.sleep(0.1)


def rank_of(starter: int, rank: int) -> int:
    """The process of a rank that this process has started."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes().split(b"\0")
            parents = ancestors(int(folder.name))
        except OSError:
            continue
        if starter in parents and b"PMI_RANK=%d" % rank in environment:
            return int(folder.name)
    raise AssertionError(f"no rank {rank}")


def ancestors(pid: int) -> set[int]:
    found = set()
    while pid > 1:
        found.add(pid)
        pid = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return found


WORSE = {
    "two_dimensions": (runs.COLUMN, ("3:3x1", "4:2x2", "8:4x2")),
    "open_tank": (runs.OPEN, ("2:2x1", "4:2x2")),
    "channel": (runs.CHANNEL, ("2:2x1", "4:2x2")),
    "two_liquids": (runs.LAYERS, ("3:3x1",)),
    "waves": (runs.SEA, ("3:3x1",)),
    "flap": ("flap", ("2:2x1x1", "4:2x1x2", "8:4x2")),
    "floating_box": ("floating_box", ("2:1x2x1", "8:2x2x2")),
    "floating_box_2d": ("floating_box_2d", ("2:1x2", "4:4x1")),
    "slide_submarine_contact": ("slide_submarine_contact", ("2:2x1",)),
}


@started
@pytest.mark.slow
@pytest.mark.parametrize("name", WORSE)
def test_any_number_of_ranks_computes_what_one_does(name, tmp_path):
    text, arrangements = WORSE[name]
    scene = text
    if "\n" in text:
        scene = tmp_path / f"{name}.toml"
        scene.write_text(text)
    settings = *runs.SHORTER.get(name, ()), "--threads", 1, "--quiet", "--set", "output.timeline=false"
    done(runs.run(1, "run", scene, "--out", tmp_path / "1", *settings, timeout=1200))
    for arrangement in arrangements:
        ranks, _, shape = arrangement.partition(":")
        done(runs.run(int(ranks), "run", scene, "--out", tmp_path / ranks, "--ranks", shape, *settings, timeout=1200))
        assert runs.differing(tmp_path / "1", tmp_path / ranks) == []


@started
@pytest.mark.slow
@pytest.mark.parametrize("name", rank_trials.KINDS)
def test_what_sums_in_a_way_of_its_own_does_so_on_ranks(name):
    if name == "moorings_and_control":
        pytest.importorskip("moorpy")
    for *_, found in rank_trials.same_on_ranks([name], [2], share=0.5):
        assert not any(told.startswith("DIFFERENT") for told in found.values()), found


@started
@pytest.mark.slow
def test_boxes_follow_the_water_and_change_nothing(scene, tmp_path):
    settings = "--threads", 1, "--quiet", "--until", 2.0, "--set", "alarms.lost_particles=1.0"
    done(runs.run(1, "run", scene, "--out", tmp_path / "one", *settings))
    done(runs.run(3, "run", scene, "--out", tmp_path / "three", "--ranks", "3x1", *settings))
    assert runs.differing(tmp_path / "one", tmp_path / "three") == []
    facts = json.loads((tmp_path / "three" / "run.json").read_text())["ranks"]
    assert facts["moves"] > 0 and facts["cuts"][0][-1] > 0.4  # where the water was at the start
    assert facts["sent_per_step"]["migration"] > 0


def test_granular_liquids_stay_whole_over_their_height():
    sides = np.array([1.0, 1.0, 4.0])
    assert chosen_shape(4, sides) == (1, 1, 4)
    assert chosen_shape(4, sides, upright=True)[-1] == 1
    with pytest.raises(SceneError, match=r"cuts granular liquids across.*4x1x1"):
        chosen_shape(4, sides, "2x1x2", upright=True)


def test_weights_are_those_that_the_ranks_need_and_the_known_ones_where_they_tell_nothing():
    numbers = np.array([[1e4, 8e3, 0.0], [2e3, 9e3, 2e4], [9e3, 1e3, 3e4], [5e3, 5e3, 5e3], [1e4, 0.0, 1e3]])
    busy = SERIAL + numbers @ [1e-5, 3e-6, 1e-6]
    assert measured_weights(np.column_stack([numbers, busy])) == pytest.approx([1.0, 0.3, 0.1], rel=0.1)
    alike = np.column_stack([np.tile(numbers[0], (2, 1)), [0.10, 0.11]])
    assert measured_weights(alike) == pytest.approx(list(WEIGHTS.values()), rel=0.05)


def test_work_has_one_type_on_ranks_with_and_without_boundary_particles():
    """Ranks that add integers to the doubles of others get garbage, and each decides on other boxes."""
    boxes = Decomposition((2,), (np.array([1.0]),))
    fluid = np.array([[0.2], [0.4], [1.5]])
    with_walls = shared_work(boxes, fluid, np.array([[0.1], [2.0]]), np.array([0.5, 0.25]))
    without = shared_work(boxes, fluid, np.empty((0, 1)), np.empty(0))
    assert with_walls.tolist() == [2.5, 1.25] and without.tolist() == [2.0, 1.0]
    assert with_walls.dtype == without.dtype == float


def test_a_place_is_near_walls_wherever_a_boundary_particle_is_within_reach():
    random = np.random.default_rng(0)
    boundary = random.uniform(0, 2, (12, 2))
    placed = SimpleNamespace(position=boundary, of_owner=lambda owner: slice(0, 8))  # the others move
    walls = NearWalls(placed, np.array([0.5, 0.0]), np.array([1.5, 2.0]), 0.1)
    boundary[8:] = random.uniform(0, 2, (4, 2))
    places = random.uniform([0.5, 0.0], [1.5, 2.0], (2000, 2))
    apart = np.linalg.norm(places[:, None] - boundary, axis=2).min(1)
    found = walls(places)
    assert found[apart < 0.1].all() and not found[apart > 0.29].any()
    assert walls(np.array([[9.0, np.nan]])).shape == (1,)  # a particle that is lost


def test_groups_part_into_those_that_others_wait_for_and_the_rest():
    offset, count = np.array([0, 10, 20]), np.array([3, 2])
    group = np.zeros(20, np.int32)
    group[:4], group[10:13] = [0, 8, 16, 20], [20, 28, 30]
    kind = np.zeros(30, np.int8)  # of ghosts
    kind[:10], kind[12:28] = kernels.OUTER, kernels.INNER
    runs = np.empty((3, 5), np.int64)
    for which, wanted in ((kernels.OUTER, [[0, 2, 0]]), (kernels.INNER, [[2, 1, 0], [10, 1, 70]])):
        found = kernels.split(offset, count, group, np.array([0, 70]), kind, which, *runs)
        assert runs[:, :found].T.tolist() == wanted


def test_whole_slices_share_the_work_and_shapes_are_what_was_asked_for():
    work = np.array([1.0] * 10 + [0.1] * 30)
    planes = 0.1 * np.arange(1, 40)
    equal = Decomposition.geometric((4, 1), np.zeros(2), np.array([4.0, 1.0]), np.full(2, 0.1))
    balanced = equal.balanced([planes, np.empty(0)], lambda axis, planes: work)
    shares = np.add.reduceat(work, np.concatenate([[0], np.searchsorted(planes, balanced.cuts[0]) + 1]))
    assert imbalance(shares) < 1.25 and imbalance(np.add.reduceat(work, [0, 10, 20, 30])) > 3
    assert chosen_shape(4, np.array([4.0, 1.0, 1.0])) == (4, 1, 1)
    assert chosen_shape(4, np.array([3.0, 1.0]), "2x1x2") == (2, 2)
    for text, fault in (("2x2", "takes 4 processes"), ("2xx", "no arrangement"), ("2x1x1x1", "in 2 dimensions")):
        with pytest.raises(SceneError, match=fault):
            chosen_shape(3, np.array([3.0, 1.0]), text)


def test_a_model_of_scaling_keeps_what_must_hold():
    machine = scaling.Machine()
    still = [case for case in scaling.CASES if case.name == "still tank"]
    large = [scaling.efficiency(case, 512, machine) for case in still[:4]]
    assert large == sorted(large) and 0.75 < large[-1] < 0.95  # it rises with the size; the source reports 0.83
    alone = scaling.predict(scaling.STILL, 1e6, 1, machine)
    assert alone.ghosts == alone.messages == 0.0
    worst = scaling.limits(scaling.STILL, 1e9, 4096)[0]
    assert worst[0] > 1 and "whole scene" in worst[1]
