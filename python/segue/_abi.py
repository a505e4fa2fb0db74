"""The C ABI of `segue.h` as ctypes: structures, callback types and prototypes."""

from __future__ import annotations

import ctypes as c

ABI_VERSION = 1

PROGRESS_FN = c.CFUNCTYPE(c.c_int, c.c_void_p, c.c_char_p)
TILE_FN = c.CFUNCTYPE(None, c.c_void_p, c.c_uint32, c.c_uint32, c.c_uint32, c.c_uint32)

#: `segue_interpolation`
INTERPOLATIONS = {"constant": 0, "face": 1, "vertex": 2, "corner": 3}
#: `segue_pixel_type` by numpy dtype name
PIXEL_TYPES = {"uint8": 0, "uint16": 1, "float16": 2, "float32": 3}


class CAttribute(c.Structure):
    """`segue_attribute`."""

    _fields_ = (
        ("name", c.c_char_p),
        ("data", c.c_void_p),
        ("count", c.c_size_t),
        ("components", c.c_uint32),
        ("interpolation", c.c_uint32),
        ("indices", c.c_void_p),
        ("index_count", c.c_size_t),
    )


class CMesh(c.Structure):
    """`segue_mesh`."""

    _fields_ = (
        ("name", c.c_char_p),
        ("points", c.c_void_p),
        ("point_count", c.c_size_t),
        ("face_counts", c.c_void_p),
        ("face_count", c.c_size_t),
        ("face_indices", c.c_void_p),
        ("face_index_count", c.c_size_t),
        ("holes", c.c_void_p),
        ("hole_count", c.c_size_t),
        ("normals", c.c_void_p),
        ("normal_count", c.c_size_t),
        ("normal_interpolation", c.c_uint32),
        ("face_slots", c.c_void_p),
        ("left_handed", c.c_uint32),
        ("attributes", c.POINTER(CAttribute)),
        ("attribute_count", c.c_size_t),
    )


class CImage(c.Structure):
    """`segue_image`."""

    _fields_ = (
        ("name", c.c_char_p),
        ("width", c.c_uint32),
        ("height", c.c_uint32),
        ("channels", c.c_uint32),
        ("pixel_type", c.c_uint32),
        ("pixels", c.c_void_p),
        ("colorspace", c.c_char_p),
    )


class CInstances(c.Structure):
    """`segue_instances`."""

    _fields_ = (
        ("name", c.c_char_p),
        ("mesh", c.c_uint32),
        ("transforms", c.c_void_p),
        ("count", c.c_size_t),
        ("materials", c.c_void_p),
        ("material_count", c.c_size_t),
        ("camera_visible", c.c_uint32),
        ("two_sided_emission", c.c_uint32),
        ("object_index", c.c_uint32),
    )


class CCallbacks(c.Structure):
    """`segue_callbacks`."""

    _fields_ = (("progress", PROGRESS_FN), ("tile", TILE_FN), ("user", c.c_void_p))


_P = c.c_void_p
_S = c.c_char_p
_U = c.c_uint32
_ID = c.POINTER(c.c_uint32)

#: name -> (result, arguments). Functions that return `segue_status` return c_int.
PROTOTYPES: dict[str, tuple] = {
    "segue_abi_version": (_U, ()),
    "segue_version": (_S, ()),
    "segue_last_error": (_S, ()),
    "segue_scene_create": (c.c_int, (c.POINTER(_P),)),
    "segue_scene_free": (None, (_P,)),
    "segue_scene_add_mesh": (c.c_int, (_P, c.POINTER(CMesh), _ID)),
    "segue_scene_add_image": (c.c_int, (_P, c.POINTER(CImage), _ID)),
    "segue_scene_add_texture": (c.c_int, (_P, _S, _S, _ID)),
    "segue_scene_add_material": (c.c_int, (_P, _S, _S, _ID)),
    "segue_scene_add_light": (c.c_int, (_P, _S, _S, _ID)),
    "segue_scene_set_camera": (c.c_int, (_P, _S, _S)),
    "segue_scene_add_instances": (c.c_int, (_P, c.POINTER(CInstances))),
    "segue_scene_info": (c.c_int, (_P, c.POINTER(_S))),
    "segue_render_create": (c.c_int, (_P, _S, c.POINTER(_P))),
    "segue_render_free": (None, (_P,)),
    "segue_render_run": (c.c_int, (_P, c.POINTER(CCallbacks))),
    "segue_render_cancel": (c.c_int, (_P,)),
    "segue_render_size": (c.c_int, (_P, _ID, _ID)),
    "segue_render_read_pass": (c.c_int, (_P, _S, _U, _U, _U, _U, _P, c.c_size_t)),
    "segue_render_pass_channels": (c.c_int, (_P, _S, _ID)),
    "segue_render_read_exr": (
        c.c_int,
        (_P, _U, _U, _U, _U, c.POINTER(_P), c.POINTER(c.c_size_t)),
    ),
    "segue_render_write_exr": (c.c_int, (_P, _S, _S)),
    "segue_render_stats": (c.c_int, (_P, c.POINTER(_S))),
}


def declare(library: c.CDLL) -> None:
    """Gives every function of the library its prototype. AttributeError if one is missing."""
    for name, (result, arguments) in PROTOTYPES.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = arguments
