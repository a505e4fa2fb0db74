"""Point instancers: one set of transformations for each prototype."""

from __future__ import annotations

import numpy as np

from ._pxr import Sdf, Tf, Usd, UsdGeom
from .mesh_data import numbers
from .report import Report


def instance_transforms(
    instancer: UsdGeom.PointInstancer, time: Usd.TimeCode, report: Report
) -> list[tuple[Sdf.Path, np.ndarray]]:
    """The instances that are there at a time, by prototype.

    Inactive and invisible ids are left out. Orientations may be half or float quaternions,
    positions are moved along authored velocities: both as `ComputeInstanceTransformsAtTime` does.

    Returns:
        (path of the prototype, (n, 4, 4) instance to instancer, for column vectors), without the
        prototype's own transformation, in the prototypes' order.
    """
    prim = instancer.GetPrim()
    targets = instancer.GetPrototypesRel().GetForwardedTargets()
    indices = numbers(instancer.GetProtoIndicesAttr(), time)
    if indices is None:
        report.warning(prim, "a PointInstancer whose protoIndices are no integers", "left out")
        return []
    if not len(indices):
        report.left_out(prim, "a PointInstancer without instances")
        return []
    try:
        matrices = instancer.ComputeInstanceTransformsAtTime(
            time,
            time,
            UsdGeom.PointInstancer.ExcludeProtoXform,
            UsdGeom.PointInstancer.IgnoreMask,
        )
        mask = np.array(instancer.ComputeMaskAtTime(time), dtype=bool)
    except Tf.ErrorException:
        matrices, mask = (), np.zeros(0, bool)
    if len(matrices) != len(indices):
        report.warning(
            prim,
            f"a PointInstancer with {len(indices)} instances whose positions, orientations or "
            "scales are of another number",
            "left out",
        )
        return []
    for found in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues():
        # Only what is constant says the same of every instance, and is inherited.
        if found.GetInterpolation() != UsdGeom.Tokens.constant:
            name = found.GetPrimvarName()
            report.unsupported(prim, f"values of '{name}' for each instance", "they are ignored")
    rows = np.array(matrices, dtype=np.float64).reshape(-1, 4, 4)
    keep = mask if len(mask) == len(indices) else np.ones(len(indices), bool)
    known = (indices >= 0) & (indices < len(targets))
    if not known.all():
        report.warning(
            prim, f"{int((~known).sum())} instances of a prototype that does not exist", "left out"
        )
    groups = []
    for number, target in enumerate(targets):
        chosen = keep & (indices == number)
        if not chosen.any():
            continue
        if not instancer.GetPrim().GetStage().GetPrimAtPath(target):
            report.warning(prim, f"the prototype {target} does not exist", "left out")
            continue
        groups.append((target, rows[chosen].transpose(0, 2, 1)))
    return groups
