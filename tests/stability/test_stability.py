"""The stability suite in its fast form: every row of every case is right."""

from __future__ import annotations

import pytest

import suite  # noqa: F401  (registers the cases)
from case import CASES, Case


@pytest.mark.parametrize("case", CASES, ids=[c.run.__name__ for c in CASES])
def test_case(case: Case) -> None:
    rows = list(case.run(False))
    assert rows
    wrong = [
        f"{r.parameter}: {r.got:.6g} instead of {r.expected:.6g} ({r.off:+.2%}, "
        f"noise {r.noise:.2%}, allowed {r.tolerance:.2%}, {r.refused} refused)"
        for r in rows
        if not r.is_right
    ]
    assert not wrong, "\n".join([case.name, *wrong])
