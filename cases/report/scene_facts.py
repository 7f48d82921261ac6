"""A scene in a few lines of words, for the head of its report."""

from __future__ import annotations

from fsi.scene.model import Scene

UNITS = {"wave_height": " m", "period": " s", "ramp": " s", "Hm0": " m", "peak_period": " s"}


def scene_facts(scene: Scene) -> dict[str, str]:
    """Names and values of what a reader asks first."""
    size = " x ".join(f"{b - a:.4g}" for a, b in zip(scene.tank.min, scene.tank.max, strict=True))
    facts = {
        "tank": f"{size} m, {scene.dimension}D" + (f", {scene.tank.width:g} m wide" if scene.dimension == 2 else ""),
        "spacing": f"{1000 * scene.spacing:.4g} mm",
        "fluid": f"{scene.fluid.density:g} kg/m3",
    }
    if scene.waves:
        given = scene.waves.model_dump(mode="json", exclude_none=True)
        rest = [f"{key.replace('_', ' ')} {_short(value)}{UNITS.get(key, '')}" for key, value in given.items() if value]
        facts["waves"] = ", ".join([given["kind"], *(text for text in rest if not text.startswith("kind "))])
    if scene.bodies:
        facts["bodies"] = ", ".join(f"{name} ({file.mjcf.name})" for name, file in scene.bodies.items())
        facts["coupling"] = scene.coupler.scheme.replace("_", " ")
    for name in ("gauges", "probes", "velocimeters", "depths", "fluxes", "runups", "areas", "loads"):
        if found := getattr(scene, name):
            facts[name] = ", ".join(found)
    return facts


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
