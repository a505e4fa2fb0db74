"""UsdRender's settings: which picture the stage asks for."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ._pxr import Usd, UsdRender
from .color_space import LINEAR_REC709
from .properties import Properties

#: What is drawn where nothing is said.
PURPOSES = ("default", "render")


@dataclass(frozen=True)
class Settings:
    """What the stage says of the picture.

    Attributes:
        resolution: width and height, or None.
        camera: path of the camera, or "".
        pixel_aspect: width of a pixel over its height.
        policy: UsdRender's aspectRatioConformPolicy.
        data_window: part of the frame to render: x0, y0, x1, y1 from the bottom left, in [0, 1].
        purposes: UsdGeom purposes to draw.
        has_lens: cameras may be out of focus.
        has_shutter: motion blur is not forbidden.
    """

    resolution: tuple[int, int] | None = None
    camera: str = ""
    pixel_aspect: float = 1.0
    policy: str = "expandAperture"
    data_window: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    purposes: tuple[str, ...] = PURPOSES
    has_lens: bool = True
    has_shutter: bool = True


def read_settings(stage: Usd.Stage, properties: Properties) -> Settings:
    """The render settings that the stage names, else those at /Render/Settings, else defaults.

    The one product's own values go before the settings'.
    """
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    if not settings:
        settings = UsdRender.Settings(stage.GetPrimAtPath("/Render/Settings"))
    if not settings:
        return Settings()
    return _Reader(settings, properties).settings()


class _Reader:
    """Reads one RenderSettings prim with its product."""

    def __init__(self, settings: UsdRender.Settings, properties: Properties) -> None:
        self._prim = settings.GetPrim()
        self._properties = properties
        self._report = properties.report
        #: The prims whose values count, the strongest first.
        self._prims = [*self._product(settings), self._prim]

    def settings(self) -> Settings:
        """What the prims say, and a report of what is left aside."""
        self._check()
        return Settings(
            self._resolution(),
            self._camera(),
            self._pixel_aspect(),
            str(self._get("aspectRatioConformPolicy")),
            self._data_window(),
            self._purposes(),
            not self._get("disableDepthOfField"),
            not (self._get("disableMotionBlur") or self._get("instantaneousShutter")),
        )

    def _product(self, settings: UsdRender.Settings) -> list[Usd.Prim]:
        paths = settings.GetProductsRel().GetForwardedTargets()
        if len(paths) > 1:
            self._report.unsupported(
                self._prim,
                f"{len(paths)} render products",
                "one picture is made, with the settings' own values",
            )
            return []
        product = self._prim.GetStage().GetPrimAtPath(paths[0]) if paths else None
        if paths and not (product and product.IsA(UsdRender.Product)):
            self._report.warning(
                self._prim, f"the render product {paths[0]} does not exist", "ignored"
            )
            return []
        return [product] if product else []

    def _get(self, name: str) -> object:
        for prim in self._prims:
            if prim.GetAttribute(name).HasAuthoredValue():
                return self._properties.named(prim, name)
        return self._properties.named(self._prim, name)

    def _resolution(self) -> tuple[int, int] | None:
        width, height = (float(v) for v in self._get("resolution"))  # type: ignore[attr-defined]
        if not (1 <= width < math.inf and 1 <= height < math.inf):
            self._report.warning(
                self._prim, f"the resolution {width:g} x {height:g}", "the default is used"
            )
            return None
        return int(width), int(height)

    def _camera(self) -> str:
        for prim in self._prims:
            targets = prim.GetRelationship("camera").GetForwardedTargets()
            if targets:
                return str(targets[0])
        return ""

    def _pixel_aspect(self) -> float:
        aspect = float(self._get("pixelAspectRatio"))  # type: ignore[arg-type]
        if 0 < aspect < math.inf:
            return aspect
        self._report.warning(self._prim, f"the pixelAspectRatio {aspect:g}", "1 is used")
        return 1.0

    def _data_window(self) -> tuple[float, float, float, float]:
        whole = (0.0, 0.0, 1.0, 1.0)
        x0, y0, x1, y1 = (float(v) for v in self._get("dataWindowNDC"))  # type: ignore[attr-defined]
        window = (x0, y0, x1, y1)
        if not all(math.isfinite(v) for v in window):
            self._report.warning(
                self._prim, f"the data window {window} is not finite", "the whole frame is drawn"
            )
            return whole
        inside = (max(x0, 0.0), max(y0, 0.0), min(x1, 1.0), min(y1, 1.0))
        if inside != window:
            self._report.unsupported(
                self._prim, f"overscan, the data window {window}", "it is cut to the frame"
            )
        if inside[0] >= inside[2] or inside[1] >= inside[3]:
            self._report.warning(
                self._prim, f"the empty data window {window}", "the whole frame is drawn"
            )
            return whole
        return inside

    def _purposes(self) -> tuple[str, ...]:
        """The included purposes; "default" is what a prim has that says nothing."""
        return tuple(str(p) for p in self._properties.named(self._prim, "includedPurposes"))

    def _check(self) -> None:
        """Reports what the settings ask for and do not get."""
        bindings = list(self._properties.named(self._prim, "materialBindingPurposes"))
        if bindings != ["full", ""]:
            self._report.unsupported(
                self._prim,
                f"materialBindingPurposes {bindings}",
                "materials for full renders are used, else those for previews",
            )
        space = self._prim.GetAttribute("renderingColorSpace").Get(Usd.TimeCode.Default())
        if space is not None and space not in LINEAR_REC709:
            self._report.unsupported(
                self._prim, f"renderingColorSpace '{space}'", "linear Rec.709 is used"
            )
        for prim in self._prims[:-1]:
            kind = self._properties.named(prim, "productType")
            if kind != "raster":
                self._report.unsupported(prim, f"the productType '{kind}'", "a picture is made")
