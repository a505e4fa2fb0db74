"""Scenes: meshes, images, textures, materials, lights, camera and instances, from numpy arrays."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _abi
from ._library import check, library
from ._values import array, from_json, pointer, text, to_json
from .errors import BadArgumentError


@dataclass(frozen=True)
class Attribute:
    """A named attribute of a mesh: a UV set (2 floats) or a colour (3 or 4 floats).

    Attributes:
        name: what textures call it.
        data: (n, 2|3|4) values.
        interpolation: "constant", "face", "vertex" or "corner".
        indices: one index into `data` per element, or None: the values are in order.
    """

    name: str
    data: npt.ArrayLike
    interpolation: str = "vertex"
    indices: npt.ArrayLike | None = None


def _interpolation(name: str, what: str) -> int:
    try:
        return _abi.INTERPOLATIONS[name]
    except KeyError:
        known = ", ".join(_abi.INTERPOLATIONS)
        raise BadArgumentError(f"{what}: {name!r} is none of {known}") from None


class Scene:
    """A scene under construction. What a call is given is copied by the engine; nothing is kept."""

    def __init__(self) -> None:
        self._handle = ctypes.c_void_p()
        self._library = library()
        check(self._library.segue_scene_create(ctypes.byref(self._handle)))

    def __del__(self) -> None:
        handle = getattr(self, "_handle", None)
        if handle:
            self._library.segue_scene_free(handle)
            self._handle = ctypes.c_void_p()

    @property
    def handle(self) -> ctypes.c_void_p:
        """The engine's handle."""
        return self._handle

    def add_mesh(
        self,
        name: str,
        points: npt.ArrayLike,
        face_indices: npt.ArrayLike,
        face_counts: npt.ArrayLike | None = None,
        normals: npt.ArrayLike | None = None,
        normal_interpolation: str = "vertex",
        face_slots: npt.ArrayLike | None = None,
        holes: npt.ArrayLike | None = None,
        left_handed: bool = False,
        attributes: Sequence[Attribute] = (),
    ) -> int:
        """Adds a polygon mesh and returns its id.

        Args:
            name: for messages and statistics.
            points: (n, 3) float32 positions, object space.
            face_indices: point index of every polygon corner, uint32.
            face_counts: corners of each polygon, uint32; None: all are triangles.
            normals: (n, 3) float32 shading normals; None: flat shading.
            normal_interpolation: where the normals sit.
            face_slots: material slot of each polygon, uint32; None: all 0.
            holes: indices of polygons that are not there.
            left_handed: corners wind clockwise seen from the front.
            attributes: UV sets and colours.
        """
        vertices = array(points, np.float32, (-1, 3), f"{name}: points")
        corners = array(face_indices, np.uint32, (-1,), f"{name}: face_indices")
        counts = slots = hole_list = normal_list = None
        faces = len(corners) // 3
        if face_counts is not None:
            counts = array(face_counts, np.uint32, (-1,), f"{name}: face_counts")
            faces = len(counts)
        elif len(corners) % 3:
            raise BadArgumentError(f"{name}: {len(corners)} corners are not whole triangles")
        if face_slots is not None:
            slots = array(face_slots, np.uint32, (-1,), f"{name}: face_slots")
            if len(slots) != faces:
                raise BadArgumentError(f"{name}: {len(slots)} face_slots for {faces} faces")
        if holes is not None:
            hole_list = array(holes, np.uint32, (-1,), f"{name}: holes")
        if normals is not None:
            normal_list = array(normals, np.float32, (-1, 3), f"{name}: normals")
        packed, kept = _pack_attributes(name, attributes)
        mesh = _abi.CMesh(
            name=text(name, "mesh name"),
            points=pointer(vertices),
            point_count=len(vertices),
            face_counts=pointer(counts),
            face_count=faces,
            face_indices=pointer(corners),
            face_index_count=len(corners),
            holes=pointer(hole_list),
            hole_count=0 if hole_list is None else len(hole_list),
            normals=pointer(normal_list),
            normal_count=0 if normal_list is None else len(normal_list),
            normal_interpolation=_interpolation(normal_interpolation, f"{name}: normals"),
            face_slots=pointer(slots),
            left_handed=bool(left_handed),
            attributes=packed,
            attribute_count=len(packed),
        )
        number = ctypes.c_uint32()
        check(
            self._library.segue_scene_add_mesh(
                self._handle, ctypes.byref(mesh), ctypes.byref(number)
            )
        )
        del kept  # the arrays had to outlive the call
        return number.value

    def add_image(self, name: str, pixels: npt.ArrayLike, colorspace: str = "srgb") -> int:
        """Adds a picture and returns its id.

        Args:
            name: for messages.
            pixels: (h, w) or (h, w, c) uint8, uint16, float16 or float32 with 1 to 4 channels,
                row 0 on top.
            colorspace: "srgb" is decoded (colour channels only); "linear" and "raw" are not.
        """
        values = np.asarray(pixels)
        if values.ndim == 2:
            values = values[:, :, None]
        kind = _abi.PIXEL_TYPES.get(values.dtype.name)
        if kind is None:
            known = ", ".join(_abi.PIXEL_TYPES)
            raise BadArgumentError(f"{name}: {values.dtype} pixels, which are none of {known}")
        if values.ndim != 3:
            raise BadArgumentError(f"{name}: pixels of shape {values.shape}, not (h, w, c)")
        values = np.ascontiguousarray(values)
        image = _abi.CImage(
            name=text(name, "image name"),
            width=values.shape[1],
            height=values.shape[0],
            channels=values.shape[2],
            pixel_type=kind,
            pixels=pointer(values),
            colorspace=text(colorspace, "colorspace"),
        )
        number = ctypes.c_uint32()
        check(
            self._library.segue_scene_add_image(
                self._handle, ctypes.byref(image), ctypes.byref(number)
            )
        )
        return number.value

    def add_texture(self, name: str, texture: Mapping[str, Any]) -> int:
        """Adds a texture and returns its id. Its keys are those of docs/abi.md, "Textures"."""
        return self._add(self._library.segue_scene_add_texture, name, texture)

    def add_material(self, name: str, material: Mapping[str, Any]) -> int:
        """Adds a material and returns its id. Its keys are those of docs/abi.md, "Materials"."""
        return self._add(self._library.segue_scene_add_material, name, material)

    def add_light(self, name: str, light: Mapping[str, Any]) -> int:
        """Adds a light and returns its id. Its keys are those of docs/abi.md, "Lights"."""
        return self._add(self._library.segue_scene_add_light, name, light)

    def set_camera(self, name: str, camera: Mapping[str, Any]) -> None:
        """Sets the camera. Its keys are those of docs/abi.md, "Camera"."""
        check(
            self._library.segue_scene_set_camera(
                self._handle, text(name, "camera name"), to_json(camera, name)
            )
        )

    def add_instances(
        self,
        name: str,
        mesh: int,
        transforms: npt.ArrayLike,
        materials: Sequence[int] = (),
        camera_visible: bool = True,
        two_sided_emission: bool = True,
        object_index: int = 0,
    ) -> None:
        """Adds instances of one mesh, all with the same materials.

        Args:
            name: for messages.
            mesh: id of the mesh.
            transforms: (n, 4, 4) float64, object to world, for column vectors.
            materials: material id of each slot; a slot past the end uses the last, none at all
                the default grey.
            camera_visible: seen by camera rays.
            two_sided_emission: emissive materials emit from both sides.
            object_index: value of the Object Index pass.
        """
        matrices = array(transforms, np.float64, (-1, 4, 4), f"{name}: transforms")
        slots = array(materials, np.uint32, (-1,), f"{name}: materials")
        instances = _abi.CInstances(
            name=text(name, "instances' name"),
            mesh=mesh,
            transforms=pointer(matrices),
            count=len(matrices),
            materials=pointer(slots),
            material_count=len(slots),
            camera_visible=bool(camera_visible),
            two_sided_emission=bool(two_sided_emission),
            object_index=object_index,
        )
        check(self._library.segue_scene_add_instances(self._handle, ctypes.byref(instances)))

    def info(self) -> dict[str, Any]:
        """Warnings, needs, what is left out, and counts."""
        answer = ctypes.c_char_p()
        check(self._library.segue_scene_info(self._handle, ctypes.byref(answer)))
        return from_json(answer)

    def _add(self, function: Any, name: str, value: Mapping[str, Any]) -> int:
        number = ctypes.c_uint32()
        check(
            function(self._handle, text(name, "name"), to_json(value, name), ctypes.byref(number))
        )
        return number.value


def _pack_attributes(mesh: str, attributes: Sequence[Attribute]) -> tuple[ctypes.Array, list]:
    """The attributes as a C array, and the numpy arrays that it points into."""
    packed = (_abi.CAttribute * len(attributes))()
    kept: list = []
    for target, given in zip(packed, attributes):
        what = f"{mesh}: attribute {given.name!r}"
        data = np.asarray(given.data)
        components = data.shape[-1] if data.ndim == 2 else 0
        if components not in (2, 3, 4):
            raise BadArgumentError(f"{what}: an array of shape {data.shape}, not (n, 2|3|4)")
        values = array(data, np.float32, (-1, components), what)
        target.name = text(given.name, what)
        target.data = pointer(values)
        target.count = len(values)
        target.components = components
        target.interpolation = _interpolation(given.interpolation, what)
        kept.append(values)
        if given.indices is not None:
            indices = array(given.indices, np.uint32, (-1,), f"{what}: indices")
            target.indices = pointer(indices)
            target.index_count = len(indices)
            kept.append(indices)
    return packed, kept
