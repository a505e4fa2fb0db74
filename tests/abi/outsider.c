/* Uses the C ABI as an outsider would: only the header, only the shared library. */

#include "segue.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int failures = 0;

#define CHECK(condition)                                                                                              \
    do {                                                                                                              \
        if (!(condition)) {                                                                                           \
            fprintf(stderr, "%s:%d: failed: %s (last error: \"%s\")\n", __FILE__, __LINE__, #condition,               \
                    segue_last_error());                                                                              \
            failures++;                                                                                               \
        }                                                                                                             \
    } while (0)

static const char *CAMERA = "{\"window\":[-0.5,0.5,-0.5,0.5],"
                            "\"transform\":[1,0,0,0, 0,1,0,0, 0,0,1,4, 0,0,0,1]}";

/* A wall of albedo 0.5 that fills the view, under a uniform sky of radiance 2. */
static segue_scene *make_scene(void) {
    segue_scene *scene = NULL;
    CHECK(segue_scene_create(&scene) == SEGUE_OK);
    const float points[] = {-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0};
    const uint32_t counts[] = {4}, corners[] = {0, 1, 2, 3};
    const float uv[] = {0, 0, 1, 0, 1, 1, 0, 1};
    const segue_attribute st = {"st", uv, 4, 2, SEGUE_CORNER, NULL, 0};
    segue_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.name = "wall";
    mesh.points = points;
    mesh.point_count = 4;
    mesh.face_counts = counts;
    mesh.face_count = 1;
    mesh.face_indices = corners;
    mesh.face_index_count = 4;
    mesh.attributes = &st;
    mesh.attribute_count = 1;
    uint32_t mesh_id = 99, material = 99, light = 99;
    CHECK(segue_scene_add_mesh(scene, &mesh, &mesh_id) == SEGUE_OK && mesh_id == 0);
    CHECK(segue_scene_add_material(scene, "grey", "{\"surface\":{\"type\":\"diffuse\",\"color\":0.5}}", &material) ==
          SEGUE_OK);
    CHECK(segue_scene_add_light(scene, "sky", "{\"type\":\"dome\",\"radiance\":[2,2,2]}", &light) == SEGUE_OK);
    CHECK(segue_scene_set_camera(scene, "camera", CAMERA) == SEGUE_OK);
    const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const segue_instances instances = {"wall", mesh_id, identity, 1, &material, 1, 1, 0, 7};
    CHECK(segue_scene_add_instances(scene, &instances) == SEGUE_OK);
    return scene;
}

struct seen {
    int progress, tiles;
    double area;
    int cancel_at;
};

static int on_progress(void *user, const char *json) {
    struct seen *s = user;
    CHECK(strstr(json, "\"fraction\"") != NULL);
    return s->cancel_at > 0 && ++s->progress >= s->cancel_at;
}

static void on_tile(void *user, uint32_t x, uint32_t y, uint32_t w, uint32_t h) {
    struct seen *s = user;
    (void)x, (void)y;
    s->tiles++;
    s->area += (double)w * h;
}

static void test_render(void) {
    segue_scene *scene = make_scene();
    segue_render *render = NULL;
    CHECK(segue_render_create(scene, "{\"resolution\":[40,30],\"samples\":16,\"passes\":[\"Combined\",\"Depth\"]}",
                              &render) == SEGUE_OK);
    segue_scene_free(scene); /* a render does not need its scene any more */
    struct seen seen = {0, 0, 0, 0};
    const segue_callbacks callbacks = {on_progress, on_tile, &seen};
    CHECK(segue_render_run(render, &callbacks) == SEGUE_OK);
    CHECK(seen.tiles > 0 && seen.area >= 40 * 30);

    uint32_t w = 0, h = 0, channels = 0;
    CHECK(segue_render_size(render, &w, &h) == SEGUE_OK && w == 40 && h == 30);
    CHECK(segue_render_pass_channels(render, "Combined", &channels) == SEGUE_OK && channels == 4);
    float rgba[40 * 30 * 4];
    CHECK(segue_render_read_pass(render, "Combined", 0, 0, 40, 30, rgba, 40 * 30 * 4) == SEGUE_OK);
    double mean = 0;
    for (int i = 0; i < 40 * 30; i++) {
        mean += rgba[4 * i] / (40.0 * 30.0);
        CHECK(rgba[4 * i + 3] == 1.0f);
    }
    /* reflected radiance = albedo * sky radiance */
    CHECK(fabs(mean - 1.0) < 0.01);
    float depth[12];
    CHECK(segue_render_read_pass(render, "Depth", 10, 10, 4, 3, depth, 12) == SEGUE_OK && fabsf(depth[5] - 4) < 1e-4f);

    const uint8_t *bytes = NULL;
    size_t size = 0;
    static const uint8_t magic[4] = {0x76, 0x2f, 0x31, 0x01};
    CHECK(segue_render_read_exr(render, 0, 0, 40, 30, &bytes, &size) == SEGUE_OK && size > 100);
    CHECK(bytes && memcmp(bytes, magic, 4) == 0);
    const char *stats = NULL;
    CHECK(segue_render_stats(render, &stats) == SEGUE_OK && strstr(stats, "\"non_finite\":0"));
    CHECK(strstr(stats, "\"samples\":16.0") != NULL);

    CHECK(segue_render_read_pass(render, "Depth", 0, 0, 40, 30, depth, 12) == SEGUE_BAD_ARGUMENT);
    CHECK(segue_render_read_pass(render, "Depth", 39, 0, 2, 1, depth, 12) == SEGUE_BAD_ARGUMENT);
    CHECK(segue_render_read_pass(render, "Normal", 0, 0, 2, 2, depth, 12) == SEGUE_BAD_ARGUMENT);
    CHECK(segue_render_read_pass(render, "Beauty", 0, 0, 1, 1, depth, 12) == SEGUE_BAD_ARGUMENT);
    CHECK(strstr(segue_last_error(), "Beauty") != NULL);
    CHECK(segue_render_write_exr(render, "/nonexistent/folder/out.exr", NULL) == SEGUE_IO);
    CHECK(strstr(segue_last_error(), "/nonexistent/folder/out.exr") != NULL);
    segue_render_free(render);
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double cancelled_at;

static void *cancel_later(void *render) {
    const struct timespec pause = {0, 300000000};
    nanosleep(&pause, NULL);
    cancelled_at = now();
    CHECK(segue_render_cancel(render) == SEGUE_OK);
    return NULL;
}

static void test_cancel(const char *integrator) {
    segue_scene *scene = make_scene();
    segue_render *render = NULL;
    char settings[128];
    snprintf(settings, sizeof settings, "{\"integrator\":\"%s\",\"resolution\":[1920,1080],\"time\":1000}", integrator);
    CHECK(segue_render_create(scene, settings, &render) == SEGUE_OK);
    struct seen seen = {0, 0, 0, 3};
    const segue_callbacks callbacks = {on_progress, on_tile, &seen};
    CHECK(segue_render_run(render, &callbacks) == SEGUE_CANCELLED);
    CHECK(seen.progress == 3);
    pthread_t thread;
    CHECK(pthread_create(&thread, NULL, cancel_later, render) == 0);
    CHECK(segue_render_run(render, NULL) == SEGUE_CANCELLED);
    const double latency = now() - cancelled_at;
    pthread_join(thread, NULL);
    printf("%s: cancelled within %.0f ms\n", integrator, 1e3 * latency);
    CHECK(latency < 2.0); /* generous: a loaded machine must not fail this; the promise is 100 ms */
    float pixel[4];
    CHECK(segue_render_read_pass(render, "Combined", 0, 0, 1, 1, pixel, 4) == SEGUE_OK);
    /* segments reach the film a whole iteration at a time, paths one by one */
    CHECK(strcmp(integrator, "path") != 0 || pixel[0] > 0.5f);
    segue_render_free(render);
    segue_scene_free(scene);
}

static void test_errors(void) {
    CHECK(segue_abi_version() == SEGUE_ABI_VERSION);
    CHECK(strlen(segue_version()) >= 5);
    CHECK(segue_scene_create(NULL) == SEGUE_BAD_ARGUMENT);
    segue_scene *scene = make_scene();
    uint32_t id = 0;
    CHECK(segue_scene_add_mesh(scene, NULL, &id) == SEGUE_BAD_ARGUMENT);
    segue_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.name = "broken";
    const uint32_t far_corner[] = {0, 1, 2};
    mesh.face_indices = far_corner;
    mesh.face_index_count = 3;
    mesh.face_count = 1;
    CHECK(segue_scene_add_mesh(scene, &mesh, &id) == SEGUE_BAD_SCENE);
    CHECK(strstr(segue_last_error(), "broken") != NULL);
    mesh.points = NULL;
    mesh.point_count = 5;
    CHECK(segue_scene_add_mesh(scene, &mesh, &id) == SEGUE_BAD_ARGUMENT);
    mesh.name = "\xff\xfe";
    mesh.point_count = 0;
    CHECK(segue_scene_add_mesh(scene, &mesh, &id) == SEGUE_BAD_ARGUMENT);
    CHECK(strstr(segue_last_error(), "UTF-8") != NULL);
    CHECK(segue_scene_add_material(scene, "m", "{\"surface\":{\"type\":\"velvet\"}}", &id) == SEGUE_BAD_SCENE);
    CHECK(segue_scene_add_material(scene, "m", "not json", &id) == SEGUE_BAD_SCENE);
    CHECK(segue_scene_add_light(scene, "l", "{\"type\":\"sphere\",\"radiance\":[-1,0,0]}", &id) == SEGUE_BAD_SCENE);
    CHECK(segue_scene_set_camera(scene, "c", "{\"window\":[1,0,0,1]}") == SEGUE_BAD_SCENE);
    segue_render *render = (segue_render *)scene;
    CHECK(segue_render_create(scene, "{}", &render) == SEGUE_BAD_ARGUMENT && render == NULL);
    CHECK(segue_render_create(scene, "{\"resolution\":[1000000,1000000],\"samples\":1}", &render) ==
          SEGUE_BAD_ARGUMENT);
    CHECK(segue_render_run(NULL, NULL) == SEGUE_BAD_ARGUMENT);
    const char *info = NULL;
    CHECK(segue_scene_info(scene, &info) == SEGUE_OK && strstr(info, "\"triangles\":2"));
    segue_scene_free(scene);
    segue_scene_free(NULL);
    segue_render_free(NULL);

    /* a scene without camera is an error, an empty one is not a crash */
    CHECK(segue_scene_create(&scene) == SEGUE_OK);
    CHECK(segue_render_create(scene, "{\"resolution\":[4,4],\"samples\":1}", &render) == SEGUE_BAD_SCENE);
    CHECK(strstr(segue_last_error(), "camera") != NULL);
    CHECK(segue_scene_set_camera(scene, "c", CAMERA) == SEGUE_OK);
    CHECK(segue_render_create(scene, "{\"resolution\":[4,4],\"samples\":1}", &render) == SEGUE_OK);
    CHECK(segue_render_run(render, NULL) == SEGUE_OK);
    segue_render_free(render);
    segue_scene_free(scene);
}

int main(void) {
    test_errors();
    test_render();
    test_cancel("segment");
    test_cancel("path");
    printf(failures ? "%d checks failed\n" : "all checks passed\n", failures);
    return failures != 0;
}
