"""A tumbler of water, a cut-glass ball and a brass ring on a table, under one small bright lamp."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import textures
from .mesh import Array, Mesh, merged, rotation
from .shapes import arc, curve, lathe, quad
from .stage import Scene, Texture, placed

WALL = 0.0012
"""How far the water reaches into the tumbler's wall, so that no air is between them."""

WOOD = [
    (0.0, (0.42, 0.27, 0.17)),
    (0.4, (0.58, 0.40, 0.27)),
    (0.7, (0.70, 0.52, 0.37)),
    (1.0, (0.80, 0.64, 0.48)),
]


def tumbler() -> Mesh:
    """A heavy tumbler: fluted outside, smooth inside, with a thick foot."""
    outside = curve(
        [(0.030, 0.0), (0.0335, 0.002), (0.0350, 0.02), (0.0372, 0.05), (0.0400, 0.094)], 7
    )
    rim = arc((0.0388, 0.0945), 0.0012, 0, 180, 6)
    inside = curve(
        [(0.0376, 0.094), (0.0345, 0.05), (0.0322, 0.026), (0.0290, 0.0185), (0.0, 0.0170)], 7
    )
    profile = np.concatenate([[(0.0, 0.0015), (0.022, 0.0015), (0.025, 0.0)], outside, rim, inside])

    def flutes(angle: Array, height: Array) -> Array:
        fade = np.clip((0.066 - height) / 0.02, 0, 1) * np.clip((height - 0.001) / 0.006, 0, 1)
        # Only the outer wall is cut: there the radius is more than the inner wall's at that height.
        return 1 - 0.035 * fade * np.abs(np.cos(angle * 7)) ** 1.5

    outer_rows = 3 + len(outside)
    turned = lathe(profile[:outer_rows], 112, flutes, crease=50)
    upper = lathe(profile[outer_rows - 1 :], 112, crease=50)
    return merged([turned, upper])


def water(level: float) -> Mesh:
    """The water in the tumbler, a little larger than the cavity, with a meniscus at the wall."""
    wall = curve(
        [(0.0, 0.0170), (0.0290, 0.0185), (0.0322, 0.026), (0.0345, 0.05), (0.0376, 0.094)], 7
    )
    wall = wall[wall[:, 1] < level]
    body = wall + np.array([WALL, 0.0]) * (wall[:, :1] > 1e-6)
    body[:, 1] -= WALL
    edge = body[-1, 0] + 0.0002
    surface = [(edge, level + 0.0015), (edge - 0.0014, level + 0.0012)]
    surface += [(edge - 0.0025, level + 0.0004), (edge - 0.0045, level), (0.0, level)]
    return lathe(np.concatenate([body, surface]), 96, crease=60)


def cut_ball(radius: float) -> Mesh:
    """A crystal ball cut in rows of staggered facets, with a small flat table on top."""
    rings = 7
    sides = 14
    polar = np.radians(np.linspace(16, 164, rings))
    points = [np.array([0.0, radius * np.cos(polar[0]), 0.0])]
    for i, t in enumerate(polar):
        a = 2 * np.pi * (np.arange(sides) + 0.5 * (i % 2)) / sides
        ring = np.stack(
            [np.sin(t) * np.cos(a), np.full(sides, np.cos(t)), -np.sin(t) * np.sin(a)], axis=1
        )
        points.extend(radius * ring)
    points.append(np.array([0.0, radius * np.cos(polar[-1]), 0.0]))
    faces = [[0, 1 + j, 1 + (j + 1) % sides] for j in range(sides)]
    for i in range(rings - 1):
        upper, lower = 1 + i * sides, 1 + (i + 1) * sides
        for j in range(sides):
            k = (j + 1) % sides
            if i % 2 == 0:
                faces += [[upper + j, lower + j, upper + k], [upper + k, lower + j, lower + k]]
            else:
                faces += [[upper + j, lower + j, lower + k], [upper + j, lower + k, upper + k]]
    last = len(points) - 1
    base = 1 + (rings - 1) * sides
    faces += [[last, base + (j + 1) % sides, base + j] for j in range(sides)]
    counts = np.full(len(faces), 3)
    return Mesh(np.array(points), counts, np.concatenate([np.array(f) for f in faces]))


def ring() -> Mesh:
    """A broad finger ring of polished brass, lying flat: its inside throws a heart of light."""
    profile = np.concatenate(
        [
            arc((0.0247, 0.0012), 0.0012, -90, 0, 4),
            arc((0.0247, 0.0148), 0.0012, 0, 90, 4),
            arc((0.0237, 0.0152), 0.0008, 90, 180, 4),
            arc((0.0237, 0.0008), 0.0008, 180, 270, 4),
        ]
    )
    return lathe(profile, 128, crease=50, ring=True)


def build(folder: Path) -> Scene:
    """The scene; its textures go into the folder."""
    textures.save_colour(folder, "table", textures.planks(768, 5, WOOD, 11))
    textures.save_colour(folder, "teal", textures.plaster(256, (0.17, 0.36, 0.38), 0.05, 5))
    scene = Scene(
        "glass_caustic", "Caustics of glass, water, crystal and brass from one small lamp."
    )
    wood = scene.plastic("Wood", Texture("table.jpg", (1.25, 1.25)), 0.38)
    wall = scene.matte("Wall", Texture("teal.jpg", (1.2, 1.2)))
    glass = scene.glass("Glass", 1.52)
    crystal = scene.glass("Crystal", 1.65)
    wet = scene.glass("Water", 1.333)
    brass = scene.metal("Brass", (0.90, 0.68, 0.34), 0.12)

    scene.mesh(
        "Table", quad((-0.7, 0, 0.7), (0.7, 0, 0.7), (0.7, 0, -0.45), (-0.7, 0, -0.45)), wood
    )
    scene.mesh(
        "Wall",
        quad((-1.2, -0.4, -0.5), (1.2, -0.4, -0.5), (1.2, 0.9, -0.5), (-1.2, 0.9, -0.5)),
        wall,
    )
    scene.group("Tumbler", placed((-0.055, 0.0002, -0.03)))
    scene.mesh("Tumbler/Glass", tumbler(), glass)
    scene.mesh("Tumbler/Water", water(0.066), wet)
    tilt = rotation("y", 20) @ rotation("x", 16)
    ball = cut_ball(0.030)
    lowest = float((ball.points @ tilt.T)[:, 1].min())
    scene.mesh("Ball", ball, crystal, placed((0.066, 0.0002 - lowest, -0.012), tilt))
    scene.mesh("Ring", ring(), brass, placed((-0.068, 0.0002, 0.078)))

    scene.sphere_light("Lamp", (-0.40, 0.33, -0.36), 0.01, (5200, 4300, 3250))
    scene.dome((0.035, 0.045, 0.06))
    scene.camera(
        (0.03, 0.205, 0.48), (0.012, 0.030, 0.0), lens=56, f_stop=5.6, focus=(0.0, 0.04, 0.02)
    )
    return scene
