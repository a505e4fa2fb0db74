"""A scene that records what it is given, with the same checks of its arguments as the real one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from segue import Attribute
from segue._values import array, to_json


@dataclass
class RecordedMesh:
    """The arguments of one `add_mesh`."""

    name: str
    points: np.ndarray
    face_indices: np.ndarray
    face_counts: np.ndarray
    normals: np.ndarray | None
    normal_interpolation: str
    face_slots: np.ndarray | None
    holes: np.ndarray | None
    left_handed: bool
    attributes: dict[str, Attribute]


@dataclass
class RecordedInstances:
    """The arguments of one `add_instances`."""

    name: str
    mesh: RecordedMesh
    transforms: np.ndarray
    materials: list[dict]
    two_sided_emission: bool


@dataclass
class RecordingScene:
    """Stands in for `segue.Scene` where only what an importer says matters."""

    meshes: list[RecordedMesh] = field(default_factory=list)
    images: list[tuple] = field(default_factory=list)
    textures: list[dict] = field(default_factory=list)
    materials: list[dict] = field(default_factory=list)
    lights: dict[str, dict] = field(default_factory=dict)
    instances: list[RecordedInstances] = field(default_factory=list)
    camera: dict | None = None

    def add_mesh(
        self,
        name,
        points,
        face_indices,
        face_counts=None,
        normals=None,
        normal_interpolation="vertex",
        face_slots=None,
        holes=None,
        left_handed=False,
        attributes=(),
    ):
        points = array(points, np.float32, (-1, 3), name)
        corners = array(face_indices, np.uint32, (-1,), name)
        counts = array(face_counts, np.uint32, (-1,), name)
        elements = {
            "constant": 1,
            "face": len(counts),
            "vertex": len(points),
            "corner": len(corners),
        }
        assert counts.sum() == len(corners)
        assert not len(corners) or corners.max() < len(points)
        if normals is not None:
            assert (
                array(normals, np.float32, (-1, 3), name).shape[0]
                == (elements[normal_interpolation])
            )
        for a in attributes:
            n = len(a.data) if a.indices is None else len(a.indices)
            assert n == elements[a.interpolation], (name, a.name)
        self.meshes.append(
            RecordedMesh(
                name,
                points,
                corners,
                counts,
                normals,
                normal_interpolation,
                face_slots,
                holes,
                left_handed,
                {a.name: a for a in attributes},
            )
        )
        return len(self.meshes) - 1

    def add_image(self, name, pixels, colorspace="srgb"):
        self.images.append((name, np.asarray(pixels), colorspace))
        return len(self.images) - 1

    def add_texture(self, name, texture):
        to_json(texture, name)
        assert texture.get("image", 0) < max(len(self.images), 1)
        self.textures.append(dict(texture))
        return len(self.textures) - 1

    def add_material(self, name, material):
        to_json(material, name)
        self.materials.append(dict(material, name=name))
        return len(self.materials) - 1

    def add_light(self, name, light):
        to_json(light, name)
        assert name not in self.lights
        self.lights[name] = dict(light)
        return len(self.lights) - 1

    def set_camera(self, name, camera):
        to_json(camera, name)
        self.camera = dict(camera, name=name)

    def add_instances(
        self,
        name,
        mesh,
        transforms,
        materials=(),
        camera_visible=True,
        two_sided_emission=True,
        object_index=0,
    ):
        transforms = array(transforms, np.float64, (-1, 4, 4), name)
        self.instances.append(
            RecordedInstances(
                name,
                self.meshes[mesh],
                transforms,
                [self.materials[m] for m in materials],
                two_sided_emission,
            )
        )
