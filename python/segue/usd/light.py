"""UsdLux lights as lights of the ABI, in the quantities that UsdLux defines.

UsdLuxLightAPI: a light's radiance is intensity x 2^exposure x color, times the colour of its
temperature where that is enabled, divided by its world-space surface area where `normalize` is on.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..errors import BadArgumentError, BadSceneError
from ..scene import Scene
from ._pxr import Sdf, Tf, Usd, UsdGeom, UsdLux
from .areas import cylinder_area, disk_area, rect_area, sphere_area
from .bounds import Bounds
from .color_space import check_color_space
from .properties import Properties
from .texture import Textures
from .transform import flat, is_usable, without_scale

#: Turns the dome's +Y pole to +Z; longitude 0 then points to -Y (UsdLuxDomeLight_1).
_POLE_TO_Z = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])

#: Lights infinitely far away, which have no shape.
_INFINITE = ("DistantLight", "DomeLight", "DomeLight_1")

#: Surfaces from here on do not fit the engine's single precision.
LARGEST_AREA = 1e34


class _UnusableError(Exception):
    """A light cannot be drawn; the text is the attribute and its value."""


def radiance(light: UsdLux.LightAPI, properties: Properties) -> np.ndarray:
    """L of UsdLuxLightAPI before normalisation, for each channel."""
    get = properties.get
    color = np.array(get(light.GetColorAttr()), dtype=np.float64)
    if get(light.GetEnableColorTemperatureAttr()):
        kelvin = get(light.GetColorTemperatureAttr())
        color *= np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    intensity = float(get(light.GetIntensityAttr()))
    exposure = float(get(light.GetExposureAttr()))
    return intensity * np.exp2(exposure) * color


def is_normalized(light: UsdLux.LightAPI, properties: Properties) -> bool:
    """Whether the radiance is divided by the light's size."""
    return bool(properties.get(light.GetNormalizeAttr()))


def _half_size(light: dict[str, Any]) -> np.ndarray:
    """Half the extent of a light's description along each local axis."""
    radius = light.get("radius", 0.0)
    return np.array(
        {
            "rect": (0.5 * light.get("width", 0.0), 0.5 * light.get("height", 0.0), 0.0),
            "disk": (radius, radius, 0.0),
            "cylinder": (0.5 * light.get("length", 0.0), radius, radius),
        }.get(light["type"], (radius,) * 3)
    )


def _checked_area(area: float) -> float:
    if not area < LARGEST_AREA:
        raise _UnusableError(f"an area of {area:g}, too large to compute with")
    return area


class Lights:
    """Adds lights to the scene.

    Args:
        gain: factor on every radiance, the camera's exposure.
        z_up: the stage's up axis is Z.
    """

    def __init__(
        self,
        scene: Scene,
        textures: Textures,
        properties: Properties,
        gain: float,
        z_up: bool,
        bounds: Bounds,
    ) -> None:
        self._scene = scene
        self._textures = textures
        self._properties = properties
        self._report = properties.report
        self._gain = gain
        self._z_up = z_up
        self._bounds = bounds
        self.count = 0

    def add(self, prim: Usd.Prim, transforms: np.ndarray) -> None:
        """Adds a light, once for each transformation."""
        kind = prim.GetTypeName()
        make = {
            "RectLight": self._rect,
            "DiskLight": self._disk,
            "SphereLight": self._sphere,
            "CylinderLight": self._cylinder,
            "DistantLight": self._distant,
            "DomeLight": self._dome,
            "DomeLight_1": self._dome,
        }.get(kind)
        if make is None:
            what = "a portal: the dome is sampled without it" if kind == "PortalLight" else kind
            self._report.unsupported(prim, what, "left out")
            return
        light = UsdLux.LightAPI(prim)
        self.check(prim)
        level = self.level(prim, light)
        if level is None:
            return
        if not level.any():
            self._report.left_out(prim, "a light of intensity or colour 0")
            return
        usable = is_usable(transforms) if kind not in ("DomeLight", "DomeLight_1") else None
        for number, matrix in enumerate(transforms):
            if usable is not None and not usable[number]:
                self._report.left_out(prim, "a light without volume")
                continue
            if not np.isfinite(matrix.astype(np.float32)).all():
                self._report.warning(prim, "a place beyond single precision", "left out")
                continue
            name = str(prim.GetPath()) + (f"[{number}]" if len(transforms) > 1 else "")
            try:
                shape = self._shape_keys(prim)
                description = make(prim, light, level, matrix)
                if description is None:
                    continue
                self._scene.add_light(name, {**description, **shape})
            except (_UnusableError, BadSceneError, BadArgumentError) as error:
                self._report.warning(prim, str(error), "left out")
                continue
            self.count += 1
            if kind not in _INFINITE:
                half = _half_size(description)
                self._bounds.add(-half, half, matrix[None])

    def level(self, prim: Usd.Prim, light: UsdLux.LightAPI) -> np.ndarray | None:
        """A light's radiance with the exposure, or None, with a warning, if it is none."""
        level = self._gain * radiance(light, self._properties)
        if np.isfinite(level.astype(np.float32)).all() and (level >= 0).all():
            return level
        channels = ", ".join(f"{v:g}" for v in level)
        self._report.warning(
            prim, f"a radiance that is negative or not finite ({channels})", "left out"
        )
        return None

    def check(self, prim: Usd.Prim) -> None:
        """Reports what a light asks for and does not get."""
        light, get, report = UsdLux.LightAPI(prim), self._properties.get, self._report
        check_color_space(prim, report)
        for name, attribute in (
            ("diffuse", light.GetDiffuseAttr()),
            ("specular", light.GetSpecularAttr()),
        ):
            factor = get(attribute) if attribute else 1
            if factor != 1:
                report.unsupported(
                    prim, f"the {name} multiplier {factor:g} of a light", "1 is used"
                )
        for name, collection in (
            ("light linking", light.GetLightLinkCollectionAPI()),
            ("shadow linking", light.GetShadowLinkCollectionAPI()),
        ):
            root = collection.GetIncludeRootAttr()
            if (root and get(root) is False) or collection.GetExcludesRel().GetTargets():
                report.unsupported(prim, name, "the light shines on everything")
        if light.GetFiltersRel().GetTargets():
            report.unsupported(prim, "light filters", "they are ignored")
        for connected in light.GetInputs():
            if connected.HasConnectedSource():
                report.unsupported(
                    prim, f"a texture on a light's {connected.GetBaseName()}", "its value is used"
                )
        if prim.HasAPI(UsdLux.ShadowAPI):
            shadow = UsdLux.ShadowAPI(prim)
            if (
                not get(shadow.GetShadowEnableAttr())
                or any(get(shadow.GetShadowColorAttr()))
                or get(shadow.GetShadowDistanceAttr()) > 0
            ):
                report.unsupported(prim, "a light without true shadows", "its shadows are true")

    def _normalized(self, light: UsdLux.LightAPI, level: np.ndarray, area: float) -> np.ndarray:
        return level / area if is_normalized(light, self._properties) and area > 0 else level

    def _get(self, prim: Usd.Prim, name: str) -> Any:
        return self._properties.named(prim, name)

    def _number(self, prim: Usd.Prim, name: str) -> float:
        value = float(self._get(prim, name))
        if not math.isfinite(value):
            raise _UnusableError(f"{name} = {value:g}, which is not finite")
        return value

    def _length(self, prim: Usd.Prim, name: str) -> float:
        value = self._number(prim, name)
        if value < 0:
            raise _UnusableError(f"{name} = {value:g}, which is negative")
        return value

    def _rect(
        self, prim: Usd.Prim, light: UsdLux.LightAPI, level: np.ndarray, matrix: np.ndarray
    ) -> dict[str, Any] | None:
        width = self._length(prim, "inputs:width")
        height = self._length(prim, "inputs:height")
        area = _checked_area(rect_area(width, height, matrix))
        if not area > 0:
            self._no_area(prim)
            return None
        description = {
            "type": "rect",
            "width": width,
            "height": height,
            "radiance": self._normalized(light, level, area).tolist(),
            "transform": flat(matrix),
        }
        image = self._textures.light_image(prim.GetAttribute("inputs:texture:file"))
        if image is not None:
            description["image"] = image
        return description

    def _disk(
        self, prim: Usd.Prim, light: UsdLux.LightAPI, level: np.ndarray, matrix: np.ndarray
    ) -> dict[str, Any] | None:
        radius = self._length(prim, "inputs:radius")
        area = _checked_area(disk_area(radius, matrix))
        if not area > 0:
            self._no_area(prim)
            return None
        return {
            "type": "disk",
            "radius": radius,
            "radiance": self._normalized(light, level, area).tolist(),
            "transform": flat(matrix),
        }

    def _sphere(
        self, prim: Usd.Prim, light: UsdLux.LightAPI, level: np.ndarray, matrix: np.ndarray
    ) -> dict[str, Any] | None:
        radius = self._length(prim, "inputs:radius")
        area = _checked_area(sphere_area(radius, matrix))
        normalized = is_normalized(light, self._properties)
        if self._get(prim, "treatAsPoint") or not area > 0:
            # A convex body of radiance L and area A has L A / 4 of intensity on average over the
            # directions (Cauchy); normalised, A cancels.
            intensity = level / 4 * (1.0 if normalized else area)
            if not intensity.any():
                self._no_area(prim)
                return None
            return {"type": "point", "intensity": intensity.tolist(), "transform": flat(matrix)}
        return {
            "type": "sphere",
            "radius": radius,
            "radiance": self._normalized(light, level, area).tolist(),
            "transform": flat(matrix),
        }

    def _cylinder(
        self, prim: Usd.Prim, light: UsdLux.LightAPI, level: np.ndarray, matrix: np.ndarray
    ) -> dict[str, Any] | None:
        radius = self._length(prim, "inputs:radius")
        length = self._length(prim, "inputs:length")
        if not radius > 0 and length > 0 and is_normalized(light, self._properties):
            radius = length * 1e-3
            self._report.unsupported(prim, "a line light", f"a cylinder of radius {radius:g}")
        area = _checked_area(cylinder_area(radius, length, matrix))
        if not area > 0:
            self._no_area(prim)
            return None
        return {
            "type": "cylinder",
            "radius": radius,
            "length": length,
            "radiance": self._normalized(light, level, area).tolist(),
            "transform": flat(matrix),
        }

    def _distant(
        self, prim: Usd.Prim, light: UsdLux.LightAPI, level: np.ndarray, matrix: np.ndarray
    ) -> dict[str, Any] | None:
        degrees = min(max(self._number(prim, "inputs:angle"), 0.0), 360.0)
        angle = math.radians(degrees)
        if angle > math.pi:
            angle = math.pi
            self._report.unsupported(
                prim, f"a DistantLight of {degrees:g} degrees", "180 degrees are used"
            )
        # A parallel light has no radiance; UsdLux reads its value as irradiance either way.
        parallel = angle == 0 or is_normalized(light, self._properties)
        return {
            "type": "distant",
            "angle": angle,
            "irradiance" if parallel else "radiance": level.tolist(),
            "transform": flat(without_scale(matrix)[0]),
        }

    def _dome(
        self, prim: Usd.Prim, _light: UsdLux.LightAPI, level: np.ndarray, matrix: np.ndarray
    ) -> dict[str, Any] | None:
        if UsdLux.DomeLight(prim) and prim.GetRelationship("portals").GetTargets():
            self._report.unsupported(prim, "portals", "the dome is sampled without them")
        layout = self._get(prim, "inputs:texture:format")
        file = prim.GetAttribute("inputs:texture:file")
        image = self._textures.light_image(file)
        if image is not None and layout not in ("automatic", "latlong"):
            self._report.unsupported(prim, f"the dome format '{layout}'", "read as latlong")
        axis = self._get(prim, "poleAxis") if prim.GetTypeName() == "DomeLight_1" else "Y"
        orientation = without_scale(matrix)[0]
        if axis == "Z" or (axis == "scene" and self._z_up):
            orientation = orientation @ _POLE_TO_Z
        orientation[:3, 3] = 0
        description = {"type": "dome", "radiance": level.tolist(), "transform": flat(orientation)}
        if image is not None:
            description["image"] = image
        return description

    def _no_area(self, prim: Usd.Prim) -> None:
        self._report.left_out(prim, "a light without area")

    def _shape_keys(self, prim: Usd.Prim) -> dict[str, Any]:
        """The ABI's `shaping` of a light with UsdLuxShapingAPI."""
        if not prim.HasAPI(UsdLux.ShapingAPI):
            return {}
        file = self._get(prim, "inputs:shaping:ies:file")
        if isinstance(file, Sdf.AssetPath) and file.path:
            self._report.unsupported(prim, f"the IES profile {file.path}", "it is ignored")
        angle = min(max(self._number(prim, "inputs:shaping:cone:angle"), 0.0), 180.0)
        softness = min(max(self._number(prim, "inputs:shaping:cone:softness"), 0.0), 1.0)
        focus = max(self._number(prim, "inputs:shaping:focus"), 0.0)
        tint = [float(v) for v in self._get(prim, "inputs:shaping:focusTint")]
        if not np.isfinite(tint).all():
            raise _UnusableError(f"inputs:shaping:focusTint = {tint}, which is not finite")
        kind = prim.GetTypeName()
        flat_light = kind in ("RectLight", "DiskLight")
        if focus == 0 and (angle == 180 or (angle >= 90 and flat_light and softness == 0)):
            return {}
        if kind in _INFINITE:
            if focus > 0 or angle < 90:
                self._report.unsupported(prim, f"ShapingAPI on a {kind}", "it is ignored")
            return {}
        return {
            "shaping": {
                "cone_angle": math.radians(angle),
                "cone_softness": softness,
                "focus": focus,
                "focus_tint": tint,
            }
        }


def stage_is_z_up(stage: Usd.Stage) -> bool:
    """Whether the stage's up axis is Z. An unknown axis counts as the fallback, Y."""
    try:
        return UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    except Tf.ErrorException:
        return False
