"""A float that is held at the ends of its swings takes more power out of regular waves than with any constant damping."""

import fsi

PERIOD = 2.2  # s, of the waves; the float's own is 1.2 s
scene = fsi.Scene(
    name="latching_float",
    spacing=0.04,
    duration=5 * PERIOD,
    tank={"min": (0.0, -0.8), "max": (6.0, 0.4)},
    waves={"wave_height": 0.08, "period": PERIOD},
    damping=[{"start": 4.0, "end": 6.0}],
    bodies={"float": {"mjcf": "package://bodies/models/heaving_float.xml", "position": (2.4, 0.0, 0.0)}},
)


def mean_power(env, damping: float, hold: float = 0.0) -> float:
    """Mean over the last three periods [W], with the float held for `hold` seconds when it comes to rest."""
    (_, rate), info = env.reset()
    powers, until, fastest, over = [], 0.0, 0.0, False
    while not over:
        if hold and info["time"] >= until and rate * fastest < 0:  # it has turned
            until, fastest = info["time"] + hold, 0.0
        held = info["time"] < until
        fastest = fastest if held or abs(rate) < abs(fastest) else rate
        (_, rate), power, _, over, info = env.step([1e5 if held else damping])
        powers.append(power)
    return sum(powers[-int(3 * PERIOD / 0.05) :]) / int(3 * PERIOD / 0.05)


if __name__ == "__main__":
    power = lambda run: float(-run.data.actuator_force[0] * run.data.qvel[0])  # noqa: E731 that the brake takes [W]
    env = fsi.Environment(scene, reward=power, interval=0.05, warm_up=8.0)
    constant = {damping: mean_power(env, damping) for damping in (400.0, 800.0, 1200.0)}
    latched = mean_power(env, 200.0, hold=0.5)
    print(", ".join(f"{damping:g} N s/m: {power:.2f} W" for damping, power in constant.items()))
    print(f"latched: {latched:.2f} W, {latched / max(constant.values()):.2f} of the best constant damping")
    assert latched > 1.2 * max(constant.values())
