"""Surfaces: lobes at their limits, and geometry that is hardly any."""

from __future__ import annotations

import numpy as np

from case import Rows, beside, case, row
from stage import DIFFUSE, SHARP, Stage, icosphere

GROUP = "Surfaces"


def ball(surface: dict) -> Stage:
    """A ball in a white furnace, which fills most of the picture."""
    s = Stage()
    s.ball(surface, [0, 0, 0], 1.0)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0, -3, 0], [0, 0, 0], 0.4)
    return s


@case(GROUP, "1: nothing is lost in a white furnace", axis="roughness")
def roughness(full: bool) -> Rows:
    """Metal and glass by roughness, through the threshold of Dirac lobes."""
    steps = (0.0, 1e-4, 1e-3, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.3, 0.6, 1.0)
    for kind, keys in (("glossy", {"color": 1.0}), ("glass", {"ior": 1.5})):
        for r in steps if full else (0.0, 0.01, 0.03, 1.0):
            got = ball({"type": kind, "roughness": r, **keys}).means(20, 48, 6, **SHARP)
            yield row(f"{kind}, roughness {r:g}", 1.0, got, 0.01, max(r, 3e-5), kind)


@case(GROUP, "1: nothing is lost in a white furnace")
def indices(full: bool) -> Rows:
    """Glass by index of refraction: none, next to none, diamond and beyond, and less than air."""
    for ior in (1.0, 1 + 1e-6, 1.5, 4.0, 0.5):
        for r in (0.0, 0.3) if full else (0.0,):
            got = ball({"type": "glass", "ior": ior, "roughness": r}).means(20, 48, 6, **SHARP)
            yield row(f"index {ior:.7g}, roughness {r:g}", 1.0, got, 0.01)


@case(GROUP, "0.75: emission over what is absorbed")
def immersed(full: bool) -> Rows:
    """A glowing furnace through a sheet of glass, from inside of glass, and with lamps in it."""
    glowing = {"type": "emission", "color": [1, 1, 1], "strength": 0.3}
    wall = {"type": "add", "a": glowing, "b": {"type": "diffuse", "color": 0.6}}

    def room(place: str, r: float) -> Stage:
        s = Stage()
        s.mesh(*icosphere(3), wall)
        glass = {"type": "glass", "ior": 1.5, "roughness": r}
        if place == "a sheet":
            s.mesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [0, 1, 2, 0, 2, 3], glass)
        if place == "camera in glass":
            s.ball(glass, [0, -0.6, 0], 0.25)
        if place == "lamp in glass":
            s.ball(wall, [0, 0.2, 0], 0.2)
            s.ball(glass, [0, 0.2, 0], 0.4)
        s.camera([0, -0.6, 0], [0, 0.2, 0], 0.4)
        return s

    methods = ("segment", "mvf", "path", "bdpt", "vcm") if full else ("segment", "path")
    for place in ("a sheet", "camera in glass", "lamp in glass"):
        for r in (0.0, 0.3):
            for method in methods:
                kernel = {} if method in ("path", "bdpt") else SHARP
                got = room(place, r).means(20, 64, 6, integrator=method, **kernel)
                yield row(f"{place}, roughness {r:g}, {method}", 0.75, got, 0.01)


@case(GROUP, "the room without the ball")
def nothing_to_see(full: bool) -> Rows:
    """A ball of index 1 is not there."""

    def room(with_ball: bool) -> Stage:
        s = Stage()
        s.floor(2.0, DIFFUSE)
        if with_ball:
            s.ball({"type": "glass", "ior": 1.0, "roughness": 0.0}, [0, 0, 0.6], 0.5)
        lamp = np.eye(4)
        lamp[2, 3] = 2
        s.light("rect", lamp, radiance=[1, 1, 1], camera_visible=False)
        s.camera([0, -3, 1], [0, 0, 0.2], 0.2)
        return s

    size = (32, 192 if full else 24, 6)
    without, with_it = room(False).means(*size, **SHARP), room(True).means(*size, **SHARP)
    yield beside("mean", without, with_it, 0.01 if full else 0.03)


@case(GROUP, "albedo of the floor under a white sky")
def grazing(full: bool) -> Rows:
    """Shading normals that disagree with the geometry."""
    for tilt in (30.0, 60.0, 89.0) if full else (60.0,):
        s = Stage()
        a = 1.0
        points = np.array([[-a, -a, 0], [a, -a, 0], [a, a, 0], [-a, a, 0]], np.float32)
        n = np.array([np.sin(np.radians(tilt)), 0, np.cos(np.radians(tilt))], np.float32)
        mesh = s.scene.add_mesh("tilted", points, [0, 1, 2, 0, 2, 3], normals=np.tile(n, (4, 1)))
        s.scene.add_instances("tilted", mesh, np.eye(4), [s.material(DIFFUSE)])
        s.light("dome", radiance=[1, 1, 1])
        s.camera([0, -0.8, 0.8], [0, 0, 0], 0.1)
        got = s.means(20, 48, 6, **SHARP)
        reference = s.means(20, 256, 6, integrator="path")
        yield beside(f"normals {tilt:g} degrees off, against path tracing", reference, got, 0.02)


def junk(s: Stage) -> None:
    """Triangles that are none: points, needles, duplicates."""
    p = [0.2, 0.1, 0.3]
    s.mesh([p, p, p], [0, 1, 2], DIFFUSE)
    s.mesh([[-1, 0, 0.2], [1, 0, 0.2], [0, 0, 0.2]], [0, 1, 2], DIFFUSE)
    s.mesh([[0, 0, 0.5], [1e-12, 0, 0.5], [0, 1e-12, 0.5]], [0, 1, 2], DIFFUSE)
    s.mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [1, 1, 0]], [0, 1, 2, 1, 2, 3], DIFFUSE)


@case(GROUP, "path tracing")
def rounded(full: bool) -> Rows:
    """A cube that is smooth by its normals alone, which lean up to 55 degrees off its faces."""
    s = Stage()
    corners = np.indices((2, 2, 2)).reshape(3, -1).T - 0.5
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    s.mesh(corners, triangles, DIFFUSE, smooth=True)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([1.2, -2.0, 1.4], [0, 0, 0], 0.3)
    size = (32, 16, 6)
    reference = s.means(32, 256, 6, integrator="path")
    for method in ("segment", "photon-filter") if full else ("segment",):
        yield beside(method, reference, s.means(*size, integrator=method), 0.02)


@case(GROUP, "path tracing")
def beside_itself(full: bool) -> Rows:
    """A tilted lamp that scatters and lets light pass: it lies in the way to itself."""
    s = Stage()
    lamp = {"type": "principled", "emission_color": [1, 1, 1], "emission_strength": 1.0}
    transparent = {"type": "transparent"}
    x, y = np.array([0.6, 0.55, 0.58]), np.array([-0.7, 0.63, 0.14])
    points = [-x - y, x - y, x + y, y - x]
    mixed = {"type": "mix", "factor": 0.4, "a": transparent, "b": lamp}
    s.mesh(points, [0, 1, 2, 0, 2, 3], mixed)
    s.light("dome", radiance=[0.5, 0.5, 0.5])
    s.camera([0, -0.8, 2.8], [0, 0, 0], 0.5)
    reference = s.means(32, 256, 6, integrator="path")
    yield beside("segment", reference, s.means(32, 32, 6), 0.02)


@case(GROUP, "the floor without them: albedo under a white sky")
def triangles(full: bool) -> Rows:
    """Degenerate, duplicated, needle-thin and coplanar triangles, and one that fills the view."""

    def floor(more: str) -> Stage:
        s = Stage()
        s.floor(1.0, DIFFUSE)
        if more == "junk":
            junk(s)
        if more == "coplanar":
            for _ in range(20):
                s.floor(1.0, DIFFUSE)
        s.light("dome", radiance=[1, 1, 1])
        s.camera([0, -0.5, 0.8], [0, 0, 0], 0.1)
        return s

    for more in ("", "junk", "coplanar"):
        yield row(more or "plain", 0.5, floor(more).means(20, 16, 6), 0.01)
    s = Stage()
    s.mesh([[-1e6, -1e6, 0], [1e6, -1e6, 0], [0, 1e6, 0]], [0, 1, 2], DIFFUSE)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0, -0.5, 0.8], [0, 0, 0], 0.1)
    yield row("one triangle of 10⁶ units", 0.5, s.means(20, 16, 6), 0.01)
    s = Stage()
    thin = 1e-6
    strips = np.linspace(-1, 1, 200 if full else 50)
    for x, y in zip(strips[:-1], strips[1:], strict=True):
        s.mesh([[x, -1, 0], [y, -1, 0], [y, 1, 0]], [0, 1, 2], DIFFUSE)
        s.mesh([[x, -1, 0], [y, 1, 0], [x, 1, 0]], [0, 1, 2], DIFFUSE)
        s.mesh([[x, -1, thin], [x + thin, -1, thin], [x, 1, thin]], [0, 1, 2], DIFFUSE)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0, -0.5, 0.8], [0, 0, 0], 0.1)
    yield row("a floor of strips and needles", 0.5, s.means(20, 16, 6), 0.01)


@case(GROUP, "the mean of a smaller picture")
def one_cluster(full: bool) -> Rows:
    """All of a picture's segments in one cluster."""
    sides = (256, 1024) if full else (256,)
    s = Stage()
    s.floor(1.0, DIFFUSE)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0, 0, 1], [0, 0, 0], 0.5)
    for side in sides:
        # few rays measure the area of the only cluster
        got = s.means(side, 1, 40, kernel="fixed", kernel_size=1000.0)
        yield row(f"{side * side:.1e} pixels in a kernel of 1000 pixels", 0.5, got, 0.01)
