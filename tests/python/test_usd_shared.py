"""The shared scenes import without anything being dropped."""

from __future__ import annotations

import pytest

from recording import RecordingScene

pytest.importorskip("pxr")

from segue import usd

SCENES = {
    # name: meshes, lights, images
    "cornell-box": (7, 1, 0),
    "cornell-caustic": (6, 1, 0),
    "veach-mis": (6, 3, 0),
    "veach-ajar": (21, 1, 4),
    "staircase": (774, 1, 9),
    "living-room": (65, 1, 5),
    "bathroom": (855, 1, 8),
    "kitchen-ppg": (286, 2, 12),
    "lux-pool": (2, 2, 1),
    "sms-ring": (2, 1, 0),
    "sms-sphere": (2, 1, 1),
}


@pytest.mark.parametrize("name", SCENES)
def test_scene(name, shared):
    scene = RecordingScene()
    imported = usd.load(shared / "scenes" / name / f"{name}.usdc", scene=scene)
    assert (len(scene.meshes), len(scene.lights), len(scene.images)) == SCENES[name]
    assert imported.report.of(usd.Kind.UNSUPPORTED) == []
    assert imported.report.of(usd.Kind.LEFT_OUT) == []
    assert imported.camera == "/World/Camera"
