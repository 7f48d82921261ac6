"""A scene as a Gymnasium environment, by Gymnasium's own checker, and in several processes."""

import numpy as np
import pytest
from test_control import FLOAT, SCENE

import fsi
from fsi.errors import RunError, SceneError

gymnasium = pytest.importorskip("gymnasium")


@pytest.fixture
def make(tmp_path):
    (tmp_path / "float.xml").write_text(FLOAT)
    (tmp_path / "scene.toml").write_text(SCENE)

    def height(run):
        return float(run.data.qpos[0])

    def made(**options):
        options = {"reward": height, "interval": 0.03, "duration": 0.09} | options
        return fsi.Environment(tmp_path / "scene.toml", **options)

    return made


@pytest.mark.filterwarnings("ignore:.*(normalized|infinity):UserWarning")
def test_gymnasium_finds_nothing_wrong(make):
    from gymnasium.utils.env_checker import check_env

    check_env(make(), skip_render_check=True)
    env = make(begin=lambda run: run.data.qvel.__setitem__(0, run.rng.uniform(0.1, 0.2)))
    assert env.observation_names == ("z", "felt.x", "felt.y", "felt.z", "force", "elevation.side")
    assert env.action_names == ("push",) and env.action_space.high.tolist() == [50.0]
    first, _ = env.reset(seed=4)
    for n in range(3):
        observation, reward, terminated, truncated, info = env.step(env.action_space.high)
        assert info["time"] == pytest.approx(0.03 * (n + 1), abs=1e-12) and not terminated
        assert observation[4] == pytest.approx(50.0) and 0 < reward < 0.1
    assert truncated
    again, _ = env.reset(seed=4)
    assert np.array_equal(again, first)
    env.close()


def test_a_warm_up_is_run_once(make):
    env = make(warm_up=0.06, terminated=lambda run: run.time > 0.08)
    assert env.reset()[1]["time"] == pytest.approx(0.06)
    assert env.step([0.0])[2:4] == (True, False)
    steps = env.session.simulation.step_count
    assert env.reset()[1]["time"] == pytest.approx(0.06) and env.session.simulation.step_count < steps
    env.close()


def test_what_an_environment_needs_is_told(make, tmp_path):
    file = tmp_path / "float.xml"
    file.write_text(FLOAT.replace(' ctrlrange="-50 50"', ""))
    with pytest.raises(SceneError, match=r"actuator 'push' has no range.*ctrlrange"):
        make()
    file.write_text(FLOAT[: FLOAT.index("<actuator>")] + "</mujoco>")
    with pytest.raises(SceneError, match="no actuator"):
        make()


def test_what_cannot_be_an_action_or_a_reward_is_told(make):
    with pytest.raises(SceneError, match=r"interval: 0\.0 s; give a time above 0"):
        make(interval=0.0)
    env = make()
    env.reset()
    with pytest.raises(SceneError, match=r"an action of shape \(2,\), and 1 actuators; give one number each for push"):
        env.step([0.0, 1.0])
    env.close()
    for wrong in (None, float("nan")):
        env = make(reward=lambda run, wrong=wrong: wrong)
        env.reset()
        with pytest.raises(RunError, match=f"reward is {wrong} at t = .* it must be a finite number"):
            env.step([0.0])
        env.close()


@pytest.mark.slow
def test_environments_run_in_several_processes(make):
    vector = gymnasium.vector.AsyncVectorEnv([make] * 2)
    vector.reset(seed=1)
    both = np.array([[20.0], [-20.0]], np.float32)
    observation, reward, *_ = vector.step(both)
    vector.close()
    alone = make()
    alone.reset(seed=1)
    assert np.allclose(observation[0], alone.step(both[0])[0], atol=1e-6) and reward[0] > reward[1]
    alone.close()
