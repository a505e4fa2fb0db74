"""A studio still of plain shapes under two soft boxes: the easy one, quick with any method."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import textures
from .mesh import Mesh, merged, rotation
from .shapes import arc, ball, box, curve, extrude, lathe, loft, torus
from .stage import Scene, Texture, placed


def sweep(width: float, depth: float, height: float, radius: float) -> Mesh:
    """A backdrop that turns from floor to wall in one curve, open, facing the camera."""
    floor = np.array([(depth, 0.0), (0.3 * depth, 0.0)])
    bend = arc((-depth + radius, radius), radius, 270, 180, 20)
    profile = np.concatenate([floor, bend, [(-depth, height)]])
    rows = [[(x, y, z) for z, y in profile] for x in np.linspace(-width / 2, width / 2, 5)]
    return loft(np.array(rows), wrap_columns=False).smooth(60)


def arch(width: float, height: float, thickness: float, depth: float) -> Mesh:
    """A round arch standing on two feet, its edges bevelled."""
    outer, inner = width / 2, width / 2 - thickness
    spring = height - outer
    outside = arc((0, spring), outer, 0, 180, 40)
    inside = arc((0, spring), inner, 180, 0, 40)
    outline = np.concatenate([[(outer, 0.0)], outside, [(-outer, 0.0)]])
    hollow = np.concatenate([[(-inner, 0.0)], inside, [(inner, 0.0)]])
    bevel = 0.006
    rows = []
    for inset, z in (
        (bevel, -depth / 2),
        (0, -depth / 2 + bevel),
        (0, depth / 2 - bevel),
        (bevel, depth / 2),
    ):
        out = np.array([0, spring]) + (outline - [0, spring]) * (outer - inset) / outer
        into = np.array([0, spring]) + (hollow - [0, spring]) * (inner + inset) / inner
        out[[0, -1], 1] = into[[0, -1], 1] = 0.0
        rows.append((out, into, z))
    # Each cross-section is a closed loop: out over the front and back, in along the hollow.
    loops = []
    for i in range(len(outline)):
        j = len(outline) - 1 - i
        loop = [(*out[i], z) for out, _, z in rows] + [
            (*into[j], z) for _, into, z in reversed(rows)
        ]
        loops.append(loop)
    for end in (0, -1):
        centre = np.mean(loops[end], axis=0)
        cap = [tuple(centre)] * len(loops[end])
        loops.insert(0 if end == 0 else len(loops), cap)
    return loft(np.array(loops)).flipped().smooth(35)


def vase() -> Mesh:
    """A slim bottle vase with a thick lip."""
    out = curve(
        [(0.0, 0.0), (0.055, 0.0), (0.075, 0.03), (0.085, 0.11), (0.06, 0.20), (0.026, 0.27)], 10
    )
    neck = curve([(0.026, 0.27), (0.021, 0.32), (0.028, 0.375)], 8)[1:]
    lip = arc((0.026, 0.375), 0.0025, 20, 180, 5)
    bore = [(0.0185, 0.33), (0.017, 0.25), (0.0, 0.24)]
    return lathe(np.concatenate([out, neck, lip, bore]), 72, crease=60)


def fluted_column(radius: float, height: float) -> Mesh:
    """A low plinth with soft flutes all round."""
    profile = [
        (0, 0),
        (radius, 0),
        (radius, 0.012),
        (radius, height - 0.012),
        (radius - 0.01, height),
        (0, height),
    ]
    return lathe(profile, 192, lambda a, h: 1 - 0.035 * np.abs(np.sin(12 * a)) ** 0.8, crease=45)


def build(folder: Path) -> Scene:
    """The scene; its textures go into the folder."""
    terrazzo = textures.terrazzo(
        384,
        (0.90, 0.87, 0.82),
        [(0.78, 0.45, 0.36), (0.33, 0.46, 0.42), (0.86, 0.68, 0.40), (0.55, 0.50, 0.47)],
        420,
        3,
    )
    textures.save_colour(folder, "terrazzo", terrazzo)
    scene = Scene("still_life", "Plain shapes under two soft boxes and a dim dome.")
    paper = scene.matte("Paper", (0.78, 0.52, 0.42))
    cream = scene.plastic("Cream", Texture("terrazzo.jpg", (3.0, 2.1)), 0.45)
    sage = scene.plastic("Sage", (0.22, 0.36, 0.29), 0.5)
    coral = scene.plastic("Coral", (0.80, 0.20, 0.13), 0.25)
    mustard = scene.plastic("Mustard", (0.80, 0.47, 0.09), 0.35)
    white = scene.plastic("Glaze", (0.82, 0.80, 0.76), 0.18)
    navy = scene.plastic("Navy", (0.035, 0.07, 0.16), 0.3)
    brass = scene.metal("Brass", (0.92, 0.72, 0.40), 0.22)

    scene.mesh("Backdrop", sweep(6.0, 1.6, 2.6, 0.9), paper)
    scene.mesh(
        "Arch", arch(0.50, 0.575, 0.085, 0.16), sage, placed((-0.16, 0, -0.25), rotation("y", 8))
    )
    scene.mesh("Plinth", fluted_column(0.155, 0.16), cream, placed((0.30, 0, -0.10)))
    scene.mesh("Ball", ball(0.115, 64, 32), coral, placed((0.30, 0.275, -0.10)))
    scene.mesh("Vase", vase(), white, placed((-0.15, 0, -0.19)))
    lean = rotation("y", -25) @ rotation("x", 72)
    scene.mesh("Hoop", torus(0.125, 0.033, 72, 28), mustard, placed((-0.40, 0.152, -0.02), lean))
    scene.mesh(
        "Block", box((0.15, 0.15, 0.15), 0.01), navy, placed((0.04, 0.075, 0.02), rotation("y", 32))
    )
    scene.mesh("SmallBall", ball(0.046, 48, 24), brass, placed((0.04, 0.196, 0.02)))
    cone = lathe([(0, 0), (0.075, 0), (0.079, 0.005), (0.003, 0.19), (0, 0.192)], 72)
    scene.mesh("Cone", cone, mustard, placed((0.56, 0, 0.02)))
    wedge = extrude(np.concatenate([[(0.0, 0.0)], arc((0, 0), 0.11, 0, 180, 32)])[1:], 0.05, 0.004)
    scene.mesh("Wedge", wedge, coral, placed((-0.20, 0.0, 0.13), rotation("y", -14)))
    pebbles = merged(
        [
            ball(0.022, 32, 16).scaled(1.3, 0.75, 1).moved(x, 0.0165, z)
            for x, z in ((0.23, 0.20), (0.31, 0.16))
        ]
    )
    scene.mesh("Pebbles", pebbles, white)

    scene.rect_light("Key", (-1.5, 1.7, 1.1), (0, 0.2, -0.1), (1.1, 1.1), (13.0, 12.0, 10.6))
    scene.rect_light("Rim", (1.7, 1.1, -0.3), (0, 0.25, -0.1), (0.5, 1.2), (4.6, 5.2, 6.4))
    scene.dome((0.17, 0.18, 0.21))
    scene.camera((0.10, 0.58, 2.0), (0.045, 0.245, -0.1), lens=53, f_stop=8.0, focus=(0, 0.2, 0.0))
    return scene
