"""The two ways a run can go wrong: the input (exit code 2) and the run itself (exit code 1)."""


class SceneError(ValueError):
    """The input is wrong. `str()` reads `file: key: fault; fix`, one line per fault."""

    def __init__(self, fault: str, *, key: str = "", file: object = "", fix: str = ""):
        self.fault, self.key, self.file, self.fix = fault, key, str(file), fix
        place = ": ".join(part for part in (short(self.file), key) if part)
        super().__init__((f"{place}: " if place else "") + fault + (f"; {fix}" if fix else ""))


def short(path: object) -> str:
    """A path as messages have it: of one that fills the screen, the beginning and the length."""
    text = str(path)
    return text if len(text) < 300 else f"{text[:100]}... ({len(text)} characters)"


class RunError(RuntimeError):
    """The run failed: unstable, particles lost beyond repair, or the disk is full."""
