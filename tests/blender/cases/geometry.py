"""Meshes and instances."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Euler, Matrix

import builders


def _triangles(mesh: dict) -> np.ndarray:
    return mesh["points"][mesh["face_indices"].reshape(-1, 3)]


def _area(mesh: dict) -> float:
    a, b, c = _triangles(mesh).transpose(1, 0, 2)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def case_cube() -> None:
    builders.link(builders.cube())
    scene, warnings = builders.export()
    (mesh,) = scene.meshes
    assert (
        mesh["face_indices"].size == 36 and mesh["normals"] is None and mesh["face_slots"] is None
    )
    assert abs(_area(mesh) - 24.0) < 1e-5
    (instances,) = scene.instances
    assert instances["transforms"].shape == (1, 4, 4) and instances["camera_visible"]
    assert not warnings, warnings
    # An object without slots is grey, in 5.0 with a little gloss.
    surface = scene.materials[instances["materials"][0]][1]["surface"]
    kind, key = (
        ("principled", "base_color") if bpy.app.version >= (5, 0, 0) else ("diffuse", "color")
    )
    assert surface["type"] == kind and surface[key] == [0.8, 0.8, 0.8]


def case_modifiers_are_applied() -> None:
    item = builders.link(builders.cube())
    modifier = item.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2
    scene, _ = builders.export()
    # Two levels, those of the render: 6 * 4 * 4 quads.
    assert scene.meshes[0]["face_indices"].size == 6 * 16 * 2 * 3


def case_concave_polygons() -> None:
    # A "C": its area tells whether the triangulation stays inside.
    outline = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (3, 2), (3, 3), (0, 3)]
    data = builders.mesh("C", [(x, y, 0) for x, y in outline], [tuple(range(8))])
    data.uv_layers.new(name="Map")
    data.uv_layers[0].uv.foreach_set("vector", np.array(outline, np.float32).ravel())
    builders.link(data)
    scene, _ = builders.export()
    (mesh,) = scene.meshes
    assert mesh["face_indices"].size == 6 * 3
    assert abs(_area(mesh) - 7.0) < 1e-5
    (uv,) = mesh["attributes"]
    assert uv.name == "Map" and uv.interpolation == "corner"
    np.testing.assert_allclose(uv.data[uv.indices], mesh["points"][mesh["face_indices"]][:, :2])


def case_normals_follow_shading() -> None:
    flat, smooth, mixed = builders.cube("Flat"), builders.cube("Smooth"), builders.cube("Mixed")
    smooth.shade_smooth()
    mixed.polygons.foreach_set("use_smooth", [True, True, True, False, False, False])
    for data in (flat, smooth, mixed):
        builders.link(data)
    scene, _ = builders.export()
    by_name = {mesh["name"]: mesh for mesh in scene.meshes}
    assert by_name["Flat"]["normals"] is None
    points = by_name["Smooth"]["points"]
    assert by_name["Smooth"]["normal_interpolation"] == "vertex"
    np.testing.assert_allclose(by_name["Smooth"]["normals"], points / np.sqrt(3.0), atol=1e-5)
    assert by_name["Mixed"]["normal_interpolation"] == "corner"
    assert by_name["Mixed"]["normals"].shape == (36, 3)
    np.testing.assert_allclose(np.linalg.norm(by_name["Mixed"]["normals"], axis=1), 1.0, atol=1e-5)


def case_the_rendered_uv_map_comes_first() -> None:
    data = builders.quad()
    data.uv_layers.new(name="Second").active_render = True
    builders.link(data)
    scene, _ = builders.export()
    assert [attribute.name for attribute in scene.meshes[0]["attributes"]] == ["Second", "UVMap"]


def case_material_slots() -> None:
    data = builders.cube()
    red, green = (builders.shader_material("BsdfDiffuse", name) for name in ("Red", "Green"))
    for entry in (red, green):
        data.materials.append(entry)
    data.polygons.foreach_set("material_index", [0, 1, 0, 1, 0, 1])
    builders.link(data)
    scene, _ = builders.export()
    names = [scene.materials[index][0] for index in scene.instances[0]["materials"]]
    assert names == ["Red", "Green"]
    assert sorted(scene.meshes[0]["face_slots"].tolist()) == [0] * 6 + [1] * 6


def case_materials_of_the_object() -> None:
    data = builders.cube()
    data.materials.append(builders.shader_material("BsdfDiffuse", "Of the mesh"))
    own = builders.shader_material("BsdfDiffuse", "Of the object")
    builders.link(data, "Plain")
    item = builders.link(data, "Special")
    item.material_slots[0].link = "OBJECT"
    item.material_slots[0].material = own
    scene, _ = builders.export()
    assert len(scene.meshes) == 1, "two objects share one mesh"
    names = {entry["name"]: scene.materials[entry["materials"][0]][0] for entry in scene.instances}
    assert names == {"Plain": "Of the mesh", "Special": "Of the object"}


def case_material_override_of_the_view_layer() -> None:
    data = builders.cube()
    data.materials.append(builders.shader_material("BsdfDiffuse", "Own"))
    builders.link(data)
    bpy.context.view_layer.material_override = builders.shader_material("BsdfGlass", "Override")
    scene, _ = builders.export()
    assert [name for name, _ in scene.materials] == ["Override"]


def case_linked_objects_are_one_group() -> None:
    data = builders.cube()
    for i in range(50):
        builders.link(data, f"Cube {i}", Matrix.Translation((3 * i, 0, 0)))
    scene, _ = builders.export()
    assert len(scene.meshes) == 1 and len(scene.instances) == 1
    places = scene.instances[0]["transforms"][:, :3, 3]
    np.testing.assert_allclose(sorted(places[:, 0]), 3.0 * np.arange(50))


def case_mirrored_and_sheared_matrices() -> None:
    data = builders.cube()
    mirror = Matrix.Diagonal((-1, 2, 1, 1))
    shear = Matrix(((1, 0.5, 0, 1), (0, 1, 0.25, 2), (0, 0, 1, 3), (0, 0, 0, 1)))
    outer = builders.link(
        None, "Outer", Euler((0.3, 0.2, 0.1)).to_matrix().to_4x4() @ Matrix.Diagonal((1, 3, 1, 1))
    )
    child = builders.link(data, "Sheared")
    child.parent = outer
    child.matrix_local = Euler((0.0, 0.4, 0.8)).to_matrix().to_4x4()
    builders.link(data, "Mirrored", mirror)
    builders.link(data, "Direct", shear)
    bpy.context.view_layer.update()
    wanted = sorted(
        np.array(item.matrix_world).ravel().tolist()
        for item in bpy.data.objects
        if item.type == "MESH"
    )
    scene, _ = builders.export()
    found = sorted(scene.instances[0]["transforms"].reshape(-1, 16).tolist())
    np.testing.assert_allclose(found, wanted, atol=1e-6)
    # The child really is sheared: a rotated child of a stretched parent has no right angles.
    axes = np.array(child.matrix_world)[:3, :3]
    assert abs(axes[:, 0] @ axes[:, 1]) > 0.1


def case_collection_instances() -> None:
    data = builders.cube()
    collection = bpy.data.collections.new("Parts")
    part = bpy.data.objects.new("Part", data)
    part.location = (0, 0, 1)
    collection.objects.link(part)
    for i in range(5):
        empty = builders.link(None, f"Copy {i}", Matrix.Translation((i, 0, 0)))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    scene, _ = builders.export()
    assert len(scene.meshes) == 1 and len(scene.instances) == 1
    places = scene.instances[0]["transforms"][:, :3, 3]
    np.testing.assert_allclose(sorted(places[:, 0]), np.arange(5.0))
    np.testing.assert_allclose(places[:, 2], 1.0)


def case_particle_instances() -> None:
    item = builders.link(builders.quad(size=5.0), "Emitter")
    instance = builders.link(builders.cube(half=0.1), "Seed", Matrix.Translation((0, 0, 50)))
    system = item.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system
    system.settings.type = "HAIR"
    system.settings.count = 40
    system.settings.render_type = "OBJECT"
    system.settings.instance_object = instance
    scene, warnings = builders.export()
    counts = sorted(len(entry["transforms"]) for entry in scene.instances)
    # The emitter; the seed itself and its forty copies share mesh and materials.
    assert counts == [1, 41], counts
    assert len(scene.meshes) == 2
    assert not warnings, warnings


def _instancing_nodes(instance: bpy.types.Object, count: int) -> bpy.types.NodeTree:
    """Geometry nodes that add `count` instances of an object on a line to a geometry."""
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = tree.nodes, tree.links
    start, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    line = nodes.new("GeometryNodeMeshLine")
    line.inputs["Count"].default_value = count
    line.inputs["Offset"].default_value = (2, 0, 0)
    info = nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = instance
    info.inputs["As Instance"].default_value = True
    scatter, join = nodes.new("GeometryNodeInstanceOnPoints"), nodes.new("GeometryNodeJoinGeometry")
    links.new(line.outputs["Mesh"], scatter.inputs["Points"])
    links.new(info.outputs["Geometry"], scatter.inputs["Instance"])
    links.new(start.outputs[0], join.inputs[0])
    links.new(scatter.outputs[0], join.inputs[0])
    links.new(join.outputs[0], end.inputs[0])
    return tree


def case_geometry_nodes_instances() -> None:
    source = builders.link(builders.cube(half=0.1), "Source", Matrix.Translation((0, 0, 7)))
    source.data.materials.append(builders.shader_material("BsdfGlass", "Glass"))
    source.hide_render = True
    item = builders.link(builders.quad(), "Ground")
    item.modifiers.new("Nodes", "NODES").node_group = _instancing_nodes(source, 100)
    scene, _ = builders.export()
    counts = {entry["name"]: len(entry["transforms"]) for entry in scene.instances}
    assert sorted(counts.values()) == [1, 100], counts
    assert len(scene.meshes) == 2
    many = max(scene.instances, key=lambda entry: len(entry["transforms"]))
    assert scene.materials[many["materials"][0]][0] == "Glass"
    np.testing.assert_allclose(sorted(many["transforms"][:, 0, 3]), 2.0 * np.arange(100))


def case_hidden_objects_stay_out() -> None:
    builders.link(builders.cube()).hide_render = True
    scene, _ = builders.export()
    assert not scene.meshes and not scene.instances


def case_camera_visibility_and_pass_index() -> None:
    data = builders.cube()
    plain, hidden = builders.link(data, "Plain"), builders.link(data, "Hidden")
    hidden.visible_camera = False
    plain.pass_index = 7
    scene, warnings = builders.export()
    found = {
        entry["name"]: (entry["camera_visible"], entry["object_index"]) for entry in scene.instances
    }
    assert found == {"Plain": (True, 7), "Hidden": (False, 0)}
    assert not warnings
    hidden.visible_shadow = False
    _, warnings = builders.export()
    assert any("Hidden" in text and "shadow" in text for text in warnings)


def case_indirect_only_collections() -> None:
    collection = bpy.data.collections.new("Behind")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("Cube", builders.cube()))
    bpy.context.view_layer.layer_collection.children["Behind"].indirect_only = True
    scene, _ = builders.export()
    assert scene.instances[0]["camera_visible"] is False


def case_text_and_curves_appear_once() -> None:
    curve = bpy.data.curves.new("Text", "FONT")
    curve.body = "Segue"
    curve.extrude = 0.1
    builders.link(curve)
    scene, _ = builders.export()
    assert len(scene.meshes) == 1 and len(scene.instances) == 1
    assert len(scene.instances[0]["transforms"]) == 1


def case_attributes_that_materials_read() -> None:
    data = builders.quad()
    color = data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    color.data.foreach_set("color", np.arange(16, dtype=np.float32))
    data.attributes.new("Unused", "FLOAT", "POINT")
    entry, tree, output = builders.material()
    reader, diffuse = (
        tree.nodes.new("ShaderNodeVertexColor"),
        tree.nodes.new("ShaderNodeBsdfDiffuse"),
    )
    reader.layer_name = "Paint"
    tree.links.new(reader.outputs["Color"], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    data.materials.append(entry)
    builders.link(data)
    scene, _ = builders.export()
    attributes = {attribute.name: attribute for attribute in scene.meshes[0]["attributes"]}
    assert set(attributes) == {"UVMap", "Paint"}
    paint = attributes["Paint"]
    corners = scene.meshes[0]["face_indices"]
    np.testing.assert_allclose(paint.data[paint.indices][:, 0], 4.0 * corners)
    surface = scene.materials[0][1]["surface"]
    assert scene.textures[surface["color"]["texture"]][1]["name"] == "Paint"


def case_large_meshes_are_quick() -> None:
    import time

    data = bpy.data.meshes.new("Grid")
    import bmesh

    work = bmesh.new()
    bmesh.ops.create_grid(work, x_segments=500, y_segments=500)
    work.to_mesh(data)
    work.free()
    builders.link(data)
    builders.export()
    start = time.monotonic()
    scene, _ = builders.export()
    # Half a million triangles: bulk copies take a few hundredths of a second, a Python loop tens.
    assert time.monotonic() - start < 5.0
    assert scene.meshes[0]["face_indices"].size == 500 * 500 * 6


def _attribute_material(name: str, output: str) -> bpy.types.Material:
    entry, tree, target = builders.material()
    reader = tree.nodes.new("ShaderNodeAttribute")
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    reader.attribute_name = name
    tree.links.new(reader.outputs[output], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], target.inputs["Surface"])
    return entry


def _read_attribute(name: str, output: str, data: bpy.types.Mesh) -> tuple[str, dict]:
    data.materials.clear()
    data.materials.append(_attribute_material(name, output))
    scene, warnings = builders.export()
    assert not warnings, warnings
    color = scene.materials[0][1]["surface"]["color"]
    found = {
        attribute.name: attribute
        for attribute in scene.meshes[0]["attributes"]
        if attribute.data.shape[1] != 2
    }
    return found[scene.textures[color["texture"]][1]["name"]]


def case_uv_maps_as_colours() -> None:
    data = builders.quad()
    builders.link(data)
    values = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    found = _read_attribute("UVMap", "Vector", data)
    np.testing.assert_allclose(found.data, np.pad(values, ((0, 0), (0, 1))))
    assert found.interpolation == "corner"
    # As a factor Cycles takes the first of two components.
    found = _read_attribute("UVMap", "Fac", data)
    np.testing.assert_allclose(found.data, np.repeat(values[:, :1], 3, axis=1))


def case_vectors_as_uv_maps() -> None:
    data = builders.quad()
    data.attributes.new("Place", "FLOAT_VECTOR", "POINT").data.foreach_set(
        "vector", np.arange(12, dtype=np.float32)
    )
    entry, tree, output = builders.material()
    reader, image = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeTexImage")
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    reader.attribute_name = "Place"
    image.image = builders.image("Picture", np.ones((2, 2, 4), np.float32))
    tree.links.new(reader.outputs["Vector"], image.inputs["Vector"])
    tree.links.new(image.outputs["Color"], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    data.materials.append(entry)
    builders.link(data)
    scene, _ = builders.export()
    found = {attribute.name: attribute for attribute in scene.meshes[0]["attributes"]}["Place"]
    np.testing.assert_allclose(found.data, np.arange(12).reshape(4, 3)[:, :2])


def case_attributes_of_edges() -> None:
    data = builders.quad()
    builders.link(data)
    values = np.array([0.0, 1.0, 2.0, 4.0], np.float32)
    data.attributes.new("Crease", "FLOAT", "EDGE").data.foreach_set("value", values)
    found = _read_attribute("Crease", "Fac", data)
    wanted = [
        np.mean([values[edge.index] for edge in data.edges if point in edge.vertices])
        for point in range(4)
    ]
    assert found.interpolation == "vertex"
    np.testing.assert_allclose(found.data, np.repeat(np.array(wanted)[:, None], 3, axis=1))


def case_materials_are_shared_unless_they_ask_for_the_object() -> None:
    material, tree, output = builders.material("Tested")
    shader, info = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeObjectInfo")
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    data = builders.quad()
    data.materials.append(material)
    for index in range(3):
        item = builders.link(data)
        item.pass_index = min(index, 1)
        item.color = (0.25 * index, 0.5, 1.0, 0.5)
    # Nothing is asked, then what two have in common, then what none has.
    for name, count in ((None, 1), ("Alpha", 1), ("Object Index", 2), ("Color", 3), ("Random", 3)):
        if name:
            tree.links.new(info.outputs[name], shader.inputs["Color"])
        scene, warnings = builders.export()
        assert not warnings and len(scene.materials) == count, (name, len(scene.materials))
        assert len(scene.meshes) == 1
    tree.links.new(info.outputs["Location"], shader.inputs["Color"])
    _, warnings = builders.export()
    assert len(warnings) == 1 and "'Location'" in warnings[0], warnings
