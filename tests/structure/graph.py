"""The graph of imports of a checkout: `python tests/structure/graph.py [DIR] [--picture FILE]`.

Every import counts, also those within functions and those for type checkers alone. Prints files, floors (the longest chain of
imports), arrows and circles, of modules and of rooms (folders); draws the rooms of `fsi` and the packages around it.
"""

from __future__ import annotations

import argparse
import ast
from pathlib import Path

PACKAGES = ("fsi", "bodies", "couplers", "cases")
Graph = dict[str, set[str]]


def modules(root: Path) -> dict[str, Path]:
    """Module -> file of the packages in a checkout."""
    files = (path for package in PACKAGES for path in sorted((root / package).rglob("*.py")))
    return {".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path for path in files}


def imports(path: Path, module: str) -> list[tuple[str, str, int]]:
    """What a file imports: module, name that is taken from it ("" for all of it), line."""
    found = []
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(alias.name, "", node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            found += [(base, alias.name, node.lineno) for alias in node.names]
    return found


def graph(root: Path) -> Graph:
    """Module -> modules of ours that it imports. A package counts where a name is taken from its `__init__` itself."""
    files = modules(root)

    def targets(module: str) -> set[str]:
        taken = imports(files[module], module)
        return {f"{base}.{name}" if f"{base}.{name}" in files else base for base, name, _ in taken} & files.keys()

    return {module: targets(module) - {module} for module in files}


def room(module: str, files: dict[str, Path]) -> str:
    """The folder of a module, dotted; a module beside the rooms of a package, such as `fsi.runner`, stands for itself."""
    folder = module if files[module].name == "__init__.py" else module.rpartition(".")[0]
    return module if folder in PACKAGES else folder


def rooms(arrows: Graph, files: dict[str, Path]) -> Graph:
    """Room -> rooms that its modules import from."""
    found: Graph = {room(module, files): set() for module in arrows}
    for module, targets in arrows.items():
        here = room(module, files)
        found[here] |= {room(target, files) for target in targets} - {here}
    return found


def circles(arrows: Graph) -> list[list[str]]:
    """Sets of nodes that import each other, all ways round (strongly connected components; Tarjan 1972)."""
    index, low, stack, found = {}, {}, [], []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for target in sorted(arrows[node]):
            if target not in index:
                visit(target)
            if target in stack:
                low[node] = min(low[node], low[target])
        if low[node] == index[node]:
            together = stack[stack.index(node) :]
            del stack[-len(together) :]
            if len(together) > 1:
                found.append(sorted(together))

    for node in sorted(arrows):
        if node not in index:
            visit(node)
    return found


def floors(arrows: Graph) -> dict[str, int]:
    """Floor of each node: 1 more than the highest that it imports from; a circle counts as one node."""
    together = {node: tuple(group) for group in circles(arrows) for node in group}
    heights: dict[str, int] = {}

    def height(node: str) -> int:
        if node not in heights:
            group = together.get(node, (node,))
            below = {target for member in group for target in arrows[member]} - set(group)
            value = 1 + max(map(height, sorted(below)), default=0)
            heights.update(dict.fromkeys(group, value))
        return heights[node]

    return {node: height(node) for node in arrows}


def facts(arrows: Graph) -> str:
    """One line: nodes, floors, arrows, circles."""
    found = circles(arrows)
    sizes = f" of {', '.join(str(len(group)) for group in found)}" if found else ""
    return (
        f"{len(arrows)}, floors {max(floors(arrows).values(), default=0)}, "
        f"arrows {sum(map(len, arrows.values()))}, circles {len(found)}{sizes}"
    )


def within(arrows: Graph, package: str) -> Graph:
    """The part of the graph in a package."""
    inside = {node for node in arrows if node == package or node.startswith(f"{package}.")}
    return {node: arrows[node] & inside for node in inside}


def overview(root: Path) -> Graph:
    """Rooms of `fsi`, its runner and command, and the other packages as one node each, with the arrows that no longer way
    replaces."""
    files, arrows = modules(root), graph(root)

    def name(module: str) -> str:
        package, *rest = module.split(".")
        return ".".join(["fsi", *rest[:1]]) if package == "fsi" else package

    found: Graph = {}
    for module, targets in arrows.items():
        found.setdefault(name(module), set()).update({name(target) for target in targets} - {name(module)})
    folders = {node for node in found if node in PACKAGES or files[node].name == "__init__.py"}
    drawn = (folders | {"fsi.runner", "fsi.command"}) & found.keys() - {"fsi"}

    def below(node: str) -> set[str]:
        return {node}.union(*(below(target) for target in found[node] & drawn))

    return {
        node: {t for t in found[node] & drawn if not any(t in below(other) for other in found[node] & drawn - {t})}
        for node in drawn
    }


def picture(root: Path, file: Path) -> None:
    """Draw the overview: each node on its floor, with arrows down to what it imports."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "spindrift"  # the same file for the same graph
    import matplotlib.pyplot as plt

    arrows = overview(root)
    level = floors(arrows)
    top = max(level.values())
    places = {}
    for floor in range(1, top + 1):
        row = sorted(node for node in arrows if level[node] == floor)
        for n, node in enumerate(row):
            places[node] = ((n - (len(row) - 1) / 2) * 2.6 + (0.55 if floor % 2 else -0.55), 1.15 * floor)
    figure, axes = plt.subplots(figsize=(9, 1.15 * top + 0.6))
    boxes = {}
    for node, (x, y) in places.items():
        fill, edge = ("#dcebf7", "#31688e") if node.startswith("fsi") else ("#fbe9d3", "#b5651d")
        style = {"boxstyle": "round,pad=0.45", "fc": fill, "ec": edge}
        text = axes.text(x, y, node.removeprefix("fsi."), ha="center", va="center", fontsize=11, bbox=style, zorder=2)
        boxes[node] = text
    axes.set(xlim=(min(x for x, _ in places.values()) - 1.6, max(x for x, _ in places.values()) + 1.6))
    axes.set(ylim=(0.5, 1.15 * top + 0.6))
    figure.canvas.draw()  # the boxes have their sizes
    for node, targets in arrows.items():
        for target in targets:
            bend = f"arc3,rad={0.0 if level[node] - level[target] == 1 else 0.1}"
            ends = {"patchA": boxes[node].get_bbox_patch(), "patchB": boxes[target].get_bbox_patch()}
            line = {"arrowstyle": "-|>", "mutation_scale": 14, "color": "0.4", "lw": 1.2, "connectionstyle": bend}
            axes.annotate("", places[target], places[node], zorder=3, arrowprops=line | ends)
    axes.axis("off")
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, bbox_inches="tight", dpi=110, metadata={"Date": None} if file.suffix == ".svg" else None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", nargs="?", type=Path, default=Path(__file__).parents[2])
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw the rooms as SVG or PNG")
    chosen = parser.parse_args()
    arrows, files = graph(chosen.checkout), modules(chosen.checkout)
    print(f"all: files {facts(arrows)}")
    for package in PACKAGES:
        print(f"{package}: files {facts(within(arrows, package))}")
    print(f"rooms: {facts(rooms(arrows, files))}")
    for group in circles(arrows):
        print(f"circle: {', '.join(group)}")
    if chosen.picture:
        picture(chosen.checkout, chosen.picture)


if __name__ == "__main__":
    main()
