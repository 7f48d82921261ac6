from textwrap import dedent

import pytest

SMALL = """
    spacing = 0.02
    duration = 2.0

    [tank]
    min = [0.0, -0.5]
    max = [6.0, 0.5]
"""


@pytest.fixture
def scene_file(tmp_path):
    """Write a scene file: the small tank and what is added to it; `instead` replaces the tank too."""

    def write(added: str = "", *, instead: str | None = None, name: str = "pool.toml"):
        path = tmp_path / name
        path.write_text(dedent(SMALL if instead is None else instead) + dedent(added))
        return path

    return write
