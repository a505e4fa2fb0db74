"""Writes a scene as a USD stage: UsdGeom, UsdPreviewSurface and UsdLux only, metres, y up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, Vt

from .mesh import Array, Mesh

Colour = Sequence[float]


@dataclass(frozen=True)
class Texture:
    """An image file beside the stage; `repeat` images of it go into one metre of uv."""

    file: str
    repeat: tuple[float, float] = (1.0, 1.0)
    colour: bool = True
    """False for data (roughness), which is not sRGB-encoded."""


def look_at(
    eye: ArrayLike, target: ArrayLike, up: Sequence[float] = (0.0, 1.0, 0.0)
) -> Gf.Matrix4d:
    """Transform of a camera or light at `eye` that looks along its -Z at `target`."""
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    z = (eye - target) / np.linalg.norm(eye - target)
    if abs(z @ np.asarray(up)) > 0.999:
        up = (0.0, 0.0, 1.0)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    return _matrix(np.array([x, np.cross(z, x), z]), eye)


def placed(position: ArrayLike, linear: Array | None = None) -> Gf.Matrix4d:
    """Transform `p -> linear p + position`."""
    rows = np.eye(3) if linear is None else linear.T
    return _matrix(rows, np.asarray(position, float))


def _matrix(rows: Array, origin: Array) -> Gf.Matrix4d:
    matrix = Gf.Matrix4d(1.0)
    for i in range(3):
        matrix.SetRow3(i, Gf.Vec3d(*np.round(rows[i], 6).tolist()))
    matrix.SetTranslateOnly(Gf.Vec3d(*np.round(origin, 6).tolist()))
    return matrix


class Scene:
    """One stage in the making."""

    def __init__(self, name: str, about: str, digits: int = 5) -> None:
        """`digits` is the number of decimals kept of every coordinate, in metres."""
        self.name = name
        self._digits = digits
        self._textured: set[str] = set()
        self.stage = Usd.Stage.CreateInMemory()
        layer = self.stage.GetRootLayer()
        layer.documentation = about
        UsdGeom.SetStageMetersPerUnit(self.stage, 1.0)
        UsdGeom.SetStageUpAxis(self.stage, UsdGeom.Tokens.y)
        self.stage.SetDefaultPrim(UsdGeom.Xform.Define(self.stage, "/World").GetPrim())
        for scope in ("Materials", "Geometry", "Lights"):
            UsdGeom.Scope.Define(self.stage, f"/World/{scope}")

    # -- materials ------------------------------------------------------------------------------

    def matte(self, name: str, colour: Colour | Texture) -> str:
        """A Lambert surface: no specular lobe at all."""
        return self._material(
            name,
            diffuseColor=colour,
            useSpecularWorkflow=1,
            specularColor=(0, 0, 0),
            ior=1.0,
            roughness=1.0,
        )

    def plastic(
        self, name: str, colour: Colour | Texture, roughness: float | Texture, ior: float = 1.5
    ) -> str:
        """A diffuse base under a dielectric surface: lacquer, glaze, polish."""
        return self._material(name, diffuseColor=colour, roughness=roughness, ior=ior)

    def metal(self, name: str, colour: Colour, roughness: float | Texture) -> str:
        """A metal of the given reflectance."""
        return self._material(name, diffuseColor=colour, metallic=1.0, roughness=roughness)

    def glass(
        self, name: str, ior: float = 1.5, tint: Colour = (1, 1, 1), roughness: float = 0.0
    ) -> str:
        """A refracting dielectric. `tint` multiplies what is refracted, at each surface."""
        return self._material(
            name,
            diffuseColor=tint,
            roughness=roughness,
            ior=ior,
            opacity=0.0,
            opacityMode="transparent",
        )

    def glow(self, name: str, radiance: Colour) -> str:
        """A black surface that emits `radiance`."""
        return self._material(
            name,
            diffuseColor=(0, 0, 0),
            useSpecularWorkflow=1,
            specularColor=(0, 0, 0),
            ior=1.0,
            roughness=1.0,
            emissiveColor=radiance,
        )

    def _material(self, name: str, **inputs: float | str | Colour | Texture) -> str:
        types = {
            "diffuseColor": Sdf.ValueTypeNames.Color3f,
            "specularColor": Sdf.ValueTypeNames.Color3f,
            "emissiveColor": Sdf.ValueTypeNames.Color3f,
            "useSpecularWorkflow": Sdf.ValueTypeNames.Int,
            "opacityMode": Sdf.ValueTypeNames.Token,
        }
        path = f"/World/Materials/{name}"
        material = UsdShade.Material.Define(self.stage, path)
        surface = UsdShade.Shader.Define(self.stage, f"{path}/Surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        for key, value in inputs.items():
            port = surface.CreateInput(key, types.get(key, Sdf.ValueTypeNames.Float))
            if isinstance(value, Texture):
                port.ConnectToSource(self._texture(path, key, value))
                self._textured.add(path)
            elif isinstance(value, (str, int, float)):
                port.Set(value)
            else:
                port.Set(Gf.Vec3f(*map(float, value)))
        output = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput().ConnectToSource(output)
        return path

    def _texture(self, material: str, key: str, texture: Texture) -> UsdShade.Output:
        node = f"{material}/{key}"
        reader = UsdShade.Shader.Define(self.stage, f"{node}_st")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        st = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        if texture.repeat != (1.0, 1.0):
            place = UsdShade.Shader.Define(self.stage, f"{node}_place")
            place.CreateIdAttr("UsdTransform2d")
            place.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
            place.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(*texture.repeat))
            st = place.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        image = UsdShade.Shader.Define(self.stage, f"{node}_image")
        image.CreateIdAttr("UsdUVTexture")
        asset = Sdf.AssetPath(f"./textures/{texture.file}")
        image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(asset)
        space = "sRGB" if texture.colour else "raw"
        image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
        for wrap in ("wrapS", "wrapT"):
            image.CreateInput(wrap, Sdf.ValueTypeNames.Token).Set("repeat")
        image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
        if texture.colour:
            return image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
        return image.CreateOutput("r", Sdf.ValueTypeNames.Float)

    # -- geometry -------------------------------------------------------------------------------

    def group(self, path: str, transform: Gf.Matrix4d | None = None) -> str:
        """A transform node; returns its path relative to the geometry scope."""
        prim = UsdGeom.Xform.Define(self.stage, f"/World/Geometry/{path}")
        if transform is not None:
            prim.AddTransformOp().Set(transform)
        return path

    def mesh(
        self, path: str, mesh: Mesh, material: str, transform: Gf.Matrix4d | None = None
    ) -> str:
        """A mesh under the geometry scope; returns its stage path."""
        full = f"/World/Geometry/{path}"
        self._mesh(full, mesh, material, transform)
        return full

    def _mesh(self, path: str, mesh: Mesh, material: str, transform: Gf.Matrix4d | None) -> None:
        prim = UsdGeom.Mesh.Define(self.stage, path)
        points = np.round(mesh.points, self._digits) + 0.0
        prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
        prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(mesh.counts.astype(np.int32)))
        prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.indices.astype(np.int32)))
        prim.CreateExtentAttr(_extent(points))
        prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        prim.CreateDoubleSidedAttr(True)
        if mesh.normals is not None:
            normals = np.round(mesh.normals, 4) + 0.0
            prim.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals.astype(np.float32)))
            prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
        if mesh.uv is not None and material in self._textured:
            st = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
                "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
            )
            uv = np.round(mesh.uv, 4) + 0.0
            st.Set(Vt.Vec2fArray.FromNumpy(uv.astype(np.float32)))
        if transform is not None:
            prim.AddTransformOp().Set(transform)
        self._bind(prim.GetPrim(), material)

    def _bind(self, prim: Usd.Prim, material: str) -> None:
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material.Get(self.stage, material))

    def copy(self, path: str, source: str, transform: Gf.Matrix4d) -> None:
        """Another instance of the prim at stage path `source`."""
        prim = self.stage.DefinePrim(f"/World/Geometry/{path}", "Xform")
        prim.GetReferences().AddInternalReference(source)
        prim.SetInstanceable(True)
        ops = UsdGeom.Xformable(prim)
        ops.ClearXformOpOrder()
        ops.AddTransformOp(opSuffix="place").Set(transform)

    def scatter(
        self,
        path: str,
        prototypes: Sequence[tuple[Mesh, str]],
        positions: ArrayLike,
        kinds: ArrayLike | None = None,
        turns: ArrayLike | None = None,
        scales: ArrayLike | None = None,
    ) -> None:
        """Many instances of (mesh, material) prototypes.

        `kinds` are indices of prototypes, `turns` quaternions (w, x, y, z), `scales` uniform.
        """
        full = f"/World/Geometry/{path}"
        prim = UsdGeom.PointInstancer.Define(self.stage, full)
        UsdGeom.Scope.Define(self.stage, f"{full}/Prototypes")
        for i, (mesh, material) in enumerate(prototypes):
            proto = f"{full}/Prototypes/p{i}"
            self._mesh(proto, mesh, material, None)
            prim.CreatePrototypesRel().AddTarget(proto)
        p = np.round(np.asarray(positions, float), self._digits) + 0.0
        prim.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(p.astype(np.float32)))
        which = np.zeros(len(p), np.int32) if kinds is None else np.asarray(kinds, np.int32)
        prim.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(which))
        if turns is not None:
            quats = [Gf.Quath(*map(float, np.round(q, 4))) for q in np.asarray(turns, float)]
            prim.CreateOrientationsAttr(Vt.QuathArray(quats))
        if scales is not None:
            s = np.round(np.asarray(scales, float), 4)
            prim.CreateScalesAttr(
                Vt.Vec3fArray.FromNumpy(np.repeat(s[:, None], 3, axis=1).astype(np.float32))
            )
        prim.CreateExtentAttr(
            prim.ComputeExtentAtTime(Usd.TimeCode.Default(), Usd.TimeCode.Default())
        )

    # -- lights ---------------------------------------------------------------------------------

    def rect_light(
        self,
        name: str,
        eye: ArrayLike,
        target: ArrayLike,
        size: tuple[float, float],
        radiance: Colour,
    ) -> None:
        """A rectangle of the given width and height at `eye`, shining towards `target`."""
        light = UsdLux.RectLight.Define(self.stage, f"/World/Lights/{name}")
        light.CreateWidthAttr(size[0])
        light.CreateHeightAttr(size[1])
        light.AddTransformOp().Set(look_at(eye, target))
        _emit(UsdLux.LightAPI(light), radiance)

    def disk_light(
        self, name: str, eye: ArrayLike, target: ArrayLike, radius: float, radiance: Colour
    ) -> None:
        """A disk at `eye`, shining towards `target`."""
        light = UsdLux.DiskLight.Define(self.stage, f"/World/Lights/{name}")
        light.CreateRadiusAttr(radius)
        light.AddTransformOp().Set(look_at(eye, target))
        _emit(UsdLux.LightAPI(light), radiance)

    def sphere_light(self, name: str, position: ArrayLike, radius: float, radiance: Colour) -> None:
        """A sphere shining outwards."""
        light = UsdLux.SphereLight.Define(self.stage, f"/World/Lights/{name}")
        light.CreateRadiusAttr(radius)
        light.AddTranslateOp().Set(Gf.Vec3d(*np.round(np.asarray(position, float), 5).tolist()))
        _emit(UsdLux.LightAPI(light), radiance)

    def sun(self, towards: ArrayLike, irradiance: Colour, angle: float = 0.53) -> None:
        """A distant light seen in direction `towards`, `angle` degrees wide."""
        light = UsdLux.DistantLight.Define(self.stage, "/World/Lights/Sun")
        light.CreateAngleAttr(angle)
        light.AddTransformOp().Set(look_at(towards, (0, 0, 0)))
        # Irradiance on a facing surface is what is known of a sun, whatever its angle.
        light.CreateNormalizeAttr(True)
        _emit(UsdLux.LightAPI(light), irradiance)

    def dome(self, radiance: Colour, file: str | None = None, turn: float = 0.0) -> None:
        """A sky: `radiance`, times a lat-long image if there is one, turned about y in degrees."""
        light = UsdLux.DomeLight.Define(self.stage, "/World/Lights/Sky")
        if file is not None:
            light.CreateTextureFileAttr(Sdf.AssetPath(f"./textures/{file}"))
            light.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
        if turn:
            light.AddRotateYOp().Set(turn)
        _emit(UsdLux.LightAPI(light), radiance)

    # -- camera and settings --------------------------------------------------------------------

    def camera(
        self,
        eye: ArrayLike,
        target: ArrayLike,
        lens: float = 35.0,
        f_stop: float = 0.0,
        focus: ArrayLike | None = None,
        resolution: tuple[int, int] = (960, 540),
    ) -> None:
        """The camera: `lens` in millimetres on a 36 mm wide film; `f_stop` 0 is a pinhole.

        `focus` is a point that is sharp; the target, if it is not given.
        """
        path = "/World/Camera"
        camera = UsdGeom.Camera.Define(self.stage, path)
        camera.AddTransformOp().Set(look_at(eye, target))
        # UsdGeom measures lens and film in tenths of the stage's unit, so 1 is 100 mm here.
        camera.CreateFocalLengthAttr(lens / 100)
        camera.CreateHorizontalApertureAttr(0.36)
        camera.CreateVerticalApertureAttr(round(0.36 * resolution[1] / resolution[0], 6))
        camera.CreateClippingRangeAttr(Gf.Vec2f(0.01, 1000.0))
        eye, target = np.asarray(eye, float), np.asarray(target, float)
        axis = (target - eye) / np.linalg.norm(target - eye)
        sharp = target if focus is None else np.asarray(focus, float)
        camera.CreateFocusDistanceAttr(round(float((sharp - eye) @ axis), 4))
        camera.CreateFStopAttr(f_stop)
        UsdGeom.Scope.Define(self.stage, "/Render")
        settings = UsdRender.Settings.Define(self.stage, "/Render/Settings")
        settings.CreateResolutionAttr(Gf.Vec2i(*resolution))
        settings.CreateCameraRel().SetTargets([Sdf.Path(path)])
        self.stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")

    def save(self, folder: Path) -> Path:
        """Writes `NAME.usda` into the folder."""
        path = folder / f"{self.name}.usda"
        self.stage.GetRootLayer().Export(str(path))
        return path


def _emit(light: UsdLux.LightAPI, quantity: Colour) -> None:
    """Colour x intensity = quantity, with the largest component of the colour one."""
    peak = max(quantity)
    scale = 1.0 if peak <= 0 or math.isclose(peak, 1.0) else peak
    light.CreateIntensityAttr(round(float(scale), 5))
    light.CreateColorAttr(Gf.Vec3f(*[round(float(c / scale), 5) for c in quantity]))


def _extent(points: Array) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.array([points.min(axis=0), points.max(axis=0)], np.float32))
