"""Every case of `cases/`, one process each."""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path

import pytest

# Module of cases -> engine: "fake" records what the add-on exports, "real" renders, "installed" is
# the extension's archive.
MODULES = {
    "agreement": "real",
    "camera": "fake",
    "curve": "fake",
    "engine": "fake",
    "extension": "installed",
    "failures": "fake",
    "geometry": "fake",
    "images": "real",
    "lights": "fake",
    "materials": "fake",
    "nodes": "fake",
    "rendering": "real",
    "shared": "real",
    "world": "fake",
}


def cases(module: str) -> list[str]:
    """Names of the cases of a module, without importing it (it imports `bpy`)."""
    tree = ast.parse((Path(__file__).parent / "cases" / f"{module}.py").read_text())
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    return [name for name in functions if name.startswith("case_")]


CASES = [(module, name, engine) for module, engine in MODULES.items() for name in cases(module)]


@pytest.mark.parametrize(
    ("module", "name", "engine"), CASES, ids=[f"{case[0]}-{case[1][5:]}" for case in CASES]
)
def test_case(
    run_case: Callable[[str, str, str], None], module: str, name: str, engine: str
) -> None:
    """Run one case."""
    run_case(module, name, engine)
