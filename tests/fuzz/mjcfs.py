"""MJCF files at random, in a small tank."""

from __future__ import annotations

import random
from xml.etree import ElementTree as ET

from fsi.scene.toml import dumps

WORDS = [
    "",
    "0",
    "-1",
    "nan",
    "inf",
    "1e300",
    "1e-300",
    "0 0",
    "0 0 0",
    "1 2 3 4",
    "ü",
    "a/b",
    "world",
    "x" * 300,
    "true",
    "auto",
]
INNER = ["body", "geom", "joint", "site", "freejoint", "inertial", "camera", "light", "frame", "replicate"]
OUTER = [
    "option",
    "compiler",
    "size",
    "default",
    "asset",
    "actuator",
    "sensor",
    "equality",
    "tendon",
    "contact",
    "keyframe",
]


def mjcf(rng: random.Random) -> tuple[str, str]:
    """The text of a scene file and of its body file `b.xml`, right or wrong."""
    root = ET.Element("mujoco")
    rng.wild = wild = rng.random() < 0.5  # the other half holds what belongs there
    if rng.random() < 0.7:
        ET.SubElement(root, "option", integrator=rng.choice(["implicitfast", "Euler", "RK4", "implicit"]))
    world = ET.SubElement(root, "worldbody")
    names: dict[str, list[str]] = {"body": [], "geom": [], "joint": [], "site": []}
    for n in range(rng.choice([0, 1, 1, 1, 1, 1, 2, 2, 3])):
        _body(rng, world, names, 0, 0.7 * n)
    if rng.random() < 0.3:
        _geom(rng, world, names)
    for _ in range(rng.choice([0, 1, 2]) if wild else rng.choice([0, 0, 1])):
        _extra(rng, root, names)
    for _ in range(rng.choice([0, 1, 1, 2]) if wild else 0):
        _mutate(rng, root)
    text = ET.tostring(root, encoding="unicode")
    if wild and rng.random() < 0.1:
        at = rng.randrange(len(text))
        text = rng.choice([text[:at], text[:at] + text[at + 1 :], text[:at] + rng.choice('<>&"\x00é') + text[at:], ""])
    three = rng.random() < 0.3
    tank = {"min": [0.0, 0.0, -0.8], "max": [2.0, 1.0, 0.6]} if three else {"min": [0.0, -0.8], "max": [3.0, 0.6]}
    data = {"dimension": 3 if three else 2, "spacing": 0.1, "duration": 0.3, "tank": tank}
    data["bodies"] = {
        "b": {"mjcf": "b.xml", "position": [1.0, 0.5 if three else 0.0, rng.choice([0.0, 0.0, -0.3, 0.3])]}
    }
    if rng.random() < 0.2:
        data["bodies"]["c"] = {"mjcf": "b.xml", "position": [2.0, 0.5 if three else 0.0, 0.0]}
    if rng.random() < 0.2:
        data["bodies"]["b"]["pto"] = rng.choice(
            [{"damping": 5.0}, {"kind": "coulomb", "force": 2.0}, {"joint0": {"stiffness": 3.0}}]
        )
    if rng.random() < 0.2:
        data["coupler"] = {"scheme": rng.choice(["lagged", "fixed_point", "added_mass"])}
    return dumps(data), text


def _numbers(rng: random.Random, count, low=-0.3, high=0.3) -> str:
    return " ".join(f"{rng.uniform(low, high):.3f}" for _ in range(count))


def _named(rng, names, kind, attributes) -> dict:
    if rng.random() < 0.7:
        attributes["name"] = f"{kind}{len(names[kind])}" if rng.random() < 0.95 else "same"
        names[kind].append(attributes["name"])
    return attributes


def _body(rng, parent, names, depth, along=0.0) -> None:
    attributes = _named(rng, names, "body", {"pos": f"{along:g} 0 {rng.uniform(-0.2, 0.2):.3f}"})
    if depth and rng.random() < 0.7:
        attributes["pos"] = _numbers(rng, 3)
    if rng.random() < 0.2:
        how, count = rng.choice(
            [("euler", 3), ("quat", 4), ("axisangle", 4), ("euler", 3), ("quat", rng.choice([3, 5]))]
        )
        attributes[how] = _numbers(rng, count, 0.1, 90)
    if rng.wild and rng.random() < 0.05:
        attributes["mocap"] = "true"
    body = ET.SubElement(parent, "body", attributes)
    for _ in range(rng.choice([0, 1, 1, 1, 1, 1, 2] if rng.wild else [1])):
        kinds = ["hinge", "slide", "slide", "hinge", "slide", "ball"]
        kind = rng.choice([*kinds, "free"] if rng.wild or not depth else kinds)
        joint = _named(
            rng, names, "joint", {"type": kind, "axis": rng.choice(["0 1 0", "0 0 1", "1 0 0", "0 0 0", "1 1 1"])}
        )
        if rng.random() < 0.3:
            joint["damping"] = rng.choice(["1", "1000", *["-1"] * rng.wild])
        if rng.random() < 0.2:
            joint |= {"range": rng.choice(["-1 1", "-0.1 0.1", *["1 -1"] * rng.wild]), "limited": "true"}
        ET.SubElement(body, "joint", joint)
    for _ in range(rng.choice([0, 1, 1, 1, 1, 2] if rng.wild else [1, 1, 2])):
        _geom(rng, body, names)
    if rng.random() < 0.2:
        ET.SubElement(body, "site", _named(rng, names, "site", {}))
    if depth < 3 and rng.random() < 0.3:
        _body(rng, body, names, depth + 1)


def _geom(rng, parent, names) -> None:
    usual = ["box", "sphere", "cylinder", "capsule", "ellipsoid"]
    kind = rng.choice(usual * 4 + ["plane", "mesh", "hfield", "sdf"] * rng.wild)
    count = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "ellipsoid": 3, "plane": 3}.get(kind, 0)
    geom = _named(rng, names, "geom", {"type": kind})
    if count:
        geom["size"] = _numbers(
            rng, count, *rng.choice([(0.15, 0.4), (0.15, 0.4), (0.2, 0.3), (0.0, 0.01), (-1, 1), (1, 50)])
        )
    if rng.random() < 0.5:
        geom["density"] = rng.choice(["500", "300", "0", "7800", "-5", "1e9"])
    if rng.random() < 0.3:
        geom |= {"contype": "0", "conaffinity": "0"}
    if kind in ("mesh", "hfield"):
        geom[kind] = rng.choice(["m", "none"])
    ET.SubElement(parent, "geom", geom)


def _extra(rng, root, names) -> None:
    """A section beside the bodies."""

    def one(kind: str) -> str:
        return rng.choice([*names[kind], "nothing"] if rng.wild or not names[kind] else names[kind])

    kind = rng.choice([*OUTER, "wet", "include", "custom"] if rng.wild else ["actuator", "sensor", "wet", "contact"])
    if kind == "wet":
        wet = ET.SubElement(ET.SubElement(root, "custom"), "tuple", name="wet")
        for _ in range(rng.choice([1, 2])):
            ET.SubElement(wet, "element", objtype=rng.choice(["geom", "geom", "body"]), objname=one("geom"))
    elif kind == "asset":
        vertex = "0 0 0 0.4 0 0 0 0.4 0 0 0 0.4"
        ET.SubElement(
            ET.SubElement(root, "asset"), "mesh", name="m", vertex=rng.choice([vertex, "0 0 0", vertex + " nan 0 0"])
        )
    elif kind == "actuator":
        tag = rng.choice(["motor", "position", "velocity", "general"])
        ET.SubElement(ET.SubElement(root, "actuator"), tag, joint=one("joint"))
    elif kind == "sensor":
        ET.SubElement(ET.SubElement(root, "sensor"), rng.choice(["jointpos", "jointvel"]), joint=one("joint"))
    elif kind == "equality":
        ET.SubElement(
            ET.SubElement(root, "equality"), rng.choice(["weld", "connect"]), body1=one("body"), anchor="0 0 0"
        )
    elif kind == "keyframe":
        ET.SubElement(
            ET.SubElement(root, "keyframe"), "key", name="start", qpos=_numbers(rng, rng.choice([1, 2, 7, 9]))
        )
    elif kind == "contact":
        ET.SubElement(ET.SubElement(root, "contact"), "exclude", body1=one("body"), body2=one("body"))
    elif kind == "option":
        name = rng.choice(["timestep", "gravity", "density", "wind", "solver", "iterations", "cone", "integrator"])
        ET.SubElement(root, "option", {name: rng.choice(["0", "-1", "nan", "0.01", "1", "0 0 -9.81", "Newton", "RK4"])})
    elif kind == "size":
        name = rng.choice(["memory", "njmax", "nconmax", "nuser_geom", "nuser_body", "nkey", "nuserdata"])
        ET.SubElement(root, "size", {name: rng.choice(["1", "1000", "2000000000", "1M", "-5"])})
    elif kind == "include":
        ET.SubElement(root, "include", file=rng.choice(["none.xml", "b.xml", "/dev/null"]))
    else:
        ET.SubElement(root, kind)


def _mutate(rng, root) -> None:
    """An attribute or element out of place."""
    elements = list(root.iter())
    element = rng.choice(elements)
    how = rng.randrange(5)
    if how == 0 and element.attrib:
        element.set(rng.choice(list(element.attrib)), rng.choice(WORDS).replace("\x00", ""))
    elif how == 1:
        element.set(
            rng.choice(["size", "pos", "mass", "type", "axis", "foo", "quat", "gravcomp", "margin"]), rng.choice(WORDS)
        )
    elif how == 2:
        ET.SubElement(element, rng.choice(INNER + OUTER), {})
    elif how == 3 and element.attrib:
        del element.attrib[rng.choice(list(element.attrib))]
    elif how == 4:
        wrap = ET.SubElement(element, "replicate", count=rng.choice(["2", "1000000", "0", "-1"]), offset="0.1 0 0")
        ET.SubElement(ET.SubElement(wrap, "body"), "geom", size="0.1")
