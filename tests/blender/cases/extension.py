"""The archive as a user gets it: validated, installed, enabled, rendered with, removed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import addon_utils
import bpy
from mathutils import Matrix

import builders

MODULE = "bl_ext.user_default.segue"


def case_install_render_and_remove() -> None:
    archive = os.environ["SEGUE_TEST_ARCHIVE"]
    scripts = Path(bpy.utils.system_resource("SCRIPTS"))
    tool = scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    subprocess.run([sys.executable, str(tool), "validate", archive], check=True)

    bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
    if MODULE not in bpy.context.preferences.addons:
        addon_utils.enable(MODULE, default_set=True)
    import segue

    resources = Path(os.environ["BLENDER_USER_RESOURCES"])
    assert resources in Path(segue.__file__).parents, "the package must come from the archive"

    builders.settings(32, 24)
    builders.camera(Matrix.Translation((0, 0, 5)))
    builders.link(builders.cube())
    builders.light("POINT", Matrix.Translation((2, 2, 4)), energy=500.0)
    scene = bpy.context.scene
    scene.segue.samples = 4
    scene.render.filepath = str(builders.OUTPUT / "installed.png")
    builders.render(write_still=True)
    picture = builders.read(builders.OUTPUT / "installed.png")
    assert picture[12, 16, :3].min() > 0.1

    addon_utils.disable(MODULE, default_set=True)
    assert not hasattr(bpy.types.Scene, "segue")
    bpy.ops.extensions.package_uninstall(repo_index=_user_repository(), pkg_id="segue")
    assert not (resources / "extensions" / "user_default" / "segue").exists()


def _user_repository() -> int:
    modules = [repo.module for repo in bpy.context.preferences.extensions.repos]
    return modules.index("user_default")
