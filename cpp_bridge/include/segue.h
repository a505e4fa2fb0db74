/* Segue: the C ABI of the render engine.
 *
 * One shared library, opaque handles, plain C types. Every function that can fail returns a
 * segue_status; the text of the last failure *on the calling thread* is segue_last_error().
 * No exception and no panic leaves this library.
 *
 * Conventions
 *   units       scene units; nothing is rescaled. Radiance in W/(m^2 sr) per linear Rec.709 channel
 *   matrices    16 doubles, row-major, column vectors: translation in m[3], m[7], m[11]
 *   images      row 0 is the top row; uv (0,0) is the bottom-left corner of an image
 *   film        row 0 is the top row of the picture
 *   strings     UTF-8, NUL-terminated, copied; arrays are copied before the call returns
 *   JSON        small structured things (materials, lights, camera, settings) are JSON objects;
 *               unknown keys are errors that name the key. Their schema is docs/abi.md
 *   threads     a handle may be used by one thread at a time, except for segue_render_cancel,
 *               segue_render_size, segue_render_pass_channels and segue_render_read_pass, which any
 *               thread may call at any time
 */
#ifndef SEGUE_H
#define SEGUE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SEGUE_ABI_VERSION 1u

#if defined(_WIN32)
#define SEGUE_API __declspec(dllexport)
#else
#define SEGUE_API __attribute__((visibility("default")))
#endif

typedef enum segue_status {
    SEGUE_OK = 0,
    SEGUE_BAD_ARGUMENT = 1, /* a null pointer, a wrong size, malformed JSON */
    SEGUE_BAD_SCENE = 2,    /* the scene's data are wrong; the message names the object */
    SEGUE_INTERNAL = 3,     /* a defect of the engine, caught at the border */
    SEGUE_CANCELLED = 4,    /* the render was cancelled; what was rendered so far is readable */
    SEGUE_IO = 5            /* a file could not be written */
} segue_status;

typedef struct segue_scene segue_scene;
typedef struct segue_render segue_render;

/* Version of this ABI: compare with SEGUE_ABI_VERSION before any other call. */
SEGUE_API uint32_t segue_abi_version(void);
/* Version of the engine, such as "0.1.0". Static storage. */
SEGUE_API const char *segue_version(void);
/* Last failure on this thread, "" if none. Valid until the next call on this thread. */
SEGUE_API const char *segue_last_error(void);

/* ---- scene ------------------------------------------------------------------------------- */

SEGUE_API segue_status segue_scene_create(segue_scene **out);
SEGUE_API void segue_scene_free(segue_scene *scene); /* null is allowed */

/* Where an attribute's values sit on a mesh. */
typedef enum segue_interpolation {
    SEGUE_CONSTANT = 0, /* one value */
    SEGUE_FACE = 1,     /* one value per polygon (USD "uniform") */
    SEGUE_VERTEX = 2,   /* one value per point (USD "vertex", "varying") */
    SEGUE_CORNER = 3    /* one value per polygon corner (USD "faceVarying") */
} segue_interpolation;

/* A named attribute of a mesh: a UV set (2 floats) or a colour (3 or 4 floats). */
typedef struct segue_attribute {
    const char *name;
    const float *data;           /* count * components floats */
    size_t count;                /* number of values */
    uint32_t components;         /* 2, 3 or 4 */
    uint32_t interpolation;      /* segue_interpolation */
    const uint32_t *indices;     /* optional: one per element, into the values */
    size_t index_count;
} segue_attribute;

/* A polygon mesh. Polygons of any size; concave ones are triangulated, degenerate ones dropped
 * and counted in the scene's warnings. */
typedef struct segue_mesh {
    const char *name;
    const float *points;          /* 3 * point_count floats */
    size_t point_count;
    const uint32_t *face_counts;  /* corners of each polygon; NULL: all are triangles */
    size_t face_count;
    const uint32_t *face_indices; /* point index of every polygon corner */
    size_t face_index_count;
    const uint32_t *holes;        /* optional: polygons that are not there */
    size_t hole_count;
    const float *normals;         /* optional: 3 * normal_count floats; NULL: flat shading */
    size_t normal_count;
    uint32_t normal_interpolation;
    const uint32_t *face_slots;   /* optional: material slot of each polygon; NULL: all 0 */
    uint32_t left_handed;         /* nonzero: corners wind clockwise seen from the front */
    const segue_attribute *attributes;
    size_t attribute_count;
} segue_mesh;

SEGUE_API segue_status segue_scene_add_mesh(segue_scene *scene, const segue_mesh *mesh, uint32_t *id);

typedef enum segue_pixel_type { SEGUE_U8 = 0, SEGUE_U16 = 1, SEGUE_F16 = 2, SEGUE_F32 = 3 } segue_pixel_type;

/* A picture in memory. `colorspace`: "raw" and "linear" are used as they are, "srgb" is decoded
 * (colour channels only). Integers map to [0,1]. 1 channel: grey; 2: grey, alpha; 3: RGB; 4: RGBA. */
typedef struct segue_image {
    const char *name;
    uint32_t width, height, channels;
    uint32_t pixel_type; /* segue_pixel_type */
    const void *pixels;  /* height * width * channels values, row 0 on top */
    const char *colorspace;
} segue_image;

SEGUE_API segue_status segue_scene_add_image(segue_scene *scene, const segue_image *image, uint32_t *id);
SEGUE_API segue_status segue_scene_add_texture(segue_scene *scene, const char *name, const char *json, uint32_t *id);
SEGUE_API segue_status segue_scene_add_material(segue_scene *scene, const char *name, const char *json, uint32_t *id);
SEGUE_API segue_status segue_scene_add_light(segue_scene *scene, const char *name, const char *json, uint32_t *id);
SEGUE_API segue_status segue_scene_set_camera(segue_scene *scene, const char *name, const char *json);

/* Instances of one mesh, all with the same materials. */
typedef struct segue_instances {
    const char *name;
    uint32_t mesh;
    const double *transforms;      /* 16 * count doubles: object to world */
    size_t count;
    const uint32_t *materials;     /* material id of each slot; a slot past the end uses the last */
    size_t material_count;         /* 0: the default grey material */
    uint32_t camera_visible;       /* nonzero: seen by camera rays */
    uint32_t two_sided_emission;   /* nonzero: emissive materials emit from both sides */
    uint32_t object_index;         /* value of the Object Index pass */
} segue_instances;

SEGUE_API segue_status segue_scene_add_instances(segue_scene *scene, const segue_instances *instances);

/* JSON: {"warnings":[...], "needs":{...}, "left_out":[...], "counts":{...}}. Valid until the next
 * call on this scene. */
SEGUE_API segue_status segue_scene_info(segue_scene *scene, const char **json);

/* ---- render ------------------------------------------------------------------------------ */

/* Called on the thread that runs the render, at least ten times a second while pixels are being
 * made. `json` is {"fraction","seconds","remaining","samples","estimated_error","estimated_bias",
 * "stage"}. A nonzero return cancels. */
typedef int (*segue_progress_fn)(void *user, const char *json);
/* A rectangle of the film has new content (x, y from the top left, in film pixels). */
typedef void (*segue_tile_fn)(void *user, uint32_t x, uint32_t y, uint32_t width, uint32_t height);

typedef struct segue_callbacks {
    segue_progress_fn progress; /* may be NULL */
    segue_tile_fn tile;         /* may be NULL */
    void *user;
} segue_callbacks;

/* Validates the scene and the settings and builds what rendering needs. The scene may be freed or
 * changed afterwards without effect on the render. */
SEGUE_API segue_status segue_render_create(const segue_scene *scene, const char *settings_json, segue_render **out);
SEGUE_API void segue_render_free(segue_render *render); /* null is allowed; must not be running */
/* Renders until the settings say stop. Blocks. Called again after a cancel or a time limit it goes on
 * from there: the limit of samples counts from the beginning, the time limit from the call. */
SEGUE_API segue_status segue_render_run(segue_render *render, const segue_callbacks *callbacks);
SEGUE_API segue_status segue_render_cancel(segue_render *render);

/* Film size, after resolution and crop. */
SEGUE_API segue_status segue_render_size(const segue_render *render, uint32_t *width, uint32_t *height);
/* Copies a pass, or a rectangle of it, as it stands now: width * height * channels floats, row 0 on
 * top. `capacity` counts floats. */
SEGUE_API segue_status segue_render_read_pass(segue_render *render, const char *pass, uint32_t x, uint32_t y,
                                              uint32_t width, uint32_t height, float *out, size_t capacity);
/* Number of channels of a pass: 1, 3 or 4. */
SEGUE_API segue_status segue_render_pass_channels(const segue_render *render, const char *pass, uint32_t *channels);
/* A rectangle of the film as the bytes of an EXR file, all passes. Valid until the next call of this
 * function on this render. */
SEGUE_API segue_status segue_render_read_exr(segue_render *render, uint32_t x, uint32_t y, uint32_t width,
                                             uint32_t height, const uint8_t **bytes, size_t *size);
/* Writes the film, tiled, all passes, settings and statistics in the header.
 * `options_json`: {"half":true, "compression":"zip", "layer":"", "attributes":{"key":"text"}} or NULL. */
SEGUE_API segue_status segue_render_write_exr(segue_render *render, const char *path, const char *options_json);
/* Statistics as JSON (docs/abi.md). Valid until the next call of this function on this render. */
SEGUE_API segue_status segue_render_stats(segue_render *render, const char **json);

#ifdef __cplusplus
}
#endif
#endif
