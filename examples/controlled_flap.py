"""A flap that is held at the ends of its swings takes more power out of regular waves than with any constant damping."""

import fsi

PERIOD, INTERVAL = 2.4, 0.05  # s, of the waves and of an action; the flap's own period is about 1 s
scene = fsi.Scene(
    name="controlled_flap",
    spacing=0.05,
    duration=5 * PERIOD,
    tank={"min": (0.0, -0.7), "max": (6.0, 0.3)},
    waves={"wave_height": 0.1, "period": PERIOD, "absorb": True},
    damping=[{"start": 3.5, "end": 6.0, "rate": 6.5}],
    bodies={"flap": {"mjcf": "package://bodies/models/braked_flap.xml", "position": (2.0, 0.0, 0.0)}},
)
power = lambda run: float(-run.data.actuator_force[0] * run.data.qvel[0])  # noqa: E731 that the brake takes [W]


def episode(env, damping: float, hold: float = 0.0) -> list[tuple[float, float, float]]:
    """Time [s], angle [rad] and power [W] of each action; the flap is held for `hold` seconds when it turns."""
    (_, rate), info = env.reset()
    rows, until, fastest, over = [], 0.0, 0.0, False
    while not over:
        if hold and info["time"] >= until and rate * fastest < 0:  # it has turned
            until, fastest = info["time"] + hold, 0.0
        held = info["time"] < until
        fastest = fastest if held or abs(rate) < abs(fastest) else rate
        (angle, rate), watts, _, over, info = env.step([1e5 if held else damping])
        rows.append((info["time"], float(angle), watts))
    return rows


if __name__ == "__main__":
    env, last = fsi.Environment(scene, reward=power, interval=INTERVAL, warm_up=6.0), int(3 * PERIOD / INTERVAL)
    held = {0.0: (40.0, 75.0, 120.0), 0.5: (40.0,)}  # s at the ends of the swings, and the damping between them [N m s]
    means = {
        (d, hold): sum(r[2] for r in episode(env, d, hold)[-last:]) / last for hold, ds in held.items() for d in ds
    }
    print(", ".join(f"{d:g} N m s, held {hold:g} s: {watts:.2f} W" for (d, hold), watts in means.items()))
    assert means[40.0, 0.5] > 1.15 * max(watts for (_, hold), watts in means.items() if not hold)
