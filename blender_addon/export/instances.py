"""What the depsgraph shows: meshes grouped into true instances, and lights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..log import ExportLog
from .object_info import ObjectInfo, asked, object_info

# How often, in objects, the user's wish to stop is looked up.
_STOP_INTERVAL = 1024

_RAY_FLAGS = {
    "visible_diffuse": "diffuse",
    "visible_glossy": "glossy",
    "visible_transmission": "transmission",
    "visible_volume_scatter": "volume scatter",
    "visible_shadow": "shadow",
}

_UNSUPPORTED_TYPES = {
    "CURVES": "hair curves are",
    "POINTCLOUD": "point clouds are",
    "VOLUME": "volumes are",
    "GPENCIL": "grease pencil is",
    "GREASEPENCIL": "grease pencil is",
}


@dataclass(frozen=True)
class ObjectTraits:
    """What an instance takes from its object."""

    name: str
    materials: tuple[bpy.types.Material | None, ...]
    camera_visible: bool
    pass_index: int
    info: ObjectInfo | None


@dataclass
class Group:
    """Instances of one mesh that share materials, what these ask of objects, and visibility.

    `corners` (8, 3): of the mesh's bounding box. `members` are indices into the depsgraph's list.
    """

    traits: ObjectTraits
    mesh: bpy.types.Mesh
    corners: np.ndarray
    members: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class LightInstance:
    """A light at one place; `index` is that of the depsgraph's list."""

    name: str
    light: bpy.types.Light
    camera_visible: bool
    index: int


@dataclass
class Survey:
    """Everything the depsgraph shows."""

    groups: list[Group]
    lights: list[LightInstance]
    matrices: np.ndarray
    #: How far meshes reach along an axis, from their origins and from the scene's: at least 1.
    extent: float
    reach: float


def _camera_visible(item: bpy.types.Object, view_layer: bpy.types.ViewLayer) -> bool:
    """Whether an object is seen by camera rays; collections can hide it from them too."""
    original = item.original
    return item.visible_camera and not original.indirect_only_get(view_layer=view_layer)


def _visible(item: bpy.types.Object) -> bool:
    """Whether an object is seen by rays of any kind."""
    return item.visible_camera or any(getattr(item, flag) for flag in _RAY_FLAGS)


def _warn_object(item: bpy.types.Object, view_layer: bpy.types.ViewLayer, log: ExportLog) -> None:
    """Name what an object asks for and Segue lacks."""
    name = f"Object '{item.name}'"
    hidden = [label for flag, label in _RAY_FLAGS.items() if not getattr(item, flag)]
    if hidden:
        log.warn(
            f"{name}: only the camera can be kept from seeing an object, "
            f"it stays visible to {', '.join(hidden)} rays"
        )
    if item.type != "LIGHT" and item.is_shadow_catcher:
        log.warn(f"{name}: shadow catchers are not supported, it is rendered as it is")
    if item.is_holdout or item.original.holdout_get(view_layer=view_layer):
        log.warn(f"{name}: holdouts are not supported, it is rendered as it is")
    linking = item.light_linking
    if linking.receiver_collection or linking.blocker_collection:
        log.warn(f"{name}: light linking is not supported, it lights everything")


def _warn_particles(item: bpy.types.Object, log: ExportLog) -> None:
    for system in item.particle_systems:
        settings = system.settings
        if settings.type == "HAIR" and settings.render_type == "PATH":
            log.warn(f"Object '{item.name}': particle hair is not supported, it is left out")


class _Surveyor:
    """Walks the depsgraph once. Objects of instances live only for one step of the walk."""

    def __init__(
        self, depsgraph: bpy.types.Depsgraph, matrices: np.ndarray, log: ExportLog
    ) -> None:
        self.depsgraph = depsgraph
        self.finite = np.isfinite(matrices).all(axis=(1, 2))
        self.view_layer = depsgraph.view_layer
        self.override = depsgraph.view_layer_eval.material_override
        self.log = log
        self.groups: dict[tuple, Group] = {}
        self.by_object: dict[tuple, Group] = {}
        self.lights: list[LightInstance] = []
        self.seen: set[int] = set()
        # What each material asks of objects, and what those of an object and its mesh do.
        self.asked: dict[int, frozenset[str]] = {}
        self.by_object_asked: dict[tuple[int, int], frozenset[str]] = {}

    def visit(self, index: int, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Sort one entry of the depsgraph's list into a group or into the lights."""
        if not instance.show_self:
            return
        item = instance.object
        if item.type in {"MESH", "LIGHT"} and not self.finite[index]:
            self.log.warn(f"Object '{item.name}': its transform is not finite, it is left out")
        elif item.type == "MESH":
            if not _visible(item):
                return
            parent = instance.parent if instance.is_instance else None
            pointers = (item.original.as_pointer(), item.data.as_pointer())
            if pointers not in self.by_object_asked:
                self.by_object_asked[pointers] = self._asked_by(self._materials(item))
            info = object_info(item, instance, self.by_object_asked[pointers])
            key = (*pointers, parent.original.as_pointer() if parent else 0, info)
            group = self.by_object.get(key)
            if group is None:
                group = self.by_object[key] = self._group(item, parent, info)
            group.members.append(index)
        elif item.type == "LIGHT":
            self._warn_once(item)
            visible = _camera_visible(item, self.view_layer)
            self.lights.append(LightInstance(item.name, item.data, visible, index))
        elif item.type in _UNSUPPORTED_TYPES:
            kind = _UNSUPPORTED_TYPES[item.type]
            self.log.warn(f"Object '{item.name}': {kind} not supported, it is left out")

    def _warn_once(self, item: bpy.types.Object) -> None:
        pointer = item.original.as_pointer()
        if pointer not in self.seen:
            self.seen.add(pointer)
            _warn_object(item, self.view_layer, self.log)
            _warn_particles(item, self.log)

    def _materials(self, item: bpy.types.Object) -> tuple[bpy.types.Material | None, ...]:
        slots = tuple(slot.material for slot in item.material_slots) or (None,)
        return (self.override,) * len(slots) if self.override else slots

    def _asked_by(self, materials: tuple[bpy.types.Material | None, ...]) -> frozenset[str]:
        """What materials ask of the object that has them."""
        for material in materials:
            pointer = material.as_pointer() if material else 0
            if pointer not in self.asked:
                self.asked[pointer] = asked(material)
        pointers = (material.as_pointer() if material else 0 for material in materials)
        return frozenset().union(*(self.asked[pointer] for pointer in pointers))

    def _group(
        self,
        item: bpy.types.Object,
        parent: bpy.types.Object | None,
        info: ObjectInfo | None,
    ) -> Group:
        """The group of an object's mesh; objects that look alike share one."""
        self._warn_once(item)
        materials = self._materials(item)
        visible = _camera_visible(item, self.view_layer)
        if parent is not None:
            visible = visible and _camera_visible(parent, self.view_layer)
        traits = ObjectTraits(item.name, materials, visible, item.pass_index, info)
        pointers = tuple(material.as_pointer() if material else 0 for material in materials)
        key = (item.data.as_pointer(), pointers, visible, item.pass_index, info)
        return self.groups.setdefault(key, Group(traits, item.data, np.array(item.bound_box)))


def survey(
    depsgraph: bpy.types.Depsgraph, log: ExportLog, stop: Callable[[], bool]
) -> Survey | None:
    """List what is to be rendered; None when the user wants to stop."""
    entries = depsgraph.object_instances
    matrices = np.empty(16 * len(entries), np.float32)
    if len(entries):
        entries.foreach_get("matrix_world", matrices)
    # Blender stores columns first.
    matrices = matrices.reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)
    surveyor = _Surveyor(depsgraph, matrices, log)
    for index, instance in enumerate(entries):
        if index % _STOP_INTERVAL == 0 and stop():
            return None
        surveyor.visit(index, instance)
    groups = list(surveyor.groups.values())
    extent = _farthest([group.corners for group in groups])
    return Survey(groups, surveyor.lights, matrices, extent, _reach(groups, matrices))


def _reach(groups: list[Group], matrices: np.ndarray) -> float:
    """How far instances reach from the scene's origin along an axis."""
    places = []
    for group in groups:
        own = matrices[group.members]
        places.append(own[:, None, :3, :3] @ group.corners[..., None] + own[:, None, :3, 3:])
    return _farthest(places)


def _farthest(points: list[np.ndarray]) -> float:
    """The largest of all finite coordinates, without sign; one at least."""
    coordinates = np.abs(np.concatenate([[0.0], *(place.ravel() for place in points)]))
    return max(1.0, float(coordinates[np.isfinite(coordinates)].max()))
