// Renders over the C ABI.

#include "handles.h"
#include "views.h"

using namespace segue;

uint32_t segue_abi_version(void) { return SEGUE_ABI_VERSION; }

const char *segue_version(void) {
    static const std::string version = std::string(bridge::version());
    return version.c_str();
}

const char *segue_last_error(void) { return last_error().c_str(); }

segue_status segue_render_create(const segue_scene *scene, const char *settings_json, segue_render **out) {
    return guard([&] {
        *required(out, "out") = nullptr;
        required(scene, "scene");
        *out = new segue_render{bridge::new_render(*scene->rust, text(settings_json, "settings_json")), {}, {}};
        return SEGUE_OK;
    });
}

void segue_render_free(segue_render *render) { delete render; }

segue_status segue_render_run(segue_render *render, const segue_callbacks *callbacks) {
    return guard([&] {
        required(render, "render");
        bridge::Callbacks forward(callbacks);
        return render->rust->run(forward) ? SEGUE_OK : SEGUE_CANCELLED;
    });
}

segue_status segue_render_cancel(segue_render *render) {
    return guard([&] {
        required(render, "render")->rust->cancel();
        return SEGUE_OK;
    });
}

segue_status segue_render_size(const segue_render *render, uint32_t *width, uint32_t *height) {
    return guard([&] {
        required(render, "render"), required(width, "width"), required(height, "height");
        const bridge::FilmRect size = render->rust->size();
        *width = size.width;
        *height = size.height;
        return SEGUE_OK;
    });
}

segue_status segue_render_read_pass(segue_render *render, const char *pass, uint32_t x, uint32_t y, uint32_t width,
                                    uint32_t height, float *out, size_t capacity) {
    return guard([&] {
        required(render, "render"), required(out, "out");
        const rust::Str name = text(pass, "pass");
        const size_t needed = size_t(width) * height * render->rust->pass_channels(name);
        if (capacity < needed) {
            throw Failure(SEGUE_BAD_ARGUMENT, "capacity is " + std::to_string(capacity) + " floats, " +
                                                  std::to_string(needed) + " are needed");
        }
        render->rust->read_pass(name, bridge::FilmRect{x, y, width, height}, rust::Slice<float>(out, needed));
        return SEGUE_OK;
    });
}

segue_status segue_render_pass_channels(const segue_render *render, const char *pass, uint32_t *channels) {
    return guard([&] {
        *required(channels, "channels") = required(render, "render")->rust->pass_channels(text(pass, "pass"));
        return SEGUE_OK;
    });
}

segue_status segue_render_read_exr(segue_render *render, uint32_t x, uint32_t y, uint32_t width, uint32_t height,
                                   const uint8_t **bytes, size_t *size) {
    return guard([&] {
        required(render, "render"), required(bytes, "bytes"), required(size, "size");
        render->exr = render->rust->read_exr(bridge::FilmRect{x, y, width, height});
        *bytes = render->exr.data();
        *size = render->exr.size();
        return SEGUE_OK;
    });
}

segue_status segue_render_write_exr(segue_render *render, const char *path, const char *options_json) {
    return guard([&] {
        required(render, "render")->rust->write_exr(text(path, "path"), optional_text(options_json, "options_json"));
        return SEGUE_OK;
    });
}

segue_status segue_render_stats(segue_render *render, const char **json) {
    return guard([&] {
        required(render, "render"), required(json, "json");
        render->stats = std::string(render->rust->stats());
        *json = render->stats.c_str();
        return SEGUE_OK;
    });
}
