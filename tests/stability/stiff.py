"""Stiff transport: light scattered hundreds of times, and rooms that hardly exchange any."""

from __future__ import annotations

import numpy as np

from case import Rows, case, row
from stage import SHARP, Stage, icosphere

GROUP = "Stiff"


def furnace(albedo: float) -> Stage:
    """A closed room whose walls emit 0.3 and have this albedo."""
    glow = {"type": "emission", "strength": 0.3}
    wall = {"type": "add", "a": glow, "b": {"type": "diffuse", "color": albedo}}
    s = Stage()
    s.mesh(*icosphere(2), wall, np.diag([3.0, 2.0, 2.5, 1.0]))
    s.camera([0.4, -0.7, 0.2], [-0.3, 0.5, 0.1], 0.5)
    return s


@case(GROUP, "Le / (1 - albedo)", axis="1 - albedo")
def closed_rooms(full: bool) -> Rows:
    """Closed rooms that glow, by albedo and kernel."""
    lengths = {0.5: 32, 0.9: 128, 0.99: 192, 0.999: 12}
    for albedo in lengths if full else (0.5, 0.9, 0.99):
        s = furnace(albedo)
        for size in (8.0, 2.0, 0.25) if full else (2.0,):
            samples = lengths[albedo] if full else min(lengths[albedo], 32)
            got = s.means(16, samples, 6, kernel="fixed", kernel_size=size)
            what = f"albedo {albedo}, {size:g} px, {samples} iterations"
            tolerance = 0.03 if albedo > 0.99 or not full else 0.01
            yield row(what, 0.3 / (1 - albedo), got, tolerance, 1 - albedo, f"{size:g} px")


@case(GROUP, "Le / (1 - albedo)", axis="iterations")
def iterations(full: bool) -> Rows:
    """A closed room of albedo 0.9, by iterations."""
    s = furnace(0.9)
    for samples in (1, 4, 16, 64) if full else (1, 4):
        got = s.means(16, samples, 160 // samples + 5, kernel="fixed", kernel_size=0.5)
        yield row(f"{samples} iterations", 3.0, got, 0.015, samples)


@case(GROUP, "albedo² Φ / (π A (1 - albedo)), light scattered twice or more")
def small_emitters(full: bool) -> Rows:
    """A point light in a closed sphere, by albedo and kernel."""
    for albedo in (0.5, 0.9, 0.99) if full else (0.9,):
        s = Stage()
        points, triangles = icosphere(4)
        s.mesh(points, triangles, {"type": "diffuse", "color": albedo})
        a, b, c = np.moveaxis(points[triangles], 1, 0)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        s.light("point", np.eye(4), intensity=[2, 2, 2])
        s.camera([-0.3, 0.2, -0.4], [0.5, 0.5, -0.5], 0.7)
        expected = albedo**2 * 8 / (area * (1 - albedo))
        for size in (8.0, 0.5) if full else (0.5,):
            set_up = {"kernel": "fixed", "kernel_size": size, "passes": ["Indirect"]}
            got = s.means(20, 64, 6, **set_up)
            yield row(f"albedo {albedo}, {size:g} px", expected, got, 0.01)


@case(GROUP, "the dark wall sees a disk of uniform radiance L: albedo L sin²")
def two_rooms(full: bool) -> Rows:
    """A bright room and a dark one, 10⁶ times darker, with a gap between them."""
    hole, distance, albedo = 0.2, 2.0, 2e-4
    bright = 0.3 / (1 - 0.5)
    glow = {"type": "emission", "strength": 0.3}
    walls = {"type": "add", "a": glow, "b": {"type": "diffuse", "color": 0.5}}
    black = {"type": "diffuse", "color": 0.0}
    s = Stage()
    points, triangles = icosphere(3)
    s.mesh(2 * points, triangles[(points[triangles][:, :, 2] < 1e-6).all(1)], walls)
    # its ceiling with the hole, black on the other side
    turns = np.linspace(0, 2 * np.pi, 129)[:-1]
    n = len(turns)
    circle = np.stack([np.cos(turns), np.sin(turns), np.zeros(n)], 1)
    ring = [(i, n + i, (i + 1) % n) for i in range(n)]
    ring += [((i + 1) % n, n + i, n + (i + 1) % n) for i in range(n)]
    for surface, height in ((walls, 0.0), (black, 1e-3)):
        both = np.concatenate([hole * circle, 3 * circle]) + np.array([0, 0, height])
        s.mesh(both, ring, surface)
    a, z = 0.05, distance
    s.quad([[-a, -a, z], [-a, a, z], [a, a, z], [a, -a, z]], {"type": "diffuse", "color": albedo})
    s.camera([0, 0, 1.0], [0, 0, distance], 0.02)
    expected = albedo * bright * hole**2 / (hole**2 + distance**2)
    got = s.means(24, 3072 if full else 256, 6, **SHARP)
    ratio = f"{expected / bright:.1e} of the bright room"
    # the hole takes a third of a percent from the bright room
    yield row(ratio, expected, got, 0.01 if full else 0.05)


@case(GROUP, "1: nothing is lost in a white furnace", axis="roughness")
def mirrors(full: bool) -> Rows:
    """Two rough mirrors that nearly touch, without absorption, by roughness."""
    for roughness in (0.01, 0.03, 0.1, 0.3) if full else (0.03, 0.3):
        s = Stage()
        metal = {"type": "glossy", "color": 1.0, "roughness": roughness}
        s.floor(1.0, metal)
        s.quad([[-1, -1, 0.02], [-1, 1, 0.02], [1, 1, 0.02], [1, -1, 0.02]], metal)
        s.light("dome", radiance=[1, 1, 1])
        s.camera([0, -1.2, 0.012], [0, 0, 0.008], 0.008)
        got = s.means(16, 48, 6, **SHARP)
        yield row(f"roughness {roughness}", 1.0, got, 0.01, roughness)


@case(GROUP, "1: nothing is lost in a white furnace")
def shells(full: bool) -> Rows:
    """Nested shells of glass, by their number and roughness."""
    for count in (2, 6) if full else (2,):
        for roughness in (0.0, 0.2):
            s = Stage()
            glass = {"type": "glass", "ior": 1.5, "roughness": roughness}
            for k in range(count):
                s.ball(glass, [0, 0, 0], 1 - 0.8 * k / count, 4)
            s.light("dome", radiance=[1, 1, 1])
            s.camera([0, -3, 0], [0, 0, 0], 0.3)
            got = s.means(16, 64 if full else 32, 6, **SHARP)
            # the tables of rough glass lose up to half a percent an interface
            tolerance = 0.01 * (count if roughness > 0 else 1)
            yield row(f"{count} shells, roughness {roughness:g}", 1.0, got, tolerance)


@case(GROUP, "1: nothing is lost in a white furnace")
def deep_glass(full: bool) -> Rows:
    """A block of frosted glass and an open box of albedo 1: thousands of bounces."""
    s = Stage()
    frosted = {"type": "glass", "ior": 1.8, "roughness": 0.4}
    m = np.diag([1.0, 1.0, 0.1, 1.0])
    s.mesh(*icosphere(3), frosted, m)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0, -3, 0.3], [0, 0, 0], 0.2)
    yield row("frosted glass", 1.0, s.means(16, 48, 6, **SHARP), 0.01)
    s = Stage()
    white = {"type": "diffuse", "color": 1.0}
    points = [[x, y, z] for z in (0, 6) for y in (0, 1) for x in (0, 1)]
    faces = [(0, 2, 3), (0, 3, 1), (0, 1, 5), (0, 5, 4), (1, 3, 7), (1, 7, 5)]
    faces += [(3, 2, 6), (3, 6, 7), (2, 0, 4), (2, 4, 6)]
    s.mesh(points, faces, white)
    s.light("dome", radiance=[1, 1, 1])
    s.camera([0.5, 0.5, 9], [0.5, 0.5, 0], 0.04)
    got = s.means(16, 256 if full else 48, 6, **SHARP)
    yield row("a shaft of albedo 1, six times as deep as wide", 1.0, got, 0.02 if full else 0.04)
