"""Going on with a run that was interrupted or killed, and completing what it left."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fsi.errors import SceneError
from fsi.messages import Messages
from fsi.record.dataset import damage_of
from fsi.record.manifest import liveness, process
from fsi.record.run_folder import RunFolder
from fsi.runner import Run, finish, opened
from fsi.scene.file import load_scene
from fsi.simulation import checkpoint
from fsi.trust import trusting

if TYPE_CHECKING:
    from fsi.protocols import Controller


def resume(
    directory: str | Path,
    *,
    until: float | None = None,
    threads: int | None = None,
    trust: bool = False,
    quiet: bool = False,
    controller: Controller | None = None,
    control_interval: float | None = None,
    ranks: Any = None,
) -> Run:
    """Go on with the run of a folder from its last checkpoint, in the same folder, to `until` [s] (the scene's duration if
    not given). The log is cut back to the checkpoint, so that its files at the end are those of a run that was never
    stopped, bit for bit; `run.clock` and `run.json` apart. `trust` lets the Python code run that the scene names (`fsi.trust`).
    A controller that was given to `fsi.run` in Python has to be given again, as a fresh object.

    Raises SceneError where the run goes on elsewhere, has ended, has no checkpoint, or one of another scene or version;
    RunError where the run fails.
    """
    path = Path(directory)
    taken = ranks.folder(RunFolder.open, path) if ranks else RunFolder.open(path)
    with taken as folder, trusting(trust):
        return _go_on(folder, until, threads, Messages(quiet), quiet, controller, control_interval, ranks)


def _go_on(
    folder: RunFolder,
    until: float | None,
    threads: int | None,
    say: Messages,
    quiet: bool,
    controller: Controller | None,
    control_interval: float | None,
    ranks: Any,
) -> Run:
    path, manifest = folder.path, folder.manifest
    status = liveness(manifest, claimed=True)
    if status == "running":
        fault = f"{path} holds a run that is going on (process {manifest['pid']} on {manifest['host']})"
        raise SceneError(fault, fix="wait for it, or stop it first")
    scene = load_scene(path / "scene.toml")
    if status == "done" and (until or scene.duration) <= manifest["simulated_seconds"] * (1 + 1e-9):
        raise SceneError(f"{path} holds a run that is done", fix="give a later time with --until")
    facts, state = _latest(path, say)
    if wrong := differences(facts, checkpoint.circumstances(scene)):
        fix = "use what wrote it, or run the scene again in another folder"
        raise SceneError("the checkpoint is one of another run:\n" + "\n".join(wrong), file=path, fix=fix)
    from fsi.record.background import open_recorders
    from fsi.simulation.loop import Simulation

    recorders = opened(ranks, open_recorders, scene, path, None, state.pop("log"))
    threads = ranks.threads(threads) if ranks else threads
    sim = Simulation(scene, recorders=recorders, threads=threads, ranks=ranks)
    if controller is not None:
        sim.steer(controller, control_interval)
    try:
        sim.restore(state)
    except (ValueError, KeyError) as fault:
        raise SceneError(f"the checkpoint does not fit: {fault}", file=path, fix="run the scene again") from fault
    del state
    if ranks:
        ranks.ranks.barrier()  # all have read what is renewed now
    again = [*manifest.get("resumed", []), {"time": facts["time"], "step": facts["step"], "was": status}]
    folder.write(status="running", reason="", resumed=again, threads=sim.threads, **process())
    say(f"going on in {path} from t = {facts['time']:.4g} s, step {facts['step']}")
    return finish(sim, folder, recorders, scene.duration if until is None else until, say, quiet=quiet)


def recover(directory: str | Path) -> str:
    """Complete `run.mcap` of a run that was killed, with its summary, and say so in `run.json`; a line on what was found.
    Nothing is done to a run that is going on (SceneError) or has been completed."""
    path = Path(directory)
    with RunFolder.open(path) as folder:
        status = liveness(folder.manifest, claimed=True)
        if status == "running":
            raise SceneError(f"{path} holds a run that is going on (on {folder.manifest['host']})", fix="stop it first")
        if status == "killed":
            folder.write(status="killed", reason="the process ended without a word")
        log = path / "run.mcap"
        if not log.is_file():
            return f"{path} has no log"
        from fsi.record.mcap import rewrite
        from fsi.record.mcap_reader import read_log

        damage = damage_of(read_log(log), folder.manifest)
        count, whole = rewrite(log)
        if (recording := path / "run.rrd").is_file():
            from fsi.record.timeline_reader import cut_off

            cut_off(recording)
    return f"{log}: {count} messages, {'was complete' if whole else 'now complete'}" + (damage and f"; {damage}")


def differences(found: dict, here: dict) -> list[str]:
    """Lines on how the circumstances of a checkpoint differ from those here (`checkpoint.circumstances`)."""
    versions = [
        f"{name} was {number}, is {here['versions'].get(name, 'not there')}"
        for name, number in found["versions"].items()
        if here["versions"].get(name) != number
    ]
    lines = difflib.unified_diff(found["scene"].splitlines(), here["scene"].splitlines(), lineterm="", n=0)
    return versions + [f"scene.toml: {line}" for line in list(lines)[2:] if not line.startswith("@@")]


def _latest(path: Path, say) -> tuple[dict, dict]:
    """Facts and state of the newest checkpoint that is whole."""
    for file in checkpoint.files(path):
        try:
            return checkpoint.read(file)
        except SceneError as fault:
            say(str(fault))
    every = "output.checkpoint = 300 writes one every 300 s"
    raise SceneError(f"{path} holds no checkpoint", fix=f"run the scene again in another folder; {every}")


__all__ = ["differences", "recover", "resume"]
