import os

import pytest


def pytest_collection_modifyitems(items):
    """Tests marked slow run only when SPINDRIFT_SLOW=1."""
    if os.environ.get("SPINDRIFT_SLOW") != "1":
        for item in items:
            if "slow" in item.keywords:
                item.add_marker(pytest.mark.skip(reason="slow; set SPINDRIFT_SLOW=1"))
