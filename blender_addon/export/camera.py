"""Cameras: from Blender's sensor and lens to a window on the film."""

from __future__ import annotations

import math
from typing import Any

import bpy
from mathutils import Matrix

from ..log import ExportLog

# The ABI's default for the far end.
_NO_CLIPPING = 1e30


def camera_window(
    camera: bpy.types.Camera,
    resolution: tuple[int, int],
    pixel_aspect: tuple[float, float],
    shift_x: float,
) -> list[float]:
    """[x0, x1, y0, y1] that maps to the film's edges.

    Perspective: on the plane z = -1. Orthographic: in scene units. Follows Blender's rule that the
    sensor size (or orthographic scale) spans the fitted side, and that shifts are fractions of it.
    """
    width, height = resolution
    ratio = pixel_aspect[1] / pixel_aspect[0]
    fit = camera.sensor_fit
    horizontal = fit == "HORIZONTAL" or (
        fit == "AUTO" and pixel_aspect[0] * width >= pixel_aspect[1] * height
    )
    fitted = width if horizontal else ratio * height
    if camera.type == "ORTHO":
        size = camera.ortho_scale
    else:
        sensor = camera.sensor_height if fit == "VERTICAL" else camera.sensor_width
        size = sensor / camera.lens
    pixel = size / fitted
    centre_x = shift_x * size
    centre_y = camera.shift_y * size
    half_x = 0.5 * width * pixel
    half_y = 0.5 * height * ratio * pixel
    return [centre_x - half_x, centre_x + half_x, centre_y - half_y, centre_y + half_y]


def focus_distance(camera_object: bpy.types.Object) -> float:
    """Distance of the plane in focus along the view axis."""
    dof = camera_object.data.dof
    target = dof.focus_object
    if target is None:
        return dof.focus_distance
    matrix = target.matrix_world
    if dof.focus_subtarget and target.pose and dof.focus_subtarget in target.pose.bones:
        matrix = matrix @ target.pose.bones[dof.focus_subtarget].matrix
    axis = camera_object.matrix_world.col[2].to_3d().normalized()
    return abs(axis.dot(camera_object.matrix_world.translation - matrix.translation))


def camera_json(
    camera_object: bpy.types.Object,
    matrix: Matrix,
    resolution: tuple[int, int],
    pixel_aspect: tuple[float, float],
    shift_x: float,
    log: ExportLog,
) -> dict[str, Any]:
    """The camera object of the ABI; `matrix` is camera to world without scale."""
    camera = camera_object.data
    orthographic = camera.type == "ORTHO"
    if camera.type not in {"PERSP", "ORTHO"}:
        log.warn(
            f"Camera '{camera_object.name}': a {camera.type.lower()} lens is not supported, "
            "a perspective one of the same focal length is used"
        )
    near, far = camera.clip_start, camera.clip_end
    if near >= far:
        log.warn(
            f"Camera '{camera_object.name}': its clipping range from {near:.6g} to {far:.6g} is "
            "empty, nothing is clipped"
        )
        near, far = 0.0, _NO_CLIPPING
    result: dict[str, Any] = {
        "type": "orthographic" if orthographic else "perspective",
        "transform": [value for row in matrix for value in row],
        "window": camera_window(camera, resolution, pixel_aspect, shift_x),
        "near": near,
        "far": far,
    }
    dof = camera.dof
    if dof.use_dof:
        stop = max(dof.aperture_fstop, 1e-5)
        # Cycles' convention: the lens in millimetres, scene units in metres; an orthographic
        # camera counts as a lens of one metre.
        lens = 1.0 if orthographic else camera.lens * 1e-3
        distance = focus_distance(camera_object)
        if distance > 0.0 and math.isfinite(distance):
            result["aperture_radius"] = 0.5 * lens / stop
            result["focus_distance"] = distance
            result["blades"] = dof.aperture_blades if dof.aperture_blades >= 3 else 0
            # Blender's first corner points to the left, Segue's to the right.
            result["blade_rotation"] = dof.aperture_rotation + math.pi
            result["aperture_ratio"] = dof.aperture_ratio
        else:
            name = camera_object.name
            log.warn(f"Camera '{name}': the focus distance is 0, depth of field is left out")
    return result


def export_camera(
    scene: Any,
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    log: ExportLog,
) -> None:
    """Set the camera of the engine's active view."""
    camera = engine.camera_override
    if camera is None or camera.type != "CAMERA":
        raise ValueError("the scene has no camera")
    matrix = engine.camera_model_matrix(camera)
    if not all(math.isfinite(value) for row in matrix for value in row):
        raise ValueError(f"camera '{camera.name}': its transform is not finite")
    render = depsgraph.scene_eval.render
    data = camera_json(
        camera,
        matrix,
        (engine.resolution_x, engine.resolution_y),
        (render.pixel_aspect_x, render.pixel_aspect_y),
        engine.camera_shift_x(camera),
        log,
    )
    scene.set_camera(camera.name, data)
