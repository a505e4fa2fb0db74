"""A courtyard pool in the sun: caustics on tiles seen through the waves that made them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from . import textures
from .mesh import Array, Mesh, merged, rotation
from .shapes import arc, basin_body, box, curve, lathe, loft, quad, tube
from .stage import Scene, Texture, placed

WIDTH, LENGTH, DEPTH = 3.6, 4.6, 1.15
LEVEL = -0.11
"""Height of the still water; the deck is at 0 and the pool's floor at -DEPTH."""


def waves(x: Array, z: Array) -> Array:
    """Height of the water: sines of many directions, steeper where they are short."""
    rng = np.random.default_rng(29)
    height = np.full(np.shape(x), LEVEL)
    for length in np.geomspace(0.34, 1.6, 26):
        angle = rng.normal(0.6, 1.2)
        k = 2 * np.pi / length
        amplitude = 0.0046 * length**1.3 * rng.uniform(0.6, 1.4)
        phase = k * (np.cos(angle) * x + np.sin(angle) * z) + rng.uniform(0, 2 * np.pi)
        height = height + amplitude * np.sin(phase + 0.5 * np.sin(phase * 0.31))
    return height


def water() -> Mesh:
    """The water as a closed body that reaches 4 mm into the tiles on every side."""
    reach = 0.004
    x = np.linspace(-WIDTH / 2 - reach, WIDTH / 2 + reach, 77)
    z = np.linspace(-LENGTH / 2 - reach, LENGTH / 2 + reach, 97)
    return basin_body(x, z, waves, -DEPTH - reach)


def basin() -> Mesh:
    """Floor and walls of the pool, facing inwards, uv in metres."""
    w, d, h = WIDTH / 2, LENGTH / 2, -DEPTH
    return merged(
        [
            quad((-w, h, d), (w, h, d), (w, h, -d), (-w, h, -d)),
            quad((-w, h, -d), (w, h, -d), (w, 0, -d), (-w, 0, -d)),
            quad((-w, h, d), (-w, h, -d), (-w, 0, -d), (-w, 0, d)),
            quad((w, h, -d), (w, h, d), (w, 0, d), (w, 0, -d)),
            quad((w, h, d), (-w, h, d), (-w, 0, d), (w, 0, d)),
        ]
    )


def coping() -> Array:
    """Places of the stones around the edge: (x, z, kind), 1 turned along z, 2 a corner."""
    stone = 0.46
    places = []
    for x in np.arange(-4, 4) * stone + stone / 2:
        places += [(x, -LENGTH / 2 - 0.19, 0.0), (x, LENGTH / 2 + 0.19, 0.0)]
    for z in np.arange(-5, 5) * stone + stone / 2:
        places += [(-WIDTH / 2 - 0.19, z, 1.0), (WIDTH / 2 + 0.19, z, 1.0)]
    for sx in (-1, 1):
        places += [(sx * (WIDTH / 2 + 0.19), sz * (LENGTH / 2 + 0.19), 2.0) for sz in (-1, 1)]
    return np.array(places)


def ladder() -> Mesh:
    """Two bent rails and three treads of polished steel."""
    rail = curve(
        [
            (0, -0.95, 0),
            (0, 0.30, 0),
            (0, 0.56, 0.10),
            (0, 0.60, 0.27),
            (0, 0.50, 0.42),
            (0, 0.0, 0.47),
        ],
        9,
    )
    parts = [tube(rail + np.array([x, 0, 0]), 0.019, 14) for x in (-0.22, 0.22)]
    parts += [box((0.42, 0.022, 0.075), 0.008, 1).moved(0, y, -0.01) for y in (-0.78, -0.52, -0.26)]
    return merged(parts)


def float_ring(stripe: int) -> Mesh:
    """Every other twelfth of a swimming ring; `stripe` 0 or 1 says which."""
    major, minor, rows, columns = 0.33, 0.105, 8, 24
    section = arc((0.0, 0.0), 1.0, 0, 360, columns)[:-1]
    parts = []
    for i in range(stripe, 12, 2):
        turn = np.radians(np.linspace(i * 30, (i + 1) * 30, rows + 1))[:, None]
        up = np.tile(section[:, 1], (rows + 1, 1))
        normals = np.stack(
            [np.cos(turn) * section[:, 0], up, -np.sin(turn) * section[:, 0]], axis=-1
        )
        spine = major * np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], axis=-1)
        skin = loft(spine + minor * normals).flipped()
        parts.append(replace(skin, uv=None, normals=normals.reshape(-1, 3)))
    return merged(parts)


def agave_leaf() -> Mesh:
    """One thick pointed leaf, rising along +x and bending down."""
    rows = []
    for t in np.linspace(0, 1, 9):
        wide = 0.055 * np.sin(np.pi * min(1.0, 0.25 + 0.75 * t)) ** 0.8 * (1 - t) ** 0.25 + 0.002
        thick = 0.014 * (1 - t) + 0.002
        x, y = 0.03 + 0.46 * t, 0.10 * np.sin(2.2 * t)
        angle = np.radians(np.arange(8) * 45.0)
        trough = 0.35 * wide * np.cos(angle) ** 2
        rows.append(
            np.stack(
                [np.full(8, x), y + thick * np.sin(angle) + trough, wide * np.cos(angle)], axis=1
            )
        )
    rows = [
        np.tile(rows[0].mean(axis=0), (8, 1)),
        *rows,
        np.tile(rows[-1].mean(axis=0) + np.array([0.02, 0, 0]), (8, 1)),
    ]
    solid = loft(np.array(rows))
    return (solid if solid.volume() > 0 else solid.flipped()).smooth(60)


def pot() -> Mesh:
    """A terracotta pot with a rolled rim, filled with earth to below the rim."""
    out = curve([(0.13, 0.0), (0.15, 0.02), (0.20, 0.22), (0.225, 0.34)], 6)
    rim = [
        (0.25, 0.345),
        (0.255, 0.36),
        (0.255, 0.385),
        (0.245, 0.395),
        (0.222, 0.395),
        (0.215, 0.385),
    ]
    return lathe(np.concatenate([[(0, 0)], out, rim, [(0.21, 0.355), (0, 0.365)]]), 64)


def agave(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Positions, quaternions and sizes of the leaves of one rosette."""
    turn, size = [], []
    for i in range(30):
        yaw = np.radians(137.5 * i + rng.normal(0, 5)) / 2
        pitch = np.radians(8 + 66 * (i / 29) ** 0.8) / 2
        # Pitch about z, then yaw about y, as one quaternion.
        turn.append(
            (
                np.cos(yaw) * np.cos(pitch),
                np.sin(yaw) * np.sin(pitch),
                np.sin(yaw) * np.cos(pitch),
                np.cos(yaw) * np.sin(pitch),
            )
        )
        size.append(1.0 - 0.38 * i / 29)
    return np.zeros((30, 3)), np.array(turn), np.array(size)


def build(folder: Path) -> Scene:
    """The scene; its textures go into the folder."""
    blues = [
        (0.35, 0.72, 0.74),
        (0.42, 0.77, 0.78),
        (0.52, 0.82, 0.82),
        (0.28, 0.64, 0.70),
        (0.66, 0.87, 0.86),
    ]
    textures.save_colour(folder, "mosaic", textures.tiles(512, 8, blues, (0.80, 0.84, 0.82), 21))
    textures.save_colour(folder, "stucco", textures.plaster(256, (0.86, 0.47, 0.46), 0.035, 8))
    textures.save_colour(folder, "deck", textures.plaster(256, (0.72, 0.67, 0.60), 0.05, 9))
    day = textures.sky(256, (0.16, 0.33, 0.72), (0.62, 0.72, 0.86), (0.30, 0.27, 0.23), 0.6, 4)
    textures.save_radiance(folder, "day_sky", day)
    scene = Scene(
        "pool", "Sunlight through waves onto tiles, and off the waves onto a wall.", digits=4
    )
    mosaic = scene.plastic("Mosaic", Texture("mosaic.jpg", (1.5625, 1.5625)), 0.25)
    stucco = scene.matte("Stucco", Texture("stucco.jpg", (0.4, 0.4)))
    cream = scene.matte("Cream", (0.80, 0.74, 0.62))
    stone = scene.plastic("Stone", Texture("deck.jpg", (1.3, 1.3)), 0.6)
    wet = scene.glass("Water", 1.333)
    steel = scene.metal("Steel", (0.76, 0.77, 0.78), 0.08)
    red = scene.plastic("Red", (0.72, 0.06, 0.05), 0.25)
    white = scene.plastic("White", (0.80, 0.80, 0.78), 0.25)
    terracotta = scene.matte("Terracotta", (0.55, 0.22, 0.11))
    leaf = scene.plastic("Leaf", (0.16, 0.28, 0.17), 0.4)

    scene.mesh("Basin", basin(), mosaic)
    scene.mesh("Water", water(), wet)
    steps = merged(
        [
            box((0.9, 0.28, 0.34 * (4 - i)), 0.015, 1).moved(
                0, -DEPTH + 0.14 + 0.28 * i, 0.17 * (4 - i)
            )
            for i in range(4)
        ]
    )
    scene.mesh("Steps", steps, mosaic, placed((-WIDTH / 2 + 0.452, 0, -LENGTH / 2 + 0.001)))
    ring = coping()
    half = np.sqrt(0.5)
    turns = np.array([(1, 0, 0, 0), (half, 0, half, 0), (1, 0, 0, 0)])[ring[:, 2].astype(int)]
    slab = box((0.452, 0.07, 0.40), 0.012, 2).moved(0, -0.025, 0)
    corner = box((0.40, 0.07, 0.40), 0.012, 2).moved(0, -0.025, 0)
    at = np.column_stack([ring[:, 0], np.zeros(len(ring)), ring[:, 1]])
    scene.scatter("Coping", [(slab, stone), (corner, stone)], at, ring[:, 2] == 2, turns)
    w, d, far = WIDTH / 2 + 0.385, LENGTH / 2 + 0.385, 3.4
    deck = [
        quad((-far, 0, -d), (far, 0, -d), (far, 0, -far), (-far, 0, -far)),
        quad((-far, 0, far + 3), (far, 0, far + 3), (far, 0, d), (-far, 0, d)),
        quad((-far, 0, d), (-w, 0, d), (-w, 0, -d), (-far, 0, -d)),
        quad((w, 0, d), (far, 0, d), (far, 0, -d), (w, 0, -d)),
    ]
    scene.mesh("Deck", merged(deck), stone)
    scene.mesh("BackWall", box((7.0, 2.9, 0.2)).moved(0.1, 1.45, -far - 0.1), stucco)
    scene.mesh("SideWall", box((0.2, 2.2, 7.0)).moved(-far - 0.1, 1.1, 0.1), cream)
    beams = np.column_stack(
        [np.linspace(-3.1, 3.1, 15), np.full(15, 2.35), np.full(15, -far + 0.62)]
    )
    scene.scatter("Pergola", [(box((0.07, 0.16, 1.4), 0.006, 1), cream)], beams)
    scene.mesh("Bench", box((2.2, 0.09, 0.5), 0.012, 2), cream, placed((0.9, 0.42, -far + 0.27)))
    feet = merged([box((0.12, 0.38, 0.42), 0.01, 1).moved(x, 0.19, 0) for x in (-0.8, 0.8)])
    scene.mesh("BenchFeet", feet, stone, placed((0.9, 0, -far + 0.27)))
    scene.mesh("Ladder", ladder(), steel, placed((WIDTH / 2 - 0.06, 0, -0.75), rotation("y", 90)))
    scene.group("Float", placed((0.42, LEVEL + 0.035, -0.55), rotation("x", 5) @ rotation("z", -4)))
    scene.mesh("Float/Red", float_ring(0), red)
    scene.mesh("Float/White", float_ring(1), white)
    rng = np.random.default_rng(2)
    for i, (x, z, size) in enumerate([(-2.75, -2.85, 1.25), (2.75, -2.75, 1.0)]):
        plant = scene.group(f"Plant{i}", placed((x, 0, z), np.eye(3) * size))
        scene.mesh(f"{plant}/Pot", pot(), terracotta)
        scene.group(f"{plant}/Agave", placed((0, 0.36, 0)))
        position, turn, scale = agave(rng)
        scene.scatter(f"{plant}/Agave/Leaves", [(agave_leaf(), leaf)], position, None, turn, scale)

    scene.sun((0.42, 0.86, 0.50), (3.6, 3.35, 2.9))
    scene.dome((0.9, 0.9, 0.9), "day_sky.exr", 40)
    scene.camera((1.1, 2.1, 3.45), (-0.12, -0.12, -0.95), lens=28)
    return scene
