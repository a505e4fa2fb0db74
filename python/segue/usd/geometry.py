"""Drawn prims as meshes and instances of the scene, with the materials bound to them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import BadSceneError
from ..scene import Scene
from . import primvar
from ._pxr import Sdf, Usd, UsdGeom, UsdLux
from .bounds import Bounds
from .light import Lights, is_normalized
from .material import GREY, Materials, Surface, with_emission
from .mesh import add_attributes, read_mesh
from .mesh_data import MeshData, area
from .properties import Properties
from .shapes import shape_of
from .transform import is_usable
from .walk import Item

#: What each kind of prim that is not drawn is called, and what is done instead.
_NOT_DRAWN = {
    "BasisCurves": "curves",
    "NurbsCurves": "curves",
    "HermiteCurves": "curves",
    "NurbsPatch": "NURBS patches",
    "Points": "points",
    "TetMesh": "tetrahedral meshes",
    "Volume": "volumes",
    "ParticleField3DGaussianSplat": "Gaussian splats",
}
#: Helpers of skinning that are not geometry themselves.
_SILENT = ("Skeleton",)


class Geometry:
    """Adds gprims to the scene; a mesh that several prims share is added once."""

    def __init__(
        self,
        scene: Scene,
        materials: Materials,
        lights: Lights,
        properties: Properties,
        gain: float,
        bounds: Bounds,
    ) -> None:
        self._scene = scene
        self._materials = materials
        self._lights = lights
        self._properties = properties
        self._time = properties.time
        self._report = properties.report
        self._gain = gain
        self._bounds = bounds
        self._meshes: dict[Any, int | None] = {}
        self._data: dict[Any, MeshData | None] = {}
        self._count = 0
        self.emitters = 0
        #: Geometry that a GeometryLight makes a light, by path of the gprim.
        self.geometry_lights: dict[Sdf.Path, Usd.Prim] = {}

    def add(self, item: Item) -> None:
        """Adds a gprim with all its instances, or reports why not."""
        prim = item.prim
        kind = str(prim.GetTypeName())
        if kind in _SILENT:
            return
        if kind == "SkelRoot":
            self._report.unsupported(prim, "skinning", "the rest shape is drawn")
            return
        usable = is_usable(item.transforms)
        if not usable.all():
            self._report.left_out(prim, f"{int((~usable).sum())} instances without volume")
            item = replace(item, transforms=item.transforms[usable])
            if not len(item.transforms):
                return
        if prim.IsA(UsdGeom.Mesh):
            key: Any = _definition(prim)
            if key not in self._data:
                self._data[key] = read_mesh(UsdGeom.Mesh(prim), self._time, self._report)
            data = self._data[key]
            if data is not None:
                self._add_shape(key, data, item, item.transforms)
            return
        shape = shape_of(prim, self._properties)
        if shape is None:
            what = _NOT_DRAWN.get(kind, f"prims of the type '{kind}'")
            self._report.unsupported(prim, what, "left out")
            return
        key, make, matrix = shape
        transforms = item.transforms @ matrix
        if not is_usable(matrix[None])[0]:
            self._report.left_out(prim, "a shape without size")
            return
        data = self._data.get(key)
        if data is None:
            data = self._data[key] = make()
        data = replace(data, slots=[prim])
        self._add_shape(key, data, item, transforms)

    def _add_shape(self, key: Any, data: MeshData, item: Item, transforms: np.ndarray) -> None:
        prim = item.prim
        # Inside an instance the subsets are those of the proxy that the bindings are asked of.
        slots = _slots_of(prim, data)
        surfaces = [self._surface(slot, prim, data) for slot in slots]
        light, level = self._light_of(prim)
        needed = frozenset().union(*(s.primvars for s in surfaces))
        number = self._mesh(key, data, prim, needed)
        if number is None:
            return
        self._count += 1
        used = data.points[data.face_indices].astype(np.float64)
        if len(used):
            self._bounds.add(used.min(axis=0), used.max(axis=0), transforms)
        two_sided = bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get(self._time))
        for group, strength in self._emission(light, level, data, transforms):
            ids = [self._material(s, light, strength) for s in surfaces]
            if strength is not None or any(s.emission is not None for s in surfaces):
                self.emitters += 1
            self._scene.add_instances(
                str(prim.GetPath()),
                number,
                group,
                ids,
                two_sided_emission=two_sided,
                object_index=self._count,
            )

    def _mesh(self, key: Any, data: MeshData, prim: Usd.Prim, needed: frozenset[str]) -> int | None:
        """The mesh with the primvars that its materials need, added once for each set of them."""
        found = {name: primvar.find(prim, name) for name in sorted(needed)}
        origins = tuple(
            (name, _definition(p.GetAttr().GetPrim()) if p else None) for name, p in found.items()
        )
        full_key = (key, origins)
        if full_key in self._meshes:
            return self._meshes[full_key]
        complete = replace(data, attributes=[])
        missing = [
            name for name, p in found.items() if p is None and not name.startswith("display")
        ]
        if missing:
            self._report.warning(
                prim,
                f"its material needs the primvar {', '.join(missing)}, which it does not have",
                "0 is used",
            )
        add_attributes(complete, found, self._time, self._report)
        try:
            number = self._scene.add_mesh(
                str(prim.GetPath()),
                complete.points,
                complete.face_indices,
                complete.face_counts,
                complete.normals,
                complete.normal_interpolation,
                complete.face_slots,
                complete.holes,
                complete.left_handed,
                complete.attributes,
            )
        except BadSceneError as error:
            self._report.warning(prim, str(error), "left out")
            number = None
        self._meshes[full_key] = number
        return number

    def _surface(self, slot: Usd.Prim, prim: Usd.Prim, data: MeshData) -> Surface:
        """The surface of a material slot: what is bound, else displayColor and displayOpacity."""
        surface = self._materials.bound_surface(slot)
        if surface is not None:
            return surface
        color = self._display(prim, "displayColor", data, [GREY] * 3)
        opacity = self._display(prim, "displayOpacity", data, 1)
        return self._materials.display(color, opacity)

    def _display(self, prim: Usd.Prim, name: str, data: MeshData, default: Any) -> Any:
        """A display primvar: its value where it is constant, None where it varies."""
        found = primvar.find(prim, name)
        values = primvar.read(found, self._time, data.elements, self._report) if found else None
        if values is None or not len(values.data):
            return default
        if values.interpolation != "constant":
            return None
        first = [float(v) for v in values.flattened()[0]]
        if name == "displayOpacity":
            return first[0]
        # As textures read attributes: one number is a grey.
        return (first * 3 if len(first) == 1 else [*first, 0.0])[:3]

    def _light_of(self, prim: Usd.Prim) -> tuple[UsdLux.LightAPI | None, np.ndarray | None]:
        """The light that a gprim is, and its radiance; nothing if it is none that can shine."""
        source = self.geometry_lights.get(prim.GetPath())
        if source is None:
            if not prim.HasAPI(UsdLux.LightAPI) and not prim.HasAPI(UsdLux.MeshLightAPI):
                return None, None
            source = prim
            self._lights.check(prim)
        light = UsdLux.LightAPI(source)
        level = self._lights.level(source, light)
        return (light, level) if level is not None else (None, None)

    def _emission(
        self,
        light: UsdLux.LightAPI | None,
        level: np.ndarray | None,
        data: MeshData,
        transforms: np.ndarray,
    ) -> list[tuple[np.ndarray, np.ndarray | None]]:
        """The instances with the radiance of their light: one group unless it is normalised."""
        if light is None or level is None:
            return [(transforms, None)]
        if not is_normalized(light, self._properties):
            return [(transforms, level)]
        groups: dict[float, list[np.ndarray]] = {}
        for matrix in transforms:
            groups.setdefault(float(f"{area(data, matrix):.9g}"), []).append(matrix)
        return [(np.stack(g), level / size if size > 0 else level) for size, g in groups.items()]

    def _material(
        self, surface: Surface, light: UsdLux.LightAPI | None, level: np.ndarray | None
    ) -> int:
        if light is None or level is None:
            return self._materials.add(surface, self._gain)
        mode = self._properties.get(light.GetMaterialSyncModeAttr())
        strength = [float(v) for v in level]
        if mode == "noMaterialResponse":
            surface = replace(surface, closure={"type": "diffuse", "color": 0}, emission=None)
        if mode == "materialGlowTintsLight" and surface.emission is not None:
            return self._materials.add(surface, strength)
        # A mesh light whose material does not glow shines in its own colour.
        closure = with_emission(surface.closure, 1, strength)
        return self._materials.add(replace(surface, closure=closure, emission=None), 1)


def _definition(prim: Usd.Prim) -> Sdf.Path:
    """The path that all instances of a prim share."""
    return prim.GetPrimInPrototype().GetPath() if prim.IsInstanceProxy() else prim.GetPath()


def _slots_of(prim: Usd.Prim, data: MeshData) -> list[Usd.Prim]:
    """The prims whose bindings are the slots, below this prim rather than the one first read."""
    first = data.slots[0].GetPath()
    if first == prim.GetPath():
        return data.slots
    stage = prim.GetStage()
    return [
        stage.GetPrimAtPath(s.GetPath().ReplacePrefix(first, prim.GetPath())) for s in data.slots
    ]


def geometry_light_targets(prims: list[Usd.Prim]) -> dict[Sdf.Path, Usd.Prim]:
    """What the deprecated GeometryLights among the prims make a light."""
    targets = {}
    for prim in prims:
        if prim.GetTypeName() == "GeometryLight":
            for path in prim.GetRelationship("geometry").GetForwardedTargets():
                targets[path] = prim
    return targets
