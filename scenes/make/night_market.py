"""A market lane at night under some six hundred small lights, most hidden from any one spot."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import textures
from .mesh import Array, Mesh, merged, polygon_mesh, rotation
from .shapes import ball, box, curve, lathe, loft, quad, tube
from .stage import Scene, Texture, placed

HALF = 3.1
"""Half the width between the house fronts; the lane runs along -z, the camera stands at z > 0."""


def cable(start: Array, end: Array, sag: float, count: int) -> Array:
    """Points evenly along a hanging cable."""
    t = np.linspace(0, 1, count)[:, None]
    points = (1 - t) * start + t * end
    points[:, 1] -= sag * 4 * t[:, 0] * (1 - t[:, 0])
    return points


def awning(width: float, stripe: int) -> Mesh:
    """Every other strip of a sagging striped awning with a scalloped hem."""
    strips = 9
    step = width / strips
    parts = []
    for i in range(stripe, strips, 2):
        x = -width / 2 + step * (i + np.linspace(0, 1, 6))
        t = np.linspace(0, 1, 9)
        roof = np.stack([0.95 * t - 0.2, 2.35 - 0.42 * t - 0.10 * np.sin(np.pi * t)], axis=1)
        hem = 0.16 - 0.045 * np.abs(np.linspace(-1, 1, 6)) ** 2
        rows = [[(a, y, z) for a in x] for z, y in roof]
        rows.append(
            [(a, roof[-1, 1] - h, roof[-1, 0] + 0.012) for a, h in zip(x, hem, strict=True)]
        )
        parts.append(loft(np.array(rows), wrap_columns=False).flipped())
    return merged(parts).smooth(35)


def stall_frame(width: float) -> Mesh:
    """Posts, counter, back boards and a shelf of a stall; its front is +z."""
    parts = [
        box((0.06, 2.35 - 0.37 * (z > 0), 0.06), 0.006, 1).moved(x, 1.175 - 0.185 * (z > 0), z)
        for x in (-width / 2 + 0.05, width / 2 - 0.05)
        for z in (-0.18, 0.66)
    ]
    parts.append(box((width, 0.05, 0.78), 0.008, 1).moved(0, 0.86, 0.28))
    parts += [
        box((width / 6 - 0.012, 0.82, 0.022), 0.004, 1).moved((i - 2.5) * width / 6, 0.43, 0.63)
        for i in range(6)
    ]
    parts.append(box((width, 0.03, 0.24), 0.005, 1).moved(0, 1.38, -0.12))
    parts.append(box((width, 1.0, 0.02)).moved(0, 1.25, -0.24))
    return merged(parts)


def crate() -> Mesh:
    """An open crate of boards, tilted to show what is in it."""
    w, d, h = 0.40, 0.52, 0.15
    parts = [box((w, 0.012, d)).moved(0, 0.006, 0)]
    parts += [box((0.012, h, d)).moved(s * w / 2, h / 2, 0) for s in (-1, 1)]
    parts += [box((w, h, 0.012)).moved(0, h / 2, s * d / 2) for s in (-1, 1)]
    return merged(parts).turned("x", 16)


def heap(rng: np.random.Generator, radius: float) -> Array:
    """Places of fruit piled in a crate, in the crate's tilted frame."""
    places = []
    for layer, (nx, nz) in enumerate(((5, 7), (4, 6))):
        for i in range(nx):
            for j in range(nz):
                jitter = rng.normal(0, 0.006, 3)
                x, z = (i - (nx - 1) / 2) * 2.05 * radius, (j - (nz - 1) / 2) * 2.0 * radius
                places.append(np.array([x, 0.10 + 1.45 * radius * layer, z]) + jitter)
    return np.array(places) @ rotation("x", 16).T


def barrel() -> tuple[Mesh, Mesh]:
    """A barrel and its hoops."""
    side = curve([(0.21, 0.0), (0.255, 0.2), (0.268, 0.36), (0.255, 0.52), (0.21, 0.72)], 4)
    body = lathe(np.concatenate([[(0, 0.02), (0.19, 0.02)], side, [(0.19, 0.70), (0, 0.70)]]), 32)
    hoops = [
        lathe(
            [(r, y - 0.02), (r + 0.007, y - 0.02), (r + 0.007, y + 0.02), (r, y + 0.02)],
            32,
            ring=True,
        )
        for y, r in ((0.06, 0.222), (0.2, 0.256), (0.52, 0.256), (0.66, 0.222))
    ]
    return body, merged(hoops)


def house(width: float, height: float, rng: np.random.Generator) -> tuple[Mesh, Mesh, Array]:
    """A house front facing +x: (wall with gable, trim, centres of windows)."""
    gable = height + 0.55 * width
    outline = np.array(
        [(-width / 2, 0), (width / 2, 0), (width / 2, height), (0, gable), (-width / 2, height)]
    )
    front = np.column_stack([np.zeros(5), outline[:, 1], -outline[:, 0]])
    back = front - [4.0, 0, 0]
    sides = [[i, i + 5, (i + 1) % 5 + 5, (i + 1) % 5] for i in range(5)]
    points = np.concatenate([front, back])
    faces = [list(range(5)), *sides]
    wall = polygon_mesh(points, faces, points[:, [2, 1]])
    windows, trim = [], []
    for y in np.arange(1.9 + 0.5 * rng.random(), height - 0.3, 1.55):
        for z in (-width / 4, width / 4):
            windows.append((0.012, y, z))
            trim += [box((0.05, 0.055, 0.80)).moved(0.02, y + s * 0.53, z) for s in (-1, 1)]
            trim += [box((0.05, 1.05, 0.05)).moved(0.02, y, z + s * 0.36) for s in (-1, 0, 1)]
            trim += [box((0.035, 1.06, 0.32)).moved(0.02, y, z + s * 0.57) for s in (-1, 1)]
    trim.append(box((0.12, 0.12, width)).moved(0.03, height - 0.02, 0))
    return wall, merged(trim), np.array(windows)


def cobbles(size: int) -> tuple[Array, Array]:
    """Wet paving: colour, and roughness that is low where water stands."""
    y, x = np.mgrid[0:size, 0:size] / size
    row = (y * 16).astype(int)
    across = x * 10 + 0.5 * (row % 2)
    rng = np.random.default_rng(71)
    tone = rng.normal(1, 0.16, (16, 11))[row, (across.astype(int)) % 10]
    edge = np.minimum(
        np.minimum(across % 1, 1 - across % 1) * 1.6, np.minimum(y * 16 % 1, 1 - y * 16 % 1)
    )
    stone = np.clip(edge / 0.16, 0, 1)
    colour = (
        np.array([0.36, 0.34, 0.34])
        * (tone * (0.45 + 0.55 * stone) * (1 + 0.05 * textures.noise((size, size), 72, 0.6)))[
            ..., None
        ]
    )
    puddle = np.clip(0.5 + 1.1 * textures.noise((size, size), 73, 1.9), 0, 1)
    rough = np.clip(0.13 + 0.30 * puddle + 0.10 * (1 - stone) * puddle, 0.1, 0.6)
    return colour * (0.75 + 0.25 * puddle[..., None]), rough


def build(folder: Path) -> Scene:
    """The scene; its textures go into the folder."""
    colour, rough = cobbles(512)
    textures.save_colour(folder, "cobbles", colour)
    textures.save_data(folder, "cobbles_rough", np.round(rough * 32) / 32)
    textures.save_colour(folder, "render", textures.plaster(256, (0.72, 0.66, 0.58), 0.07, 75))
    scene = Scene(
        "night_market", "A lane lit by hundreds of bulbs, lanterns and windows.", digits=4
    )
    paving = scene.plastic(
        "Paving",
        Texture("cobbles.jpg", (0.5, 0.5)),
        Texture("cobbles_rough.png", (0.25, 0.25), False),
    )
    fronts = [scene.matte("Front0", Texture("render.jpg", (0.3, 0.3)))]
    fronts += [
        scene.matte(f"Front{i}", c)
        for i, c in ((1, (0.46, 0.20, 0.13)), (2, (0.20, 0.29, 0.33)), (3, (0.55, 0.42, 0.20)))
    ]
    timber = scene.plastic("Timber", (0.15, 0.085, 0.05), 0.45)
    pine = scene.matte("Pine", (0.46, 0.30, 0.16))
    iron = scene.metal("Iron", (0.32, 0.31, 0.30), 0.4)
    cream = scene.matte("Cream", (0.76, 0.68, 0.54))
    cloths = [
        scene.matte(f"Cloth{i}", c)
        for i, c in enumerate(((0.52, 0.05, 0.045), (0.05, 0.22, 0.22), (0.62, 0.30, 0.04)))
    ]
    fruits = [
        scene.plastic(f"Fruit{i}", c, 0.3)
        for i, c in enumerate(((0.75, 0.26, 0.02), (0.50, 0.03, 0.03), (0.30, 0.42, 0.05)))
    ]
    rope = scene.matte("Rope", (0.03, 0.03, 0.03))
    bulb = scene.glow("Bulb", (190, 112, 48))
    panes = [
        scene.glow("WindowWarm", (1.1, 0.62, 0.25)),
        scene.glow("WindowDim", (0.25, 0.13, 0.05)),
    ]

    scene.mesh("Paving", quad((-HALF, 0, 7), (HALF, 0, 7), (HALF, 0, -22), (-HALF, 0, -22)), paving)
    rng = np.random.default_rng(5)
    windows: list[Array] = []
    turns: list[tuple[float, float, float, float]] = []
    for side in (-1, 1):
        z = 6.0
        for i in range(8):
            width = rng.uniform(2.7, 4.0)
            wall, trim, centres = house(width, rng.uniform(3.4, 5.4), rng)
            turn = np.eye(3) if side < 0 else rotation("y", 180)
            at = np.array([side * HALF, 0, z - width / 2])
            node = scene.group(f"House{'LR'[side > 0]}{i}", placed(at, turn))
            scene.mesh(f"{node}/Wall", wall, fronts[(i + (side > 0) * 2 + i // 4) % 4])
            scene.mesh(f"{node}/Trim", trim, timber)
            windows.extend(centres @ turn.T + at)
            turns.extend([(1, 0, 0, 0) if side < 0 else (0, 0, 1, 0)] * len(centres))
            z -= width
    pane = quad((0, -0.5, 0.34), (0, -0.5, -0.34), (0, 0.5, -0.34), (0, 0.5, 0.34))
    lit = (rng.random(len(windows)) < 0.6).astype(int)
    scene.scatter("Windows", [(pane, panes[1]), (pane, panes[0])], windows, lit, turns)
    end = box((2.6, 7.5, 2.6)).moved(0, 3.75, -21.5)
    spire = lathe([(0, 7.5), (1.9, 7.5), (0, 12.5)], 4, crease=10)
    scene.mesh("Tower", end, fronts[2])
    scene.mesh("Spire", spire.turned("y", 45).moved(0, 0, -21.5), timber)

    width = 2.1
    frame = stall_frame(width)
    lights: list[tuple[Array, float, tuple[float, float, float]]] = []
    for side in (-1, 1):
        for i in range(5):
            turn = rotation("y", -90 * side)
            at = np.array([side * (HALF - 0.55), 0, 2.0 - 2.75 * i - 0.9 * (side > 0)])
            name = f"Stall{'LR'[side > 0]}{i}"
            if (side, i) == (-1, 0):
                scene.group(name, placed(at, turn))
                scene.mesh(f"{name}/Frame", frame, pine)
                scene.mesh(f"{name}/Cream", awning(width, 1), cream)
                scene.group(f"{name}/Goods")
                for k, x in enumerate((-0.72, -0.24, 0.24, 0.72)):
                    box_at = placed((x, 0.90, 0.36))
                    goods = scene.group(f"{name}/Goods/Crate{k}", box_at)
                    scene.mesh(f"{goods}/Boards", crate(), pine)
                    radius = 0.038
                    pile = heap(rng, radius)
                    kind = np.full(len(pile), (0, 2, 1, 0)[k])
                    pile_of = [(ball(radius, 16, 10), f) for f in fruits]
                    scene.scatter(f"{goods}/Fruit", pile_of, pile, kind)
            else:
                scene.copy(name, "/World/Geometry/StallL0", placed(at, turn))
            stripes = scene.group(f"Awning{'LR'[side > 0]}{i}", placed(at, turn))
            scene.mesh(f"{stripes}/Colour", awning(width, 0), cloths[(i + (side > 0)) % 3])
            for x in (-0.62, 0.0, 0.62):
                glow = (15.0, 8.6, 3.6) if x else (16.0, 7.2, 2.2)
                lights.append((at + turn @ np.array([x, 1.86, 0.42]), 0.055, glow))
    body, hoops = barrel()
    cask = scene.group("Barrel0", placed((-1.45, 0, 3.55)))
    scene.mesh(f"{cask}/Staves", body, timber)
    scene.mesh(f"{cask}/Hoops", hoops, iron)
    for i, (x, z) in enumerate([(-1.80, 3.98), (1.75, -0.75), (-1.6, -5.2), (1.7, -6.4)]):
        scene.copy(f"Barrel{i + 1}", "/World/Geometry/Barrel0", placed((x, 0, z)))

    bulbs: list[Array] = []
    cords: list[Mesh] = []
    posts = np.arange(4.5, -17.0, -1.15)
    for i, z in enumerate(posts):
        s = -1 if i % 2 else 1
        start = np.array([s * HALF, 3.35 + rng.uniform(-0.15, 0.25), z])
        stop = np.array([-s * HALF, 3.35 + rng.uniform(-0.15, 0.25), z - 1.15])
        line = cable(start, stop, 0.55 + rng.uniform(-0.1, 0.1), 24)
        bulbs.extend(line[1:-1] - [0, 0.045, 0])
        cords.append(tube(line[::2], 0.006, 4))
    scene.mesh("Cords", merged(cords), rope)
    socket = lathe([(0, 0.016), (0.009, 0.016), (0.011, 0.045), (0, 0.045)], 8)
    scene.scatter("Bulbs", [(ball(0.018, 8, 6), bulb)], bulbs)
    scene.scatter("Sockets", [(socket, rope)], bulbs)
    hues = [(11.0, 1.7, 0.7), (11.0, 5.0, 1.2), (8.5, 6.6, 3.6)]
    for i, z in enumerate(np.arange(3.4, -16.0, -1.9)):
        line = cable(np.array([-HALF, 2.95, z]), np.array([HALF, 2.95, z - 0.4]), 0.30, 11)[1:-1]
        for k, at in enumerate(line):
            lights.append((at, 0.075, hues[(i + k) % 3]))
    for i, (at, radius, radiance) in enumerate(lights):
        scene.sphere_light(f"Lantern{i:03d}", at, radius, radiance)
    scene.dome((0.010, 0.018, 0.045))
    scene.camera((0.35, 1.75, 6.6), (-0.12, 1.62, -4.0), lens=27)
    return scene
