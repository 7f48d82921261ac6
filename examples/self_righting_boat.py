"""A capsized boat turns the ballast inside its hull and rights itself: a Gymnasium environment and a policy by hand."""

import numpy as np

import fsi

RATE = 1.5  # rad/s, of the ballast's arm

scene = fsi.Scene(
    name="self_righting_boat",
    spacing=0.02,
    duration=8.0,
    tank={"min": (-0.8, -0.4), "max": (0.8, 0.3)},
    bodies={"boat": {"mjcf": "package://bodies/models/self_righting_boat.xml"}},
)


def uprightness(run) -> float:
    """1 upright, -1 capsized."""
    return float(run.data.sensor("up").data[2])


if __name__ == "__main__":
    env = fsi.Environment(scene, reward=uprightness, interval=0.1)
    for name, rate in (("ballast held", 0.0), ("ballast turned", RATE)):
        observation, info = env.reset(seed=0)
        assert env.observation_names[:2] == ("arm", "up.x") and observation[3] < -0.9
        over = False
        while not over:
            arm = max(0.0, np.pi - rate * info["time"])
            observation, reward, _, over, info = env.step(np.array([arm]))
        print(f"{name}: the hull's axis points {observation[3]:+.2f} up after {info['time']:g} s")
        assert (reward > 0.9) == (rate > 0)
