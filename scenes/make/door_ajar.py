"""A hall at dusk, lit by nothing but what comes through a door left ajar."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import textures
from .mesh import Array, Mesh, merged, rotation
from .shapes import ball, box, curve, height_field, lathe, loft, quad, tube
from .stage import Scene, Texture, placed

LEFT, RIGHT, FRONT, TOP = -2.1, 2.5, 4.3, 2.6
"""The hall: x from LEFT to RIGHT, z from 0 to FRONT, y up to TOP. The lit room lies at z < 0."""

HINGE, WIDTH, LINTEL, THICK = -1.05, 0.88, 2.06, 0.12
"""The doorway: its left jamb, width and height, and the thickness of the wall around it."""

OAK = [
    (0.0, (0.36, 0.24, 0.15)),
    (0.5, (0.56, 0.40, 0.26)),
    (1.0, (0.72, 0.56, 0.39)),
]


def wall_with_doorway() -> Mesh:
    """The wall between the rooms, in three solid pieces around the opening."""
    jamb = HINGE + WIDTH
    left = box((HINGE - LEFT + 2.0, TOP, THICK)).moved(
        (HINGE + LEFT - 2.0) / 2, TOP / 2, -THICK / 2
    )
    right = box((RIGHT - jamb + 1.0, TOP, THICK)).moved(
        (RIGHT + 1.0 + jamb) / 2, TOP / 2, -THICK / 2
    )
    over = box((WIDTH, TOP - LINTEL, THICK)).moved(
        HINGE + WIDTH / 2, (TOP + LINTEL) / 2, -THICK / 2
    )
    return merged([left, right, over])


def casing() -> Mesh:
    """The moulded frame around the doorway, on the hall's side."""
    w, jamb = 0.09, HINGE + WIDTH
    bars = [
        box((w, LINTEL + w, 0.025), 0.008, 2).moved(x, (LINTEL + w) / 2, 0.0125)
        for x in (HINGE - w / 2, jamb + w / 2)
    ]
    bars.append(
        box((WIDTH + 2 * w + 0.05, w, 0.035), 0.008, 2).moved(
            HINGE + WIDTH / 2, LINTEL + w / 2, 0.0175
        )
    )
    return merged(bars)


def door() -> Mesh:
    """A door of four raised panels, hinged at x = 0 and reaching along +x."""
    w, h, t, rim = WIDTH - 0.01, LINTEL - 0.015, 0.042, 0.115
    rails = [0.0, 0.92, h - rim]
    parts = [box((rim, h, t), 0.004, 1).moved(x, h / 2, 0) for x in (rim / 2, w - rim / 2)]
    parts.append(box((rim, h, t - 0.001), 0.004, 1).moved(w / 2, h / 2, 0))
    parts += [
        box((w - 2 * rim + 0.01, rim * (1.7 if y == 0 else 1), t), 0.004, 1).moved(
            w / 2, y + rim * (0.85 if y == 0 else 0.5), 0
        )
        for y in rails
    ]
    side = (w - 3 * rim) / 2
    for x in (rim + side / 2, w - rim - side / 2):
        for low, high in ((rim * 1.7, rails[1]), (rails[1] + rim, rails[2])):
            parts.append(box((side + 0.01, high - low + 0.01, 0.014)).moved(x, (low + high) / 2, 0))
            parts.append(
                box((side - 0.05, high - low - 0.05, 0.03), 0.011, 1).moved(x, (low + high) / 2, 0)
            )
    return merged(parts)


def handle() -> Mesh:
    """A round knob on its rose, for both sides of the door."""
    profile = [(0, 0), (0.026, 0), (0.026, 0.004), (0.011, 0.008), (0.009, 0.028)]
    profile = np.concatenate(
        [
            profile,
            curve([(0.009, 0.028), (0.024, 0.036), (0.029, 0.048), (0.022, 0.060), (0, 0.064)], 6)[
                1:
            ],
        ]
    )
    knob = lathe(profile, 40, crease=50).turned("x", 90).moved(0, 0, 0.021)
    return merged([knob, knob.turned("y", 180)])


def bench() -> Mesh:
    """A plain bench of three boards with a slatted shelf."""
    parts = [box((1.25, 0.035, 0.36), 0.006, 2).moved(0, 0.44, 0)]
    parts += [box((0.045, 0.425, 0.32), 0.005, 1).moved(x, 0.2125, 0) for x in (-0.54, 0.54)]
    parts += [
        box((1.04, 0.016, 0.05), 0.003, 1).moved(0, 0.14, z) for z in np.linspace(-0.13, 0.13, 4)
    ]
    return merged(parts)


def hat() -> Mesh:
    """A straw hat, hung with its crown to the front (+z)."""
    brim = [(0.19, 0.012), (0.188, 0.006), (0.14, -0.002), (0.10, 0.002)]
    crown = curve([(0.094, 0.01), (0.085, 0.075), (0.07, 0.105), (0.0, 0.115)], 6)
    under = [
        (0, 0.109),
        (0.068, 0.099),
        (0.082, 0.07),
        (0.091, 0.004),
        (0.14, -0.005),
        (0.187, 0.002),
    ]
    profile = np.concatenate([np.array(brim), crown])[::-1][::-1]
    solid = lathe(
        np.concatenate([profile, under]),
        56,
        lambda a, h: 1 + 0.02 * np.sin(3 * a) * (h < 0.02),
        50,
        ring=True,
    )
    return (solid if solid.volume() > 0 else solid.flipped()).turned("x", 78)


def scarf() -> Mesh:
    """A knitted scarf hanging in folds from a peg, widening downwards."""
    rows, columns = 26, 34
    down, across = np.meshgrid(np.linspace(0, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    wide = 0.045 + 0.075 * down**0.6
    fold = np.sin(across * 7.0 + 1.3 * down + 0.6) * 0.024 * (0.35 + 0.65 * down)
    x = across * wide + 0.012 * np.sin(down * 5)
    y = -0.92 * down - 0.03 * across * down + 0.02 * np.cos(across * 3.1)
    z = 0.045 + fold - 0.03 * down + 0.03 * (1 - across**2) * (1 - down)
    front = loft(np.stack([x, y, z], axis=-1)[::-1], wrap_columns=False)
    uv = np.stack([across[::-1].ravel() * 0.12, -y[::-1].ravel()], axis=1)
    return Mesh(front.points, front.counts, front.indices, uv).smooth(80)


def floor_vase() -> Mesh:
    """A tall stoneware vase."""
    out = curve(
        [
            (0, 0),
            (0.10, 0),
            (0.125, 0.02),
            (0.185, 0.26),
            (0.15, 0.46),
            (0.075, 0.58),
            (0.085, 0.64),
        ],
        8,
    )
    bore = [(0.078, 0.645), (0.070, 0.635), (0.062, 0.58), (0.10, 0.50), (0, 0.45)]
    return lathe(np.concatenate([out, bore]), 64, crease=60)


def branches(rng: np.random.Generator) -> tuple[Mesh, Array]:
    """Bare twigs rising from the vase's mouth, and places for buds along them."""
    twigs, buds = [], []
    for i in range(9):
        yaw = 2.4 * i + rng.normal(0, 0.2)
        lean = rng.uniform(0.16, 0.42)
        height = rng.uniform(0.7, 1.05)
        t = np.linspace(0, 1, 6)
        away = 0.03 + lean * t**1.6
        knots = np.stack([away * np.cos(yaw), 0.5 + height * t, away * np.sin(yaw)], axis=1)
        knots[1:] += rng.normal(0, 0.022, (5, 3))
        path = curve(knots, 3)
        twigs.append(tube(path, 0.0035, 5))
        buds.extend(at + rng.normal(0, 0.006, 3) for at in path[5:])
    return merged(twigs), np.array(buds)


def rug(width: float, length: float) -> Mesh:
    """A rug with a gentle ripple, lying just above the floor."""

    def ripple(x: Array, z: Array) -> Array:
        return 0.009 + 0.004 * np.sin(9 * z + 2 * x) * np.sin(2.2 * x + 1) ** 2

    return height_field(
        np.linspace(-width / 2, width / 2, 25), np.linspace(-length / 2, length / 2, 33), ripple
    ).smooth(60)


def rug_pattern(size: int) -> Array:
    """Stripes of wool, broken by the weave."""
    y = (np.mgrid[0:size, 0:size] / size)[0]
    shades = [
        (0.55, 0.22, 0.14),
        (0.78, 0.66, 0.50),
        (0.18, 0.24, 0.30),
        (0.78, 0.66, 0.50),
        (0.62, 0.36, 0.16),
    ]
    widths = np.cumsum([0.30, 0.08, 0.22, 0.08, 0.32])
    stripe = np.searchsorted(widths, y + 0.002 * textures.noise((size, size), 50, 0.4)).clip(0, 4)
    return np.array(shades)[stripe] * (1 + 0.06 * textures.noise((size, size), 51, 0.2))[..., None]


def build(folder: Path) -> Scene:
    """The scene; its textures go into the folder."""
    textures.save_colour(folder, "oak", textures.planks(1024, 9, OAK, 41, 0.016))
    textures.save_colour(folder, "sage", textures.plaster(256, (0.62, 0.69, 0.63), 0.025, 17))
    textures.save_colour(folder, "rug", rug_pattern(384))
    scene = Scene("door_ajar", "All light comes through the gap of a door left ajar.", digits=4)
    oak = scene.plastic("Floor", Texture("oak.jpg", (0.75, 0.75)), 0.32)
    sage = scene.matte("Wall", Texture("sage.jpg", (0.5, 0.5)))
    cream = scene.matte("Cream", (0.78, 0.74, 0.66))
    white = scene.plastic("Paint", (0.80, 0.78, 0.73), 0.35)
    brass = scene.metal("Brass", (0.88, 0.68, 0.38), 0.18)
    timber = scene.plastic("Timber", (0.30, 0.17, 0.09), 0.4)
    wool = scene.matte("Wool", Texture("rug.jpg", (0.77, 0.77)))
    knit = scene.matte("Knit", (0.55, 0.16, 0.10))
    straw = scene.matte("Straw", (0.72, 0.54, 0.28))
    stoneware = scene.plastic("Stoneware", (0.10, 0.15, 0.19), 0.22)
    bark = scene.matte("Bark", (0.12, 0.075, 0.05))
    bud = scene.matte("Bud", (0.80, 0.62, 0.55))
    red = scene.plastic("Ball", (0.62, 0.055, 0.04), 0.15)

    scene.mesh("DoorWall", wall_with_doorway(), sage)
    scene.mesh("Casing", casing(), white)
    swing = rotation("y", -24)
    scene.group("Door", placed((HINGE + 0.004, 0.008, 0.0), swing))
    scene.mesh("Door/Leaf", door(), white)
    scene.mesh("Door/Handle", handle(), brass, placed((WIDTH - 0.068, 1.02, 0.0)))
    scene.mesh("Floor", quad((-5, 0, FRONT), (4, 0, FRONT), (4, 0, -4.2), (-5, 0, -4.2)), oak)
    hall = [
        quad((LEFT, 0, FRONT), (LEFT, 0, 0), (LEFT, TOP, 0), (LEFT, TOP, FRONT)),
        quad((RIGHT, 0, 0), (RIGHT, 0, FRONT), (RIGHT, TOP, FRONT), (RIGHT, TOP, 0)),
        quad((RIGHT, 0, FRONT), (LEFT, 0, FRONT), (LEFT, TOP, FRONT), (RIGHT, TOP, FRONT)),
    ]
    scene.mesh("HallWalls", merged(hall), sage)
    scene.mesh(
        "Ceiling", quad((-5, TOP, -4.2), (4, TOP, -4.2), (4, TOP, FRONT), (-5, TOP, FRONT)), cream
    )
    far = [
        quad((-4.1, 0, -4.1), (3.5, 0, -4.1), (3.5, TOP, -4.1), (-4.1, TOP, -4.1)),
        quad((-4.1, 0, -THICK), (-4.1, 0, -4.1), (-4.1, TOP, -4.1), (-4.1, TOP, -THICK)),
        quad((3.5, 0, -4.1), (3.5, 0, -THICK), (3.5, TOP, -THICK), (3.5, TOP, -4.1)),
    ]
    scene.mesh("FarRoom", merged(far), cream)
    jamb = HINGE + WIDTH + 0.09
    skirts = [
        box((HINGE - 0.09 - LEFT, 0.13, 0.018), 0.006, 2).moved(
            (HINGE - 0.09 + LEFT) / 2, 0.065, 0.009
        )
    ]
    skirts.append(
        box((RIGHT - jamb, 0.13, 0.018), 0.006, 2).moved((RIGHT + jamb) / 2, 0.065, 0.009)
    )
    skirts += [
        box((0.018, 0.13, FRONT), 0.006, 2).moved(x, 0.065, FRONT / 2)
        for x in (LEFT + 0.009, RIGHT - 0.009)
    ]
    scene.mesh("Skirting", merged(skirts), white)

    scene.mesh("Bench", bench(), timber, placed((1.2, 0, 0.24)))
    rail = [box((1.3, 0.09, 0.022), 0.005, 1).moved(0, 0, 0.011)]
    peg = lathe(
        [(0, 0), (0.010, 0), (0.008, 0.05), (0.015, 0.058), (0.014, 0.07), (0, 0.074)], 20
    ).turned("x", 90)
    rail += [peg.moved(x, 0, 0.022) for x in np.linspace(-0.52, 0.52, 5)]
    scene.mesh("Pegs", merged(rail), timber, placed((1.2, 1.66, 0)))
    scene.mesh("Hat", hat(), straw, placed((1.46, 1.60, 0.075), rotation("z", -14)))
    scene.mesh("Scarf", scarf(), knit, placed((0.94, 1.67, 0.025)))
    scene.mesh("Rug", rug(1.5, 2.2), wool, placed((0.72, 0, 1.42), rotation("y", -52)))
    scene.mesh("Ball", ball(0.115, 48, 24), red, placed((0.62, 0.128, 0.86)))
    scene.group("Vase", placed((-1.66, 0, 0.42)))
    scene.mesh("Vase/Body", floor_vase(), stoneware)
    twigs, buds = branches(np.random.default_rng(12))
    scene.mesh("Vase/Twigs", twigs, bark)
    scene.scatter(
        "Vase/Buds", [(ball(0.011, 8, 6), bud)], buds, scales=np.linspace(0.6, 1.4, len(buds))
    )

    scene.rect_light("Window", (-3.3, 1.75, -3.25), (-0.15, 0.7, 0.1), (1.3, 1.5), (1050, 840, 590))
    scene.camera((1.22, 1.32, 4.1), (0.06, 0.80, 0.2), lens=26)
    return scene
