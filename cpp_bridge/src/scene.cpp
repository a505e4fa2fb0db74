// Scenes over the C ABI.

#include "handles.h"
#include "views.h"

using namespace segue;

segue_status segue_scene_create(segue_scene **out) {
    return guard([&] {
        *required(out, "out") = nullptr;
        *out = new segue_scene{bridge::new_scene(), {}};
        return SEGUE_OK;
    });
}

void segue_scene_free(segue_scene *scene) { delete scene; }

segue_status segue_scene_add_mesh(segue_scene *scene, const segue_mesh *mesh, uint32_t *id) {
    return guard([&] {
        required(scene, "scene"), required(mesh, "mesh"), required(id, "id");
        const segue_mesh &m = *mesh;
        rust::Vec<bridge::AttributeView> attributes;
        if (m.attribute_count) {
            required(m.attributes, "attributes");
        }
        for (size_t i = 0; i < m.attribute_count; ++i) {
            const segue_attribute &a = m.attributes[i];
            if (a.components < 2 || a.components > 4) {
                throw Failure(SEGUE_BAD_ARGUMENT, "an attribute has " + std::to_string(a.components) +
                                                      " components, allowed are 2, 3 and 4");
            }
            attributes.push_back(bridge::AttributeView{
                text(a.name, "attribute name"),
                slice(a.data, a.count, a.components, "attribute data"),
                a.components,
                a.interpolation,
                a.indices != nullptr,
                slice(a.indices, a.indices ? a.index_count : 0, 1, "attribute indices"),
            });
        }
        *id = scene->rust->add_mesh(bridge::MeshView{
            text(m.name, "mesh name"),
            slice(m.points, m.point_count, 3, "points"),
            m.face_counts != nullptr,
            slice(m.face_counts, m.face_counts ? m.face_count : 0, 1, "face_counts"),
            slice(m.face_indices, m.face_index_count, 1, "face_indices"),
            slice(m.holes, m.hole_count, 1, "holes"),
            m.normals != nullptr,
            slice(m.normals, m.normals ? m.normal_count : 0, 3, "normals"),
            m.normal_interpolation,
            m.face_slots != nullptr,
            slice(m.face_slots, m.face_slots ? m.face_count : 0, 1, "face_slots"),
            m.left_handed != 0,
            std::move(attributes),
        });
        return SEGUE_OK;
    });
}

segue_status segue_scene_add_image(segue_scene *scene, const segue_image *image, uint32_t *id) {
    return guard([&] {
        required(scene, "scene"), required(image, "image"), required(id, "id");
        const segue_image &i = *image;
        static const size_t bytes[] = {1, 2, 2, 4};
        if (i.pixel_type > SEGUE_F32) {
            throw Failure(SEGUE_BAD_ARGUMENT, "pixel_type is " + std::to_string(i.pixel_type));
        }
        const size_t pixels = size_t(i.width) * i.height;
        if (i.channels > 4 || i.width > (1u << 16) || i.height > (1u << 16)) {
            throw Failure(SEGUE_BAD_ARGUMENT, "an image of absurd size: " + std::to_string(i.width) + " x " +
                                                  std::to_string(i.height) + " x " + std::to_string(i.channels));
        }
        *id = scene->rust->add_image(bridge::ImageView{
            text(i.name, "image name"),
            i.width,
            i.height,
            i.channels,
            i.pixel_type,
            slice(static_cast<const uint8_t *>(i.pixels), pixels * i.channels * bytes[i.pixel_type], 1, "pixels"),
            text(i.colorspace, "colorspace"),
        });
        return SEGUE_OK;
    });
}

namespace {

// The functions that take a name and JSON and give an index.
template <typename Add>
segue_status add_described(segue_scene *scene, const char *name, const char *json, uint32_t *id, Add add) {
    return guard([&] {
        required(scene, "scene"), required(id, "id");
        *id = add(*scene->rust, text(name, "name"), text(json, "json"));
        return SEGUE_OK;
    });
}

} // namespace

segue_status segue_scene_add_texture(segue_scene *scene, const char *name, const char *json, uint32_t *id) {
    return add_described(scene, name, json, id,
                         [](bridge::SceneHandle &s, rust::Str n, rust::Str j) { return s.add_texture(n, j); });
}

segue_status segue_scene_add_material(segue_scene *scene, const char *name, const char *json, uint32_t *id) {
    return add_described(scene, name, json, id,
                         [](bridge::SceneHandle &s, rust::Str n, rust::Str j) { return s.add_material(n, j); });
}

segue_status segue_scene_add_light(segue_scene *scene, const char *name, const char *json, uint32_t *id) {
    return add_described(scene, name, json, id,
                         [](bridge::SceneHandle &s, rust::Str n, rust::Str j) { return s.add_light(n, j); });
}

segue_status segue_scene_set_camera(segue_scene *scene, const char *name, const char *json) {
    return guard([&] {
        required(scene, "scene")->rust->set_camera(text(name, "name"), text(json, "json"));
        return SEGUE_OK;
    });
}

segue_status segue_scene_add_instances(segue_scene *scene, const segue_instances *instances) {
    return guard([&] {
        required(scene, "scene"), required(instances, "instances");
        const segue_instances &i = *instances;
        scene->rust->add_instances(bridge::InstancesView{
            text(i.name, "instances name"),
            i.mesh,
            slice(i.transforms, i.count, 16, "transforms"),
            slice(i.materials, i.material_count, 1, "materials"),
            i.camera_visible != 0,
            i.two_sided_emission != 0,
            i.object_index,
        });
        return SEGUE_OK;
    });
}

segue_status segue_scene_info(segue_scene *scene, const char **json) {
    return guard([&] {
        required(scene, "scene"), required(json, "json");
        scene->info = std::string(scene->rust->info());
        *json = scene->info.c_str();
        return SEGUE_OK;
    });
}
