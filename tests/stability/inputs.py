"""Input that cannot be rendered: an error that names the object, or a warning and a picture."""

from __future__ import annotations

import numpy as np

import segue
from case import Rows, case, exact
from stage import DIFFUSE, Stage

GROUP = "Input"
#: Name of the object that cannot be rendered.
CULPRIT = "culprit"
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
TRIANGLES = [0, 1, 2, 0, 2, 3]


def spoilt(value: float) -> np.ndarray:
    """The square with one coordinate replaced."""
    points = SQUARE.copy()
    points[2, 1] = value
    return points


def nan_light(s: Stage) -> None:
    """A lamp of radiance that is no number."""
    s.light("rect", radiance=[1, float("nan"), 1])


def negative_light(s: Stage) -> None:
    """A lamp of negative radiance."""
    s.light("rect", radiance=[-1, 1, 1])


def infinite_light(s: Stage) -> None:
    """A lamp of infinite radiance."""
    s.light("rect", radiance=[1e300, 1, 1])


def nan_points(s: Stage) -> None:
    """A vertex that is no number."""
    s.mesh(spoilt(np.nan), TRIANGLES, DIFFUSE)


def infinite_points(s: Stage) -> None:
    """A vertex at infinity."""
    s.mesh(spoilt(np.inf), TRIANGLES, DIFFUSE)


def huge_points(s: Stage) -> None:
    """A vertex at the end of the range of single precision."""
    s.mesh(spoilt(3e38), TRIANGLES, DIFFUSE)


def denormal_points(s: Stage) -> None:
    """A triangle of denormal size."""
    s.mesh(SQUARE * 1e-42, TRIANGLES, DIFFUSE)


def wrong_index(s: Stage) -> None:
    """An index beyond the vertices."""
    s.mesh(SQUARE, [0, 1, 9], DIFFUSE)


def singular(s: Stage) -> None:
    """A transform that flattens everything."""
    s.mesh(SQUARE, TRIANGLES, DIFFUSE, np.diag([1.0, 0.0, 0.0, 1.0]))


def nan_transform(s: Stage) -> None:
    """A transform that is no number."""
    s.mesh(SQUARE, TRIANGLES, DIFFUSE, np.full((4, 4), np.nan))


def bright_albedo(s: Stage) -> None:
    """An albedo above one."""
    s.mesh(SQUARE, TRIANGLES, {"type": "diffuse", "color": 1.7})


def nan_albedo(s: Stage) -> None:
    """An albedo that is no number."""
    s.mesh(SQUARE, TRIANGLES, {"type": "diffuse", "color": float("nan")})


def nan_texture(s: Stage) -> None:
    """A texture with values that are no numbers, infinite and negative."""
    pixels = np.array([[0.5, np.nan], [np.inf, -1.0]], np.float32)
    image = s.scene.add_image(CULPRIT, pixels, "linear")
    texture = s.scene.add_texture(CULPRIT, {"type": "image", "image": image})
    uvs = segue.Attribute("st", SQUARE[:, :2] * 0.5 + 0.5, "vertex")
    mesh = s.scene.add_mesh(CULPRIT, SQUARE, TRIANGLES, attributes=[uvs])
    s.scene.add_instances(
        CULPRIT,
        mesh,
        np.eye(4),
        [s.material({"type": "diffuse", "color": {"texture": texture}})],
    )


def nan_dome(s: Stage) -> None:
    """A dome with texels that are no numbers and infinite."""
    pixels = np.ones((8, 16, 3), np.float32)
    pixels[2, 3] = np.nan
    pixels[3, 3] = np.inf
    s.light("dome", radiance=[1, 1, 1], image=s.scene.add_image(CULPRIT, pixels, "linear"))


def zero_area(s: Stage) -> None:
    """A lamp without area."""
    s.light("rect", radiance=[1, 1, 1], width=0.0)


def glowing_point(s: Stage) -> None:
    """A glowing triangle without area."""
    s.mesh(SQUARE * 0, TRIANGLES, {"type": "emission", "strength": 5.0})


INPUTS = (
    nan_light,
    negative_light,
    infinite_light,
    nan_points,
    infinite_points,
    huge_points,
    denormal_points,
    wrong_index,
    singular,
    nan_transform,
    bright_albedo,
    nan_albedo,
    nan_texture,
    nan_dome,
    zero_area,
    glowing_point,
)


@case(
    GROUP, "0 for an error that names the object or a warning, with no sample refused; 1 otherwise"
)
def bad_input(full: bool) -> Rows:
    """Numbers that are none, infinite, negative, out of range or too large."""
    del full
    for spoil in INPUTS:
        s = Stage()
        s.floor(1.0, DIFFUSE, -0.5)
        s.light("dome", radiance=[0.5, 0.5, 0.5])
        s.camera([0, -2, 2], [0, 0, 0], 0.4)
        name = (spoil.__doc__ or "").strip().rstrip(".")
        s.name = CULPRIT
        try:
            spoil(s)
            picture, stats = s.render(16, 4)
        except segue.SegueError as error:
            names = CULPRIT in str(error)
            yield exact(f"{name}: error", 0.0, 0.0 if names else 1.0)
            continue
        sound = np.isfinite(picture).all() and stats["non_finite"] == stats["dropped"] == 0
        # what is too small to be seen may go without a word
        told = bool(stats["warnings"]) or spoil is denormal_points
        yield exact(
            f"{name}: {'warning' if stats['warnings'] else 'a sound picture'}",
            0.0,
            0.0 if sound and told else 1.0,
        )
