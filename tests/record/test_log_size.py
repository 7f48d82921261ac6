"""Size of the logs: what `fsi check` says beside what a run leaves, and the limit of long runs."""

import numpy as np
import pytest

import fsi
from fsi.protocols import Frame
from fsi.record.fields import drawn, fraction, raster, thinned
from fsi.record.log_size import log_size
from fsi.scene.file import load_scene

pytest.importorskip("rerun")


def test_five_minutes_of_the_flap_stay_below_200_megabytes():
    size = fsi.check("flap", until=300.0)["estimate"]
    assert size["log_bytes"] < 200e6
    assert size["snapshots"] == 3001 and 3000 < size["snapshot_particles"] < size["fluid"]
    assert fsi.check("flap")["estimate"]["snapshot_particles"] == size["fluid"]  # short runs are drawn in full


def test_size_is_what_a_run_leaves(tmp_path):
    scene = load_scene("dam_break", ["spacing=0.02", "duration=0.3", "output.particles=0.01", "output.cloud=true"])
    said = fsi.check(scene)["estimate"]
    run = fsi.run(scene, out=tmp_path / "run", quiet=True, threads=1)
    left = sum((run.folder / name).stat().st_size for name in ("run.mcap", "run.rrd"))
    assert said["log_bytes"] == pytest.approx(left, rel=0.35)


def test_particles_drawn_are_the_same_ones_in_every_frame(scene):
    label = np.random.default_rng(1).permutation(100_000).astype(np.int32)
    chosen = set(label[drawn(label, 0.3)])
    assert len(chosen) == pytest.approx(30_000, rel=0.02)
    assert set(label[::-1][drawn(label[::-1], 0.3)]) == chosen
    assert chosen < set(label[drawn(label, 0.5)])
    assert not drawn(np.full(1000, -1, np.int32), 1.0).any()  # ghosts
    pairs = np.diff(sorted(chosen))
    assert (pairs == 1).mean() == pytest.approx(0.3, abs=0.02)  # neighbours on the lattice are drawn independently


def test_thinned_frames_keep_values_together(scene):
    n = np.arange(1000)
    position = np.stack([n, -n], axis=1)
    frame = Frame(
        0, 0, 0, position=position, velocity=2.0 * position, pressure=3.0 * n, label=n, fields={"liquid": n % 2}
    )
    few = thinned(frame, 0.4)
    kept = few.position[:, 0]
    assert few.drawn == 0.4 and 300 < len(kept) < 500
    np.testing.assert_array_equal(few.velocity[:, 1], -2 * kept)
    np.testing.assert_array_equal(few.pressure, 3 * kept)
    np.testing.assert_array_equal(few.fields["liquid"], kept % 2)


def test_fraction_and_raster(scene):
    assert fraction(scene, 1000) == 1.0
    assert fraction(load_scene(scene, ["output.fraction=0.2"]), 1000) == 0.2
    limited = load_scene(scene, ["output.particles_limit=0.01"])
    size = log_size(limited, None, 1000)
    assert size["snapshots"] * size["snapshot_particles"] == pytest.approx(0.01e6 / 6.6, rel=0.02)
    assert scene.spacing / 16 < raster(scene) <= scene.spacing / 8 and np.log2(raster(scene)) % 1 == 0
