"""What an object carries from one step to the next, as plain data (`fsi.protocols.Stateful`)."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

Data = dict[str, Any]  # nested: arrays, numbers, strings, None, lists of these


class Remembers:
    """Gives a class `state` and `restore` for the attributes named in `remembered`: plain data, or parts that have both
    methods themselves (None where a scene has no such part)."""

    remembered: ClassVar[tuple[str, ...]] = ()

    def state(self) -> Data:
        """The attributes by name, arrays copied."""
        return {name: _kept(getattr(self, name)) for name in self.remembered}

    def restore(self, state: Data) -> None:
        """Take over a state of an object that was made in the same way. Raises ValueError where it has other parts."""
        if set(state) != set(self.remembered):
            raise ValueError(f"{type(self).__name__}: the state has {sorted(state)}, not {sorted(self.remembered)}")
        for name, value in state.items():
            part = getattr(self, name)
            if hasattr(part, "restore"):
                if value is None:
                    raise ValueError(f"{type(self).__name__}: the state has no {name}")
                part.restore(value)
            else:
                if part is None and isinstance(value, dict):
                    raise ValueError(f"{type(self).__name__}: the state has a part {name}, which is not here")
                if part is not value:
                    setattr(self, name, plain(value))


def _kept(value):
    return value.state() if hasattr(value, "state") else plain(value)


def plain(value):
    """A copy of plain data that shares no memory with it. Raises TypeError for what is none."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    if value is None or isinstance(value, bool | int | float | str | np.generic):
        return value
    raise TypeError(f"{type(value).__name__} has no state() and is no plain data")
