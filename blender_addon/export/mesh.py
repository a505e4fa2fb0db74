"""Evaluated meshes, in bulk."""

from __future__ import annotations

import ctypes
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..log import ExportLog

# Attribute types that a shader can read: property of an element, and its number of floats.
_ATTRIBUTE_TYPES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
}


def _get(collection: Any, name: str, count: int, dtype: Any) -> np.ndarray:
    values = np.empty(count, dtype)
    if count:
        collection.foreach_get(name, values)
    return values


def _triangle_corners(mesh: bpy.types.Mesh) -> np.ndarray:
    """Corner index of each triangle's corners, flat.

    Blender keeps the triangles as an array of three 32-bit indices, which is read in place where
    its first and last triangle look as expected: seven times as fast as asking for it.
    """
    triangles = mesh.loop_triangles
    count = len(triangles)
    address = triangles[0].as_pointer()
    if triangles[count - 1].as_pointer() - address == 12 * (count - 1):
        corners = np.ctypeslib.as_array((ctypes.c_int32 * (3 * count)).from_address(address))
        ends = (0, count // 2, count - 1)
        if all(tuple(corners[3 * i : 3 * i + 3]) == tuple(triangles[i].loops) for i in ends):
            return corners.astype(np.uint32)
    return _get(triangles, "loops", 3 * count, np.int32).astype(np.uint32)


class MeshArrays:
    """The arrays of one mesh, as triangles with the triangulation that Blender shows."""

    def __init__(self, mesh: bpy.types.Mesh) -> None:
        self.mesh = mesh
        mesh.calc_loop_triangles()
        self.triangle_count = len(mesh.loop_triangles)
        if not self.triangle_count:
            return
        corner_count = len(mesh.loops)
        self.points = _get(
            mesh.attributes["position"].data, "vector", 3 * len(mesh.vertices), np.float32
        ).reshape(-1, 3)
        corner_points = _get(mesh.attributes[".corner_vert"].data, "value", corner_count, np.int32)
        self.corners = _triangle_corners(mesh)
        self.indices = corner_points.astype(np.uint32)[self.corners]
        self.polygons = _get(mesh.loop_triangle_polygons, "value", self.triangle_count, np.int32)

    def generated(self) -> np.ndarray:
        """Where the points are in the mesh's texture space, before modifiers."""
        mesh = self.mesh
        points = _get(mesh.vertices, "undeformed_co", 3 * len(mesh.vertices), np.float32)
        centre, size = np.array(mesh.texspace_location), np.array(mesh.texspace_size)
        half = np.divide(0.5, size, out=np.zeros(3), where=size != 0.0)
        return (points.reshape(-1, 3) - centre) * half + 0.5

    def slots(self) -> np.ndarray | None:
        """Material slot of each triangle; None where all are 0."""
        attribute = self.mesh.attributes.get("material_index")
        if attribute is None or attribute.domain != "FACE" or attribute.data_type != "INT":
            return None
        values = _get(attribute.data, "value", len(self.mesh.polygons), np.int32)
        if not values.any():
            return None
        return np.maximum(values, 0).astype(np.uint32)[self.polygons]

    def normals(self) -> tuple[np.ndarray | None, str]:
        """Shading normals and where they sit; None for flat shading."""
        mesh = self.mesh
        if mesh.normals_domain == "FACE":
            return None, "face"
        if mesh.normals_domain == "POINT":
            values = _get(mesh.vertex_normals, "vector", 3 * len(mesh.vertices), np.float32)
            return values.reshape(-1, 3), "vertex"
        values = _get(mesh.corner_normals, "vector", 3 * len(mesh.loops), np.float32)
        return values.reshape(-1, 3)[self.corners], "corner"

    def uv_maps(self) -> list[tuple[str, np.ndarray]]:
        """Every UV map as (name, values at the corners), the one rendered by default first."""
        layers = sorted(self.mesh.uv_layers, key=lambda layer: not layer.active_render)
        count = len(self.mesh.loops)
        return [
            (layer.name, _get(layer.uv, "vector", 2 * count, np.float32).reshape(-1, 2))
            for layer in layers
        ]

    def attribute(self, name: str) -> tuple[np.ndarray, str, np.ndarray | None] | None:
        """A generic attribute as (values, interpolation, indices); None if there is none to use."""
        attribute = self.mesh.attributes.get(name)
        if attribute is None or attribute.data_type not in _ATTRIBUTE_TYPES:
            return None
        member, width = _ATTRIBUTE_TYPES[attribute.data_type]
        dtype = {"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}.get(
            attribute.data_type, np.float32
        )
        values = _get(attribute.data, member, width * len(attribute.data), dtype).astype(np.float32)
        values = values.reshape(-1, width)
        if width == 1:
            values = np.repeat(values, 3, axis=1)
        if attribute.domain == "POINT":
            return values, "vertex", None
        if attribute.domain == "CORNER":
            return values, "corner", self.corners
        if attribute.domain == "FACE":
            return values[self.polygons], "face", None
        if attribute.domain == "EDGE":
            return self._points_of_edges(values), "vertex", None
        return None

    def _points_of_edges(self, values: np.ndarray) -> np.ndarray:
        """At each point the mean over the edges that meet there, as Blender takes it."""
        mesh = self.mesh
        ends = _get(mesh.edges, "vertices", 2 * len(mesh.edges), np.int32)
        count = np.bincount(ends, minlength=len(mesh.vertices))
        result = np.empty((len(mesh.vertices), values.shape[1]), np.float32)
        for column, target in zip(values.T, result.T, strict=True):
            sums = np.bincount(ends, np.repeat(column, 2), minlength=len(mesh.vertices))
            target[:] = sums / np.maximum(count, 1)
        return result


@dataclass(frozen=True)
class Reading:
    """What a shader reads of an attribute: `affine`, three rows of four, times its components.

    With `factor` they are one number: as in Cycles the mean of a vector or colour, and the first of
    two.
    """

    name: str
    factor: bool
    affine: tuple[float, ...]

    def apply(self, values: np.ndarray) -> np.ndarray:
        """What is read of an attribute with 2, 3 or 4 components; an alpha stays as it is."""
        if self.factor:
            values = values[:, :1] if values.shape[1] == 2 else values[:, :3]
            values = np.repeat(values.mean(axis=1, keepdims=True), 3, axis=1)
        elif values.shape[1] == 2:
            values = np.pad(values, ((0, 0), (0, 1)))
        matrix = np.array(self.affine, np.float32).reshape(3, 4)
        result = values.copy()
        result[:, :3] = values[:, :3] @ matrix[:, :3].T + matrix[:, 3]
        return result


@dataclass(frozen=True)
class Projection:
    """An attribute made of where points are: a UV map, or a colour that is a place in space.

    `space`: "object"; "generated": within the mesh's texture space, before modifiers; or "uv", by
    the map of the name `uv`. `affine`: three rows of four, times these coordinates, of which the
    first `width` are kept. With `in_layers` the first coordinate grows by 0.5 in every other layer
    of the third, which are 0.5 high.
    """

    space: str
    uv: str
    affine: tuple[float, ...]
    width: int
    in_layers: bool = False

    def apply(self, segue: Any, name: str, arrays: MeshArrays) -> tuple[Any, bool]:
        """The attribute; whether one layer holds all of it, where they matter."""
        points, indices = self._points(arrays)
        matrix = np.array(self.affine).reshape(3, 4)
        values = points @ matrix[:, :3].T + matrix[:, 3]
        is_level = True
        if self.in_layers:
            layers = np.floor(2.0 * values[:, 2])
            values[:, 0] += 0.5 * (np.median(layers) % 2)
            is_level = bool(layers.min() == layers.max())
        domain = "vertex" if indices is None else "corner"
        kept = values[:, : self.width].astype(np.float32)
        return segue.Attribute(name, kept, domain, indices=indices), is_level

    def _points(self, arrays: MeshArrays) -> tuple[np.ndarray, np.ndarray | None]:
        """Coordinates, and their indices where corners have them."""
        if self.space == "object":
            return arrays.points, None
        if self.space == "generated":
            return arrays.generated(), None
        maps = [values for name, values in arrays.uv_maps() if name == self.uv or not self.uv]
        flat = maps[0] if maps else np.zeros((len(arrays.mesh.loops), 2), np.float32)
        return np.pad(flat, ((0, 0), (0, 1))), arrays.corners


def add_mesh(
    segue: Any,
    scene: Any,
    arrays: MeshArrays,
    *,
    readings: Mapping[str, Reading],
    uvs: Collection[str],
    projections: Mapping[str, Projection],
    log: ExportLog,
) -> int:
    """Add a mesh with its UV maps, other attributes that are read as `uvs`, and the `readings`.

    The engine tells colours from UV maps by their number of components, so that one name may be
    both.
    """
    normals, interpolation = arrays.normals()
    uv_maps = arrays.uv_maps()
    attributes = [
        segue.Attribute(name, values, "corner", indices=arrays.corners) for name, values in uv_maps
    ]
    names = {name for name, _ in uv_maps}
    for name in sorted(set(uvs) - names):
        found = arrays.attribute(name)
        if found is not None:
            values, domain, indices = found
            attributes.append(segue.Attribute(name, values[:, :2], domain, indices=indices))
    for name, projection in projections.items():
        attribute, is_level = projection.apply(segue, name, arrays)
        attributes.append(attribute)
        if not is_level:
            log.warn(
                f"Mesh '{arrays.mesh.name}': a checker in space is not supported, it does not "
                "change along its third axis"
            )
    for name, reading in readings.items():
        found = arrays.attribute(reading.name)
        if found is not None:
            values, domain, indices = found
            attributes.append(segue.Attribute(name, reading.apply(values), domain, indices=indices))
    return scene.add_mesh(
        arrays.mesh.name,
        arrays.points,
        arrays.indices,
        normals=normals,
        normal_interpolation=interpolation,
        face_slots=arrays.slots(),
        attributes=attributes,
    )
