"""Every case of `cases/`, one process each."""

from __future__ import annotations

import pytest
from conftest import cases

# Module of cases -> engine: "fake" records what the add-on exports, "real" renders.
MODULES = {
    "camera": "fake",
    "engine": "fake",
    "failures": "fake",
    "geometry": "fake",
}

CASES = [(module, name, engine) for module, engine in MODULES.items() for name in cases(module)]


@pytest.mark.parametrize(("module", "name", "engine"), CASES, ids=[f"{case[0]}-{case[1][5:]}" for case in CASES])
def test_case(run_case, module: str, name: str, engine: str) -> None:
    """Run one case."""
    run_case(module, name, engine)
