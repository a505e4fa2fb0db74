"""The gallery: stages whole, valid, within their sizes, and rendered without a warning."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

import segue

pytest.importorskip("pxr", reason="usd-core is not installed")
from pxr import Usd, UsdGeom, UsdLux, UsdRender, UsdShade, UsdValidation

FOLDER = Path(__file__).parents[2] / "scenes"
STAGES = sorted(FOLDER.glob("*.usda"))

WELD = 1e-5
"""Corners nearer than this (metres) are one point: stages are written with 4 or 5 decimals."""


@pytest.fixture(params=STAGES, ids=lambda path: path.stem)
def stage(request: pytest.FixtureRequest) -> Usd.Stage:
    """Each stage of the gallery in turn."""
    return Usd.Stage.Open(str(request.param))


def meshes(stage: Usd.Stage) -> list[UsdGeom.Mesh]:
    """All meshes, prototypes included, instances of them not."""
    return [UsdGeom.Mesh(p) for p in stage.TraverseAll() if p.IsA(UsdGeom.Mesh)]


def surface_of(mesh: UsdGeom.Mesh) -> UsdShade.Shader:
    """The surface shader bound to a mesh."""
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    assert material, f"{mesh.GetPath()} has no material"
    return material.ComputeSurfaceSource()[0]


def is_glass(mesh: UsdGeom.Mesh) -> bool:
    """Whether light goes through the mesh's surface by refraction."""
    opacity = surface_of(mesh).GetInput("opacity")
    return bool(opacity) and opacity.Get() == 0.0


def test_there_is_a_gallery() -> None:
    """An empty folder must not pass for a good one."""
    assert len(STAGES) >= 7


def test_frame(stage: Usd.Stage) -> None:
    """Default prim, units, axis, one camera, and settings that name it."""
    assert stage.GetDefaultPrim()
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    assert stage.GetRootLayer().documentation
    cameras = [p for p in stage.TraverseAll() if p.IsA(UsdGeom.Camera)]
    assert len(cameras) == 1
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    assert settings.GetCameraRel().GetTargets() == [cameras[0].GetPath()]
    width, height = settings.GetResolutionAttr().Get()
    film = UsdGeom.Camera(cameras[0])
    aspect = film.GetHorizontalApertureAttr().Get() / film.GetVerticalApertureAttr().Get()
    assert aspect == pytest.approx(width / height, rel=1e-5)


def test_validators_are_silent(stage: Usd.Stage) -> None:
    """USD's own checks of structure, shading and lights find nothing."""
    registry = UsdValidation.ValidationRegistry()
    keep = ("usdValidation:", "usdGeomValidators:", "usdShadeValidators:", "usdLuxValidators:")
    names = [m.name for m in registry.GetAllValidatorMetadata() if m.name.startswith(keep)]
    chosen = [registry.GetOrLoadValidatorByName(name) for name in names]
    assert len(chosen) > 10
    errors = UsdValidation.ValidationContext(chosen).Validate(stage)
    assert [e.GetErrorAsString() for e in errors] == []


def test_files_are_there(stage: Usd.Stage) -> None:
    """Every image that a stage names is committed beside it."""
    for prim in stage.TraverseAll():
        for attribute in prim.GetAttributes():
            value = attribute.Get()
            if type(value).__name__ == "AssetPath":
                assert value.path.startswith("./textures/")
                assert Path(value.resolvedPath).is_file(), f"{attribute.GetPath()}: {value.path}"


def test_meshes_are_sound(stage: Usd.Stage) -> None:
    """Finite points, indices in range, unit normals, a true extent, a sensible face count."""
    for mesh in meshes(stage):
        points = np.array(mesh.GetPointsAttr().Get())
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get())
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get())
        assert np.isfinite(points).all(), mesh.GetPath()
        assert counts.min() >= 3 and counts.sum() == len(indices), mesh.GetPath()
        assert indices.min() >= 0 and indices.max() < len(points), mesh.GetPath()
        extent = np.array(mesh.GetExtentAttr().Get())
        assert np.allclose(extent, [points.min(axis=0), points.max(axis=0)], atol=1e-5)
        assert mesh.GetDoubleSidedAttr().Get()
        normals = mesh.GetNormalsAttr().Get()
        if normals is not None:
            length = np.linalg.norm(np.array(normals), axis=1)
            assert len(length) == len(points), mesh.GetPath()
            assert np.allclose(length, 1.0, atol=2e-3), mesh.GetPath()


def test_glass_is_closed(stage: Usd.Stage) -> None:
    """Every refracting mesh is a closed surface that faces outwards."""
    for mesh in filter(is_glass, meshes(stage)):
        points = np.array(mesh.GetPointsAttr().Get(), float)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get())
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get())
        keys = np.round(points / WELD).astype(np.int64)
        _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        corner = place.reshape(-1)[indices]
        ends = np.cumsum(counts)
        following = np.arange(1, len(corner) + 1)
        following[ends - 1] = ends - counts
        edges = np.stack([corner, corner[following]], axis=1)
        edges = edges[edges[:, 0] != edges[:, 1]]
        there = np.sort(edges[:, 0] * len(first) + edges[:, 1])
        back = np.sort(edges[:, 1] * len(first) + edges[:, 0])
        assert np.array_equal(there, back), f"{mesh.GetPath()} has open edges"
        starts = np.repeat(ends - counts, counts)
        a, b, c = points[indices[starts]], points[indices], points[indices[following]]
        volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
        assert volume > 0.0, f"{mesh.GetPath()} is inside out"


def test_something_shines(stage: Usd.Stage) -> None:
    """There is a light with a finite, positive emission, and none without."""
    shining = 0
    for prim in stage.TraverseAll():
        if prim.HasAPI(UsdLux.LightAPI):
            light = UsdLux.LightAPI(prim)
            power = np.array(light.GetColorAttr().Get()) * light.GetIntensityAttr().Get()
            assert np.isfinite(power).all() and power.max() > 0.0, prim.GetPath()
            shining += 1
    for mesh in meshes(stage):
        glow = surface_of(mesh).GetInput("emissiveColor")
        shining += bool(glow) and max(glow.Get()) > 0.0
    assert shining > 0


@pytest.mark.parametrize("path", STAGES, ids=lambda path: path.stem)
def test_stage_is_small(path: Path) -> None:
    """Stages are read by people and by diff: at most 1.5 MB each."""
    assert path.stat().st_size <= 1_500_000


@pytest.mark.parametrize("path", STAGES, ids=lambda path: path.stem)
def test_stage_is_shown(path: Path) -> None:
    """Each stage has its picture, below 300 kB, and its row in the table."""
    picture = FOLDER / "pictures" / f"{path.stem}.jpg"
    assert 0 < picture.stat().st_size <= 300_000
    table = (FOLDER / "README.md").read_text()
    assert f'"pictures/{path.stem}.jpg"' in table
    assert f"({path.name})" in table


def test_textures_are_small() -> None:
    """All images together take at most 3 MB, and none is unused."""
    images = list((FOLDER / "textures").iterdir())
    assert sum(image.stat().st_size for image in images) <= 3_000_000
    text = "".join(path.read_text() for path in STAGES)
    assert [image.name for image in images if f"@./textures/{image.name}@" not in text] == []


@pytest.mark.parametrize("path", STAGES, ids=lambda path: path.stem)
def test_generator_makes_what_is_committed(path: Path, tmp_path: Path, monkeypatch) -> None:
    """The committed stage has the prims and the shapes of the one its generator makes now."""
    pytest.importorskip("OpenImageIO", reason="the generator writes images with OpenImageIO")
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    made = importlib.import_module(f"make.{path.stem}").build(tmp_path).stage
    committed = Usd.Stage.Open(str(path))
    names = [str(p.GetPath()) for p in committed.TraverseAll()]
    assert [str(p.GetPath()) for p in made.TraverseAll()] == names
    # Shading normals are split by an angle, so only the shape is compared, not every number.
    for ours, theirs in zip(meshes(made), meshes(committed), strict=True):
        assert np.allclose(ours.GetExtentAttr().Get(), theirs.GetExtentAttr().Get(), atol=2e-4)
        assert len(ours.GetFaceVertexCountsAttr().Get()) == len(
            theirs.GetFaceVertexCountsAttr().Get()
        )


@pytest.mark.parametrize("path", STAGES, ids=lambda path: path.stem)
def test_renders(path: Path, engine: Path) -> None:
    """Segue takes the whole stage, and a small picture of it is finite and shows something."""
    from segue import usd

    loaded = usd.load(path)
    assert [str(entry) for entry in loaded.report.entries] == []
    settings = {**loaded.settings(), "resolution": [64, 36], "samples": 4, "max_depth": 6}
    render = segue.Render(loaded.scene, settings)
    assert render.run()
    picture = render.read_pass("Combined")[..., :3]
    stats = render.stats()
    assert stats["warnings"] == [] and stats["non_finite"] == 0
    assert np.isfinite(picture).all()
    assert picture.min() >= 0.0
    lit = (picture.max(axis=2) > 1e-3).mean()
    assert lit > 0.1, f"only {lit:.0%} of the picture is lit"
