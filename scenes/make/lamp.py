"""A lamp whose glowing bead is shut in a bulb in a ribbed globe: no straight line leads to it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import textures
from .mesh import Array, Mesh, merged, rotation
from .shapes import arc, ball, box, curve, lathe, loft, quad, torus, tube
from .stage import Scene, Texture, placed

GLOBE_Y = 0.262
"""Height of the globe's centre above the table."""

WALNUT = [
    (0.0, (0.16, 0.085, 0.05)),
    (0.5, (0.34, 0.20, 0.12)),
    (1.0, (0.50, 0.32, 0.20)),
]


def globe() -> Mesh:
    """The shade: a globe, ribbed outside and smooth inside, open where the fitting holds it."""
    radius, wall, neck, ribs = 0.092, 0.0045, 0.034, 20
    low = -np.degrees(np.arccos(neck / radius))
    outside = arc((0, GLOBE_Y), radius, low, 90, 24)
    outside[-1, 0] = 0.0
    foot = GLOBE_Y - 0.102
    down = np.array([(neck, foot), (neck, foot + 0.008)])
    inner = radius - wall
    low = -np.degrees(np.arccos((neck - wall) / inner))
    inside = arc((0, GLOBE_Y), inner, 90, low, 15)
    inside[0, 0] = 0.0
    inside = np.concatenate(
        [inside, [(neck - wall, foot + 0.008), (neck - wall, foot), (neck, foot)]]
    )

    def ribbed(angle: Array, height: Array) -> Array:
        across = np.clip((height - GLOBE_Y) / radius, -1, 1)
        fade = np.clip(1 - across**2, 0, 1) * np.clip((height - foot - 0.012) / 0.01, 0, 1)
        return 1 + 0.022 * fade * np.cos(ribs * angle)

    turned = lathe(np.concatenate([down, outside]), ribs * 7, ribbed, crease=50)
    return merged([turned, lathe(inside, ribs * 7, crease=50)])


def bulb() -> Mesh:
    """A thin clear bulb around the bead, sunk in the socket below."""
    out = curve(
        [(0.014, -0.052), (0.016, -0.038), (0.030, -0.012), (0.033, 0.006), (0.022, 0.030)], 5
    )
    out = np.concatenate([out, curve([(0.022, 0.030), (0.011, 0.0375), (0.0, 0.039)], 4)[1:]])
    into = out[::-1] + np.array([-0.0012, 0.0])
    into[0] = (0.0, 0.0378)
    into[1:9, 1] -= np.linspace(0.0012, 0.0002, 8)
    profile = np.concatenate([out, np.maximum(into, [0.0, -1.0])])
    return lathe(profile, 48, crease=60, ring=True).moved(0, GLOBE_Y, 0)


def fitting() -> Mesh:
    """Foot, stem and cup of the lamp, with the socket that holds bulb and globe."""
    foot = GLOBE_Y - 0.102
    out = [(0, 0), (0.070, 0), (0.073, 0.004), (0.073, 0.010), (0.068, 0.014)]
    stem = curve(
        [(0.068, 0.014), (0.030, 0.022), (0.012, 0.048), (0.0105, 0.085), (0.014, 0.118)], 5
    )[1:]
    cup = curve([(0.014, 0.118), (0.026, 0.132), (0.040, foot - 0.004)], 5)[1:]
    lip = [(0.0415, foot + 0.002), (0.0395, foot + 0.004), (0.037, foot), (0.036, foot - 0.004)]
    socket = [(0.019, foot - 0.004), (0.019, foot + 0.056), (0.0, foot + 0.056)]
    return lathe(np.concatenate([out, stem, cup, lip, socket]), 56, crease=45)


def vanity_mirror(tilt: float) -> tuple[Mesh, Mesh]:
    """A round mirror in a frame on a stand: (silver, brass). It faces +z, `tilt` degrees up."""
    disc = lathe([(0, 0), (0.101, 0), (0.101, 0.004), (0, 0.004)], 72, crease=30).turned(
        "x", 90 - tilt
    )
    frame = torus(0.104, 0.0065, 72, 14).turned("x", 90 - tilt)
    foot = lathe(
        [
            (0, 0),
            (0.06, 0),
            (0.062, 0.004),
            (0.05, 0.010),
            (0.01, 0.018),
            (0.007, 0.03),
            (0.006, 0.06),
            (0, 0.06),
        ],
        56,
    )
    height = 0.06 + 0.108
    return disc.moved(0, height, 0), merged([frame.moved(0, height, 0.002), foot])


def book(width: float, depth: float, thick: float) -> tuple[Mesh, Mesh]:
    """A closed book lying flat, its spine towards +z: (cover, pages)."""
    board = 0.0028
    boards = [
        box((width, board, depth), 0.0009, 1).moved(0, y, 0) for y in (board / 2, thick - board / 2)
    ]
    spine = box((width, thick, board), 0.0009, 1).moved(0, thick / 2, depth / 2 - board / 2)
    pages = box((width - 0.008, thick - 2 * board, depth - 0.006)).moved(0, thick / 2, 0.001)
    return merged([*boards, spine]), pages


def pear() -> tuple[Mesh, Mesh]:
    """A pear and its stalk."""
    profile = curve(
        [
            (0, 0.004),
            (0.010, 0),
            (0.030, 0.011),
            (0.037, 0.031),
            (0.029, 0.055),
            (0.0185, 0.074),
            (0.012, 0.086),
            (0.003, 0.0895),
            (0, 0.0885),
        ],
        4,
    )
    body = lathe(np.maximum(profile, 0), 40, crease=80)
    lean = body.points.copy()
    lean[:, 0] += 0.010 * (lean[:, 1] / 0.09) ** 2
    body = Mesh(lean, body.counts, body.indices).smooth(80)
    return body, tube(
        curve([(0.0095, 0.087, 0), (0.011, 0.098, 0.001), (0.017, 0.107, 0.002)], 5), 0.0014, 8
    )


def flacon() -> Mesh:
    """A solid scent bottle: an eight-sided block with cut shoulders under a cut stopper."""
    angle = np.radians(np.arange(8) * 45 + 22.5)
    levels = [
        (0.0, 0.0),
        (0.026, 0.0),
        (0.030, 0.005),
        (0.030, 0.042),
        (0.014, 0.062),
        (0.0095, 0.066),
    ]
    levels += [(0.0095, 0.071), (0.019, 0.082), (0.015, 0.098), (0.0, 0.108)]
    rings = [
        np.stack([r * np.cos(angle), np.full(8, y), -r * np.sin(angle)], axis=1) for r, y in levels
    ]
    solid = loft(np.array(rings))
    return Mesh(solid.points, solid.counts, solid.indices)


def painting(size: int) -> Array:
    """An abstract picture: hills under a low sun."""
    y, x = np.mgrid[0:size, 0:size] / size
    image = textures.ramp(1 - y, [(0, (0.86, 0.60, 0.36)), (1, (0.93, 0.83, 0.66))])
    sun = np.hypot(x - 0.66, y - 0.36) < 0.13
    image[sun] = (0.80, 0.30, 0.17)
    hills = [
        (0.52, 0.09, 1.1, (0.62, 0.60, 0.46)),
        (0.66, 0.07, 1.7, (0.35, 0.45, 0.40)),
        (0.80, 0.05, 2.3, (0.16, 0.25, 0.29)),
    ]
    for base, swing, beat, colour in hills:
        image[y > base + swing * np.sin(beat * 2 * np.pi * x * 0.7 + 9 * base)] = colour
    return image * (1 + 0.035 * textures.noise((size, size), 77, 0.9))[..., None]


def build(folder: Path) -> Scene:
    """The scene; its textures go into the folder."""
    textures.save_colour(folder, "walnut", textures.planks(768, 4, WALNUT, 31))
    textures.save_colour(folder, "ochre", textures.plaster(256, (0.60, 0.55, 0.47), 0.05, 15))
    textures.save_colour(folder, "painting", painting(320))
    scene = Scene(
        "lamp", "A glowing bead in a bulb in a ribbed glass globe lights a corner of a room."
    )
    wood = scene.plastic("Wood", Texture("walnut.jpg", (1.4, 1.4)), 0.3)
    wall = scene.matte("Wall", Texture("ochre.jpg", (1.1, 1.1)))
    glass = scene.glass("Glass", 1.5)
    brass = scene.metal("Brass", (0.88, 0.66, 0.34), 0.2)
    silver = scene.metal("Silver", (0.94, 0.94, 0.93), 0.0)
    bead = scene.glow("Bead", (3300, 2100, 1080))
    paper = scene.matte("Paper", (0.78, 0.72, 0.60))
    cloth = [
        scene.plastic(n, c, 0.55)
        for n, c in (
            ("Green", (0.05, 0.14, 0.11)),
            ("Red", (0.34, 0.05, 0.045)),
            ("Blue", (0.07, 0.11, 0.19)),
        )
    ]
    green = scene.plastic("Pear", (0.42, 0.44, 0.10), 0.35)
    bark = scene.matte("Stalk", (0.13, 0.07, 0.04))
    canvas = scene.matte("Canvas", Texture("painting.jpg", (1 / 0.26, 1 / 0.26)))
    frame = scene.plastic("Frame", (0.05, 0.035, 0.03), 0.3)

    scene.mesh("Table", box((1.5, 0.03, 0.66), 0.006, 2).moved(0, -0.015, 0), wood)
    scene.mesh(
        "Wall",
        quad((-1.6, -0.8, -0.33), (1.6, -0.8, -0.33), (1.6, 1.4, -0.33), (-1.6, 1.4, -0.33)),
        wall,
    )
    scene.group("Lamp", placed((0.10, 0.0, -0.07)))
    scene.mesh("Lamp/Globe", globe(), glass)
    scene.mesh("Lamp/Bulb", bulb(), glass)
    scene.mesh("Lamp/Bead", ball(0.010, 24, 12).moved(0, GLOBE_Y, 0), bead)
    scene.mesh(
        "Lamp/Wire",
        tube(
            [(0, GLOBE_Y - 0.047, 0), (0, GLOBE_Y - 0.03, 0), (0, GLOBE_Y - 0.0095, 0)], 0.0016, 10
        ),
        brass,
    )
    scene.mesh("Lamp/Fitting", fitting(), brass)
    mirror = scene.group("Mirror", placed((-0.235, 0.0, -0.10), rotation("y", 46)))
    disc, metal = vanity_mirror(13.0)
    scene.mesh(f"{mirror}/Silver", disc, silver)
    scene.mesh(f"{mirror}/Brass", metal, brass)
    y = 0.0
    sizes = [(0.235, 0.165, 0.034), (0.21, 0.15, 0.026), (0.19, 0.135, 0.021)]
    for i, ((w, d, t), turn) in enumerate(zip(sizes, (-24, -14, -31), strict=True)):
        stack = scene.group(f"Book{i}", placed((0.365, y, -0.02), rotation("y", turn)))
        cover, pages = book(w, d, t)
        scene.mesh(f"{stack}/Cover", cover, cloth[i])
        scene.mesh(f"{stack}/Pages", pages, paper)
        y += t
    fruit = scene.group("Pear0", placed((0.365, y, -0.02), rotation("y", 30)))
    body, stalk = pear()
    scene.mesh(f"{fruit}/Body", body, green)
    scene.mesh(f"{fruit}/Stalk", stalk, bark)
    scene.copy("Pear1", f"/World/Geometry/{fruit}", placed((-0.035, 0, 0.115), rotation("y", 200)))
    scene.mesh("Flacon", flacon(), glass, placed((-0.125, 0.0002, 0.105), rotation("y", 12)))
    picture = scene.group("Picture", placed((0.37, 0.46, -0.325)))
    scene.mesh(
        f"{picture}/Canvas",
        quad((-0.13, -0.13, 0), (0.13, -0.13, 0), (0.13, 0.13, 0), (-0.13, 0.13, 0)),
        canvas,
    )
    bars = [box((0.29, 0.016, 0.02), 0.003, 1).moved(0, s * 0.137, 0.005) for s in (-1, 1)]
    bars += [box((0.016, 0.29, 0.02), 0.003, 1).moved(s * 0.137, 0, 0.005) for s in (-1, 1)]
    scene.mesh(f"{picture}/Frame", merged(bars), frame)

    scene.rect_light("Night", (-1.3, 0.9, 1.0), (0, 0.1, 0), (0.8, 1.2), (0.10, 0.17, 0.32))
    scene.camera(
        (0.02, 0.33, 1.12), (0.055, 0.205, -0.05), lens=44, f_stop=8.0, focus=(0.05, 0.2, 0.0)
    )
    return scene
