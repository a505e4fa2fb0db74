"""Direct material bindings that bind nothing, which USD passes over in silence."""

from __future__ import annotations

from ._pxr import Sdf, Usd, UsdShade
from .report import Report


class Bindings:
    """Looks at each prim's bindings once."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._checked: set[Sdf.Path] = set()

    def check(self, prim: Usd.Prim) -> None:
        """Reports those of a prim and of all above it, which it inherits."""
        while prim and prim.GetPath() not in self._checked:
            self._checked.add(prim.GetPath())
            for purpose in UsdShade.MaterialBindingAPI.GetMaterialPurposes():
                name = ":".join(filter(None, (UsdShade.Tokens.materialBinding, purpose)))
                fault = _fault(prim.GetRelationship(name))
                if fault:
                    self._report.warning(prim, f"{name} {fault}", "the binding is ignored")
            prim = prim.GetParent()


def _fault(binding: Usd.Relationship) -> str:
    """Why a binding binds nothing, or ""."""
    targets = binding.GetForwardedTargets() if binding else []
    if len(targets) > 1:
        return f"has {len(targets)} targets"
    if targets:
        target = binding.GetStage().GetPrimAtPath(targets[0])
        if not target:
            return f"names {targets[0]}, which does not exist"
        if not UsdShade.Material(target):
            return f"names {targets[0]}, which is no material"
    return ""
