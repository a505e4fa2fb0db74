"""Extreme ranges: sizes, places, powers and numbers of lights."""

from __future__ import annotations

import numpy as np

from case import Row, Rows, beside, case, exact, row
from stage import DIFFUSE, SHARP, Means, Stage, look

GROUP = "Ranges"


def still(scale: float = 1.0, shift: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Stage:
    """A floor, a rough metal ball, a glass one and a lamp."""
    s = Stage(scale, shift=shift)
    s.floor(2.0, DIFFUSE)
    s.ball({"type": "glossy", "color": [0.9, 0.6, 0.3], "roughness": 0.3}, [-0.5, 0, 0.4], 0.4)
    s.ball({"type": "glass", "ior": 1.5, "roughness": 0.0}, [0.5, 0, 0.4], 0.4)
    s.light("rect", down([0.3, 0.5, 2.0]), radiance=[5, 5, 5])
    s.light("dome", radiance=[0.1, 0.1, 0.1])
    s.camera([0, -4, 1.5], [0, 0, 0.3], 0.3)
    return s


def down(at: list[float]) -> np.ndarray:
    """A light at a place that shines along -z."""
    m = np.eye(4)
    m[:3, 3] = at
    return m


@case(GROUP, "the scene at scale 1, at the origin, with the same seeds")
def places(full: bool) -> Rows:
    """The same scene, scaled, and moved away from the origin."""
    side, samples, seeds = (32, 32, 6) if full else (24, 48, 6)
    reference = still().means(side, samples, seeds)

    def off(what: str, s: Stage) -> Row:
        # the same random numbers: what differs is rounding and the paths that it turns elsewhere
        got = s.means(side, samples, seeds)
        paired = Means(got.values - reference.values + reference.mean, got.refused)
        return row(what, reference.mean, paired, 0.01)

    for scale in (1e-4, 1e-2, 1e3, 1e6) if full else (1e-4, 1e6):
        yield off(f"scale {scale:g}", still(scale))
    for shift in ((1e5, 0, 0), (1e5, -1e5, 1e5), (0, 0, 1e7)) if full else ((1e5, -1e5, 1e5),):
        yield off(f"moved by {max(map(abs, shift)):g}", still(1.0, shift))


@case(GROUP, "a floor under the middle of a disk: albedo L R² / (R² + h²)")
def sizes_of_lights(full: bool) -> Rows:
    """Emitters from 10⁻⁸ to 10⁸ of the scene's area."""
    for ratio in (1e-8, 1e-4, 1.0, 1e4, 1e8) if full else (1e-8, 1e8):
        radius = (16 * ratio / np.pi) ** 0.5
        s = Stage()
        s.floor(2.0, DIFFUSE)
        expected = 0.5 * radius**2 / (radius**2 + 1)
        # bright, so that small ones are seen
        s.light(
            "disk",
            down([0, 0, 1.0]),
            radius=radius,
            radiance=[1 / expected] * 3,
            camera_visible=False,
        )
        s.camera([0, -0.8, 0.8], [0, 0, 0], 1e-3)
        yield row(f"{ratio:g} of the floor", 1.0, s.means(16, 32, 6, **SHARP), 0.01)


@case(GROUP, "in proportion, with the same seed")
def powers(full: bool) -> Rows:
    """Radiance from 10⁻¹² to 10¹²."""

    def shown(radiance: float) -> float:
        s = Stage()
        s.floor(2.0, DIFFUSE)
        s.ball({"type": "glossy", "color": 0.8, "roughness": 0.3}, [0, 0, 0.5], 0.5)
        s.light("rect", down([0.3, 0.5, 2.0]), radiance=[radiance] * 3)
        s.camera([0, -4, 1.5], [0, 0, 0.3], 0.3)
        picture, stats = s.render(16, 8)
        assert stats["non_finite"] == stats["dropped"] == 0
        return float(picture.mean(dtype=float))

    one = shown(1.0)
    for power in (1e-12, 1e-6, 1e6, 1e12) if full else (1e-12, 1e12):
        yield exact(f"{power:g}", one, shown(power) / power, 1e-4)


@case(GROUP, "albedo E (1 - R) / (1 + R) / π, R the reflectance of one side")
def sun_through_glass(full: bool) -> Rows:
    """A sun through a pane of glass, by its angle."""
    for degrees in (0.0, 0.001, 0.5) if full else (0.001,):
        s = Stage()
        albedo, reflectance = 0.01, 0.04
        s.floor(1.0, {"type": "diffuse", "color": albedo})
        a = 1.2
        glass = {"type": "glass", "ior": 1.5, "roughness": 0.0}
        for z, order in ((1.0, (0, 3, 2, 1)), (1.1, (0, 1, 2, 3))):
            corners = np.array([[-a, -a, z], [a, -a, z], [a, a, z], [-a, a, z]])
            s.quad(corners[list(order)], glass)
        s.light(
            "distant", down([0, 0, 0]), irradiance=[np.pi / albedo] * 3, angle=np.radians(degrees)
        )
        s.camera([0, -0.8, 0.8], [0, 0, 0], 0.3)
        expected = (1 - reflectance) / (1 + reflectance)
        got = s.means(32, 512 if full else 320, 6, **SHARP)
        yield row(f"{degrees:g} degrees", expected, got, 0.01 if full else 0.02)


@case(GROUP, "quadrature of the bilinear map")
def peak_of_a_dome(full: bool) -> Rows:
    """A dome whose map has one texel 10⁶ times brighter than the rest."""
    height, width = (64, 128) if full else (16, 32)
    pixels = np.full((height, width, 3), 1e-6, np.float32)
    texel = (height // 4, width // 3)
    pixels[texel] = 1.0
    s = Stage()
    s.floor(2.0, DIFFUSE)
    image = s.scene.add_image("peak", pixels, "linear")
    # the map's +y, its top, is up
    turn = np.eye(4)
    turn[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    s.light("dome", turn, radiance=[1, 1, 1], image=image)
    s.camera([0, -0.8, 0.8], [0, 0, 0], 1e-3)
    fine = 64
    v = (np.arange(height * fine) + 0.5) / (height * fine)
    u = (np.arange(width * fine) + 0.5) / (width * fine)
    # a bilinear hat around the texel's middle
    hat_v = np.maximum(0, 1 - abs(v * height - 0.5 - texel[0]))
    hat_u = np.maximum(0, 1 - abs(u * width - 0.5 - texel[1]))
    theta = v * np.pi
    weight = np.maximum(np.cos(theta), 0) * np.sin(theta) * np.pi / len(v)
    peak = (hat_v * weight).sum() * hat_u.sum() * 2 * np.pi / len(u)
    expected = 0.5 / np.pi * (peak * (1 - 1e-6) + np.pi * 1e-6)
    yield row(f"{width} x {height} texels", expected, s.means(16, 32, 6, **SHARP), 0.01)


@case(GROUP, "albedo I cos / (π d²) of the one light that is not shut away")
def many_lights(full: bool) -> Rows:
    """Point lights of which one matters; the others stand in a closed box."""
    count = 100_000 if full else 2_000
    s = Stage()
    s.floor(2.0, DIFFUSE)
    rng = np.random.default_rng(1)
    box = np.array([30.0, 0.0, 1.0])
    for at in rng.uniform(-0.9, 0.9, (count, 3)) + box:
        s.scene.add_light(
            "many",
            {"type": "point", "intensity": [1, 1, 1], "transform": down(at).ravel().tolist()},
        )
    s.light("point", down([0, 0, 1.0]), intensity=[1, 1, 1])
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
    faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4)]
    faces += [(2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    s.mesh(corners + box, faces, DIFFUSE)
    s.camera([0, -0.8, 0.8], [0, 0, 0], 1e-3)
    yield row(f"1 of {count}", 0.5 / np.pi, s.means(24, 64, 6, **SHARP), 0.02)


@case(GROUP, "albedo of the floor under a white sky")
def footprints(full: bool) -> Rows:
    """Footprints of zero growth (orthographic), and of a plane up to the horizon."""
    s = Stage()
    s.floor(1.0, DIFFUSE)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0, 0, 5], [0, 0, 0], 0.5, type="orthographic")
    yield row("orthographic, open floor", 0.5, s.means(24, 48, 6), 0.01)
    s = Stage()
    s.floor(1e6, DIFFUSE)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0, 0, 1], [0, 1, 0.9], 0.1)
    yield row("floor of 10⁶ units, at the horizon", 0.5, s.means(24, 32, 6), 0.01)
    s = Stage()
    s.floor(1e3, DIFFUSE)
    s.light("dome", radiance=[1, 1, 1])
    tilt = np.radians(89.9999)
    m = look([0, 0, 0], [0, np.sin(tilt), -np.cos(tilt)])
    m[:3, 3] = [0, 0, 1e-4]
    window = [-1e-9, 1e-9, -1e-9, 1e-9]
    s.scene.set_camera("camera", {"transform": m.ravel().tolist(), "window": window})
    yield row("a floor under 89.9999 degrees", 0.5, s.means(16, 16, 6), 0.01)


@case(GROUP, "the same pictures with path tracing")
def same_by_path(full: bool) -> Rows:
    """The scene of the other rows, against path tracing with seeds of its own."""
    for scale in (1e-4, 1.0, 1e6) if full else (1.0,):
        s = still(scale)
        got = s.means(32, 64 if full else 24, 6, **SHARP)
        reference = s.means(32, 512 if full else 128, 6, integrator="path")
        yield beside(f"scale {scale:g}", reference, got, 0.02)
