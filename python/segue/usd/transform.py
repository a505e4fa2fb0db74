"""Matrices: from USD's row vectors to the ABI's column vectors, in double precision."""

from __future__ import annotations

import numpy as np

from ._pxr import Gf, Tf, Usd, UsdGeom
from .report import Report


def column_matrix(matrix: Gf.Matrix4d) -> np.ndarray:
    """A USD matrix as a (4, 4) float64 array for column vectors."""
    return np.array(matrix, dtype=np.float64).T.copy()


def flat(matrix: np.ndarray) -> list[float]:
    """A (4, 4) matrix as the ABI's 16 numbers, row by row."""
    return [float(v) for v in matrix.reshape(16)]


def compose(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """All products of (m, 4, 4) outer and (n, 4, 4) inner matrices: (m n, 4, 4), outer major."""
    return (outer[:, None] @ inner[None]).reshape(-1, 4, 4)


def without_scale(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rigid part of a matrix and the lengths of its axes.

    The rotation is the orthogonal factor of the polar decomposition, the rotation closest to the
    matrix (Higham 1986); a mirroring stays in it.
    """
    linear = matrix[:3, :3]
    lengths = np.linalg.norm(linear, axis=0)
    if not np.all(np.isfinite(matrix)) or np.any(lengths == 0):
        return np.eye(4), lengths
    u, _, vt = np.linalg.svd(linear)
    rigid = np.eye(4)
    rigid[:3, :3] = u @ vt
    rigid[:3, 3] = matrix[:3, 3]
    return rigid, lengths


def is_usable(matrices: np.ndarray) -> np.ndarray:
    """Which of (n, 4, 4) matrices are affine with a finite, nonzero determinant."""
    result = np.isfinite(matrices).all(axis=(1, 2))
    result &= (matrices[:, 3] == [0, 0, 0, 1]).all(axis=1)
    result[result] = np.linalg.det(matrices[result, :3, :3]) != 0
    return result


def local_matrix(
    xformable: UsdGeom.Xformable, time: Usd.TimeCode, report: Report
) -> tuple[Gf.Matrix4d, bool]:
    """A prim's own transformation, and whether it resets the stack.

    Operations that cannot be read are left away, with a warning.
    """
    reset = xformable.GetResetXformStack()
    try:
        return xformable.GetLocalTransformation(time), reset
    except Tf.ErrorException:
        pass
    matrix = Gf.Matrix4d(1)
    for operation in _operations(xformable, report):
        matrix = _operation_matrix(operation, time, report) * matrix
    return matrix, reset


def _operation_matrix(
    operation: UsdGeom.XformOp, time: Usd.TimeCode, report: Report
) -> Gf.Matrix4d:
    try:
        return operation.GetOpTransform(time)
    except Tf.ErrorException:
        attribute = operation.GetAttr()
        what = f"{attribute.GetName()} has no value that can be used"
        report.warning(attribute.GetPrim(), what, "it is left away")
        return Gf.Matrix4d(1)


def _operations(xformable: UsdGeom.Xformable, report: Report) -> list[UsdGeom.XformOp]:
    try:
        return xformable.GetOrderedXformOps()
    except Tf.ErrorException:
        report.warning(xformable, "an xformOpOrder that cannot be used", "it is left away")
        return []


def world_matrix(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> Gf.Matrix4d:
    """A prim's transformation to the world."""
    matrix = Gf.Matrix4d(1)
    while prim:
        xformable = UsdGeom.Xformable(prim)
        if xformable:
            own, reset = local_matrix(xformable, time, report)
            matrix = matrix * own
            if reset:
                break
        prim = prim.GetParent()
    return matrix
