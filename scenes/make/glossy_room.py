"""A clockwork hall of rough metals, lacquer and polished stone: each shows all the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import textures
from .mesh import Array, Mesh, merged
from .shapes import arc, ball, box, curve, gear_outline, lathe, plate_ring, quad, tube
from .stage import Scene, Texture, placed

WIDE, BACK, FRONT, TOP = 3.1, -2.2, 4.4, 3.3
"""The hall: x within +-WIDE, z from BACK to FRONT, y up to TOP."""

MODULE = 0.034
"""Pitch diameter over number of teeth, metres: gears that mesh share it."""


def gear(teeth: int, thick: float, spokes: int, phase: float) -> Mesh:
    """A spoked gear about the z axis; `phase` is its turn in teeth."""
    pitch = MODULE * teeth / 2
    outer = gear_outline(teeth, pitch - 1.1 * MODULE, pitch + 0.9 * MODULE)
    rim = pitch - 3.2 * MODULE
    # A circle point under each corner of the outline, so that the skin between them does not twist.
    turn = np.arctan2(outer[:, 1], outer[:, 0])
    circle = rim * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    hub_hole = arc((0, 0), 0.03, 0, 360, 32)[:-1]
    hub = arc((0, 0), 0.03 + 0.16 * pitch, 0, 360, 32)[:-1]
    parts = [plate_ring(outer, circle, thick, 0.004), plate_ring(hub, hub_hole, thick * 1.7, 0.006)]
    reach = rim - 0.03 - 0.1 * pitch
    bar = box((reach, 0.11 * pitch + 0.02, thick * 0.6), 0.006, 1).moved(
        0.03 + 0.1 * pitch + reach / 2, 0, 0
    )
    parts += [bar.turned("z", 360 * (i + 0.5) / spokes) for i in range(spokes)]
    # Flat faces and chamfers: shading normals would only double the points.
    return merged(parts).faceted().turned("z", 360 * phase / teeth)


def meshing(teeth: int, at: Array, phase: float, other: int, angle: float) -> tuple[Array, float]:
    """Place and phase of a gear of `other` teeth that meshes with the one at `at`.

    `angle` is the direction from one to the other, in degrees.
    """
    distance = MODULE * (teeth + other) / 2
    place = at + distance * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    # Teeth of one meet gaps of the other on the line between the centres.
    along = teeth * angle / 360 - phase
    return place, (other * (angle + 180) / 360 + along - 0.5) % 1.0


def knot(p: int, q: int) -> Mesh:
    """A (p, q) torus knot of a thick rod; its two ends meet inside a collar."""
    t = np.linspace(0, 2 * np.pi, 145)
    radius = 0.155 + 0.062 * np.cos(q * t)
    path = np.stack([radius * np.cos(p * t), 0.075 * np.sin(q * t), radius * np.sin(p * t)], axis=1)
    return tube(path, 0.033, 12)


def column() -> Mesh:
    """A fluted column from floor to ceiling."""
    profile = [(0, 0), (0.20, 0), (0.20, 0.3), (0.20, TOP - 0.3), (0.20, TOP), (0, TOP)]
    return lathe(profile, 128, lambda a, h: 1 - 0.05 * np.abs(np.sin(8 * a)) ** 0.7, crease=50)


def collar() -> Mesh:
    """The brass base of a column."""
    profile = curve([(0.22, 0.16), (0.24, 0.12), (0.235, 0.09), (0.27, 0.05), (0.27, 0.0)], 5)[::-1]
    return lathe(np.concatenate([[(0, 0)], profile, [(0, 0.16)]]), 64)


def pendulum() -> Mesh:
    """A rod with a heavy lens-shaped bob, hanging from the origin."""
    lens = arc((0, 0), 0.20, -90, 90, 16) * np.array([1.0, 0.22])
    lens[[0, -1], 0] = 0.0
    bob = lathe(lens, 64, crease=80).turned("x", 90).moved(0, -0.92, 0)
    return merged([tube([(0, 0, 0), (0, -0.5, 0), (0, -0.94, 0)], 0.011, 12), bob])


def cabinet() -> tuple[Mesh, Mesh]:
    """A lacquered cabinet with rounded corners, and its brass feet, edges and knobs."""
    body = box((0.95, 0.62, 0.42), 0.05, 4).moved(0, 0.46, 0)
    trim = [box((0.97, 0.014, 0.44), 0.05 / 8, 1).moved(0, y, 0) for y in (0.30, 0.62)]
    foot = lathe([(0, 0), (0.012, 0), (0.026, 0.15), (0, 0.16)], 24)
    trim += [foot.moved(x, 0, z) for x in (-0.38, 0.38) for z in (-0.14, 0.14)]
    trim += [ball(0.018, 12, 8).moved(x, 0.46, 0.222) for x in (-0.05, 0.05)]
    return body, merged(trim)


def build(folder: Path) -> Scene:
    """The scene; its textures go into the folder."""
    pale = textures.marble(768, [(0, (0.80, 0.78, 0.74)), (1, (0.42, 0.40, 0.38))], 61)
    dark = textures.marble(768, [(0, (0.085, 0.09, 0.095)), (1, (0.52, 0.48, 0.40))], 67)
    textures.save_colour(folder, "chequers", textures.checker(768, pale, dark, 4))
    scene = Scene(
        "glossy_room", "Rough metals, lacquer and a polished floor under strip lights.", digits=4
    )
    stone = scene.plastic("Stone", Texture("chequers.jpg", (0.5, 0.5)), 0.16)
    green = scene.plastic("GreenLacquer", (0.018, 0.085, 0.065), 0.14)
    red = scene.plastic("RedLacquer", (0.50, 0.025, 0.02), 0.1)
    ebony = scene.plastic("Ebony", (0.02, 0.018, 0.018), 0.12)
    plaster = scene.matte("Plaster", (0.62, 0.58, 0.52))
    brass = scene.metal("Brass", (0.90, 0.69, 0.36), 0.24)
    copper = scene.metal("Copper", (0.91, 0.50, 0.34), 0.30)
    steel = scene.metal("Steel", (0.62, 0.64, 0.67), 0.20)
    polished = scene.metal("PolishedBrass", (0.93, 0.74, 0.42), 0.08)

    scene.mesh(
        "Floor", quad((-WIDE, 0, FRONT), (WIDE, 0, FRONT), (WIDE, 0, BACK), (-WIDE, 0, BACK)), stone
    )
    shell = [
        quad((-WIDE, 0, FRONT), (-WIDE, 0, BACK), (-WIDE, TOP, BACK), (-WIDE, TOP, FRONT)),
        quad((WIDE, 0, BACK), (WIDE, 0, FRONT), (WIDE, TOP, FRONT), (WIDE, TOP, BACK)),
        quad((WIDE, 0, FRONT), (-WIDE, 0, FRONT), (-WIDE, TOP, FRONT), (WIDE, TOP, FRONT)),
        quad((-WIDE, TOP, BACK), (WIDE, TOP, BACK), (WIDE, TOP, FRONT), (-WIDE, TOP, FRONT)),
        quad((-WIDE, 0, BACK), (WIDE, 0, BACK), (WIDE, TOP, BACK), (-WIDE, TOP, BACK)),
    ]
    scene.mesh("Shell", merged(shell), plaster)
    across = np.arange(-3, 4) * 0.88
    panels = [(x, y, BACK + 0.02) for x in across for y in (0.84, 2.46)]
    scene.scatter("Panels", [(box((0.84, 1.56, 0.05), 0.018, 3), green)], panels)
    strips = [(x, TOP / 2, BACK + 0.01) for x in np.arange(-3.5, 4.0) * 0.88]
    scene.scatter("Strips", [(box((0.022, TOP, 0.04), 0.005, 1), polished)], strips)
    scene.mesh(
        "Rail", box((2 * WIDE, 0.03, 0.05), 0.006, 1), polished, placed((0, 1.65, BACK + 0.01))
    )

    z = BACK + 0.22
    first, at = 50, np.array([0.12, 1.72])
    second_at, second_phase = meshing(first, at, 0.0, 24, 152)
    third_at, third_phase = meshing(24, second_at, second_phase, 34, 236)
    fourth_at, fourth_phase = meshing(first, at, 0.0, 18, 28)
    fifth_at, fifth_phase = meshing(18, fourth_at, fourth_phase, 30, -52)
    train = [
        (first, at, 0.0, 6, brass, 0.07),
        (24, second_at, second_phase, 5, copper, 0.06),
        (34, third_at, third_phase, 5, steel, 0.05),
        (18, fourth_at, fourth_phase, 4, steel, 0.06),
        (30, fifth_at, fifth_phase, 5, copper, 0.05),
    ]
    for i, (teeth, place, phase, spokes, metal, thick) in enumerate(train):
        scene.mesh(f"Gear{i}", gear(teeth, thick, spokes, phase), metal, placed((*place, z)))
    axle = lathe([(0, -0.2), (0.028, -0.2), (0.028, 0.07), (0.022, 0.08), (0, 0.08)], 24).turned(
        "x", 90
    )
    scene.scatter("Axles", [(axle, polished)], [(*place, z) for _, place, *_ in train])
    scene.mesh("Pendulum", pendulum(), polished, placed((0.12, 1.72, z + 0.13)))

    for side, x in (("L", -2.55), ("R", 2.55)):
        scene.group(f"Column{side}", placed((x, 0, -1.35)))
    scene.mesh("ColumnL/Shaft", column(), ebony)
    scene.mesh("ColumnL/Base", collar(), polished)
    scene.copy("ColumnR", "/World/Geometry/ColumnL", placed((2.55, 0, -1.35)))
    body, trim = cabinet()
    scene.group("Cabinet", placed((-1.62, 0, -1.15)))
    scene.mesh("Cabinet/Body", body, red)
    scene.mesh("Cabinet/Trim", trim, polished)
    scene.mesh("Knot", knot(2, 3), copper, placed((-1.62, 0.88, -1.15)))
    scene.mesh("Plinth", box((0.46, 0.62, 0.46), 0.02, 3), ebony, placed((1.62, 0.31, -0.85)))
    scene.mesh("GlobeSteel", ball(0.23, 48, 24), steel, placed((1.62, 0.85, -0.85)))
    scene.mesh("GlobeRed", ball(0.20, 48, 24), red, placed((0.92, 0.20, -0.30)))
    scene.mesh("GlobeBrass", ball(0.12, 40, 20), polished, placed((0.52, 0.12, 0.10)))

    for i, x in enumerate((-1.5, 0.0, 1.5)):
        scene.rect_light(
            f"Strip{i}", (x, TOP - 0.02, 0.2), (x, 0, 0.2), (0.16, 3.0), (38, 30.5, 22)
        )
    scene.rect_light(
        "Window", (-WIDE + 0.03, 1.7, 0.9), (0, 1.7, 0.9), (1.3, 2.3), (6.0, 8.0, 11.0)
    )
    scene.camera((-0.25, 1.02, 3.55), (0.05, 1.22, -2.0), lens=29)
    return scene
