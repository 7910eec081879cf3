#ifndef OVERCOAT_H
#define OVERCOAT_H

/* Generated from src/capi by cbindgen. Do not edit: see cbindgen.toml. */

#include <stddef.h>
#include <stdint.h>

/*
 * overcoat: layered, energy-conserving BSDFs from scripts.
 *
 * Handles (oc_engine, oc_material, oc_bsdf) are numbers in the shape of pointers, looked up in a table: a null, freed or
 * foreign one gives an error code. Every call returns a status; oc_last_error has the message. Any function may be
 * called from any thread; calls on one BSDF wait for one another, so keep one BSDF per thread. What a function gives
 * out is the caller's to free; nothing given in is kept after the call, unless the function says so. Vectors and colors
 * are three floats: world space, unit length, away from the surface; linear RGB. Sections `# Safety` say what pointers
 * must point to: that cannot be checked.
 */

// To the side `wo` is on.
#define OC_REFLECT 1

// To the other side.
#define OC_TRANSMIT 2

// As wide as a diffuse surface.
#define OC_DIFFUSE 4

// Narrower than that, and not a delta.
#define OC_GLOSSY 8

// Into one direction; `oc_bsdf_eval` does not see it, and the pdf of a sample is a probability.
#define OC_DELTA 16

// Straight through: `oc_bsdf_transparency` is not black. Of whole BSDFs only.
#define OC_NULL 32

// Light is given off: `oc_bsdf_emission` is not black. Of whole BSDFs only.
#define OC_EMISSION 64

// A float.
#define OC_PARAM_FLOAT 0

// An int.
#define OC_PARAM_INT 1

// Linear RGB.
#define OC_PARAM_COLOR 2

// A tangent; the first one turns the frame the callbacks see.
#define OC_PARAM_VECTOR 3

// A normal; the first one is the z axis of that frame.
#define OC_PARAM_NORMAL 4

// Tables and arithmetic for speed: albedos within 1e-2 of the reference.
#define OC_TIER_FAST 0

// The default: albedos within 1e-3 of the reference.
#define OC_TIER_STANDARD 1

// A layer scales its base by the smaller α of the two directions: reciprocal, loses some energy. The default.
#define OC_LAYERING_MIN 0

// By α toward the viewer: loses nothing there, is not reciprocal, may gain toward the light.
#define OC_LAYERING_VIEW 1

// Solved for: reciprocal, and lossless below reciprocal tops.
#define OC_LAYERING_BALANCED 2

// Version of this interface. A library with the same number understands every call of this header.
#define OC_ABI_VERSION 1

// How a call ended. Whatever is not `OC_OK` leaves a message for `oc_last_error` and, unless said otherwise, all
// results untouched.
typedef enum oc_status {
    // As asked.
    OC_OK = 0,
    // A pointer that must not be null is null.
    OC_ERROR_NULL = 1,
    // A length or a stride is out of range.
    OC_ERROR_BAD_LENGTH = 2,
    // A handle was never given out, is freed, or is of another kind.
    OC_ERROR_BAD_HANDLE = 3,
    // Text is not UTF-8.
    OC_ERROR_BAD_TEXT = 4,
    // A number stands for nothing.
    OC_ERROR_BAD_VALUE = 5,
    // A script does not compile, or a parameter cannot be set so; the message has the places.
    OC_ERROR_SCRIPT = 6,
    // Shading went beyond a budget.
    OC_ERROR_BUDGET = 7,
    // A closure cannot be registered.
    OC_ERROR_REGISTER = 8,
    // A material gives back more light than it receives.
    OC_ERROR_GAINS = 9,
    // A fault of the library. What was asked for may be half done.
    OC_ERROR_INTERNAL = 10,
} oc_status;

// A BSDF at a shading point, as `oc_shade` gives out. Never followed as a pointer.
typedef struct oc_bsdf oc_bsdf;

// An engine, as `oc_engine_new` gives out. Never followed as a pointer.
typedef struct oc_engine oc_engine;

// A material, as `oc_material_compile` gives out. Never followed as a pointer.
typedef struct oc_material oc_material;

// One sample with all there is to know of it.
typedef struct oc_sample {
    // World space, unit, away from the surface.
    float wi[3];
    // f·|cos| per channel; for a delta sample what it scatters.
    float f_cos[3];
    // Density over solid angle, or the probability of a delta sample; 0: nothing is scattered that way, the rest is 0 too.
    float pdf;
    // Index of refraction on `wi`'s side over that on `wo`'s: 1 unless light was refracted. Radiance is divided by its square.
    float eta;
    // How wide the sampled lobe scatters: 0 one direction, 1 as wide as a diffuse surface.
    float roughness;
    // `OC_REFLECT` or `OC_TRANSMIT`, with one of `OC_DIFFUSE`, `OC_GLOSSY`, `OC_DELTA`.
    uint32_t flags;
} oc_sample;

// One parameter of a closure.
typedef struct oc_closure_param {
    // As scripts write it.
    const char *name;
    // One of `OC_PARAM_…`.
    uint32_t kind;
    // Not 0: given as `"name", value` after the others, and may be left out.
    int32_t keyword;
    // Its usual value: one number, or three for a color. Not used for vectors and normals.
    float default_value[3];
    // Values are clamped to this range, per channel.
    float min;
    // Upper end of the range.
    float max;
    // What it is, or null.
    const char *doc;
} oc_closure_param;

// Writes three numbers for a pair of directions. `values`: the parameters in declared order, clamped; a float or int takes
// one place, the rest three. Directions are unit vectors away from the surface in the frame of the normal (z) and tangent
// (x).
typedef void (*oc_pair_fn)(void *user,
                           const float *values,
                           const double *wo,
                           const double *wi,
                           double *out);

// Writes three numbers for one direction: see `oc_pair_fn`.
typedef void (*oc_direction_fn)(void *user, const float *values, const double *w, double *out);

// Writes a direction for two uniform numbers `u`: see `oc_pair_fn`.
typedef void (*oc_sample_fn)(void *user,
                             const float *values,
                             const double *wo,
                             const double *u,
                             double *wi);

// Returns the density over solid angle of sampling `wi`: see `oc_pair_fn`.
typedef double (*oc_pdf_fn)(void *user, const float *values, const double *wo, const double *wi);

// A closure that the host brings along. Set everything to 0 first; what stays null is left out.
typedef struct oc_closure {
    // As scripts call it. Required.
    const char *name;
    // What it looks like and does, or null.
    const char *doc;
    // Where it comes from (paper, equation), or null.
    const char *source;
    // `param_count` parameters, or null if there are none.
    const struct oc_closure_param *params;
    // How many.
    size_t param_count;
    // Not 0: f(wo, wi) differs from f(wi, wo).
    int32_t not_reciprocal;
    // Not 0: it scatters to the other side too, and has a `sample` of its own.
    int32_t transmits;
    // f per channel, without any cosine. Required.
    oc_pair_fn f;
    // Never below the integral of f·|cos| over the other direction, with `w` the viewer's or the light's, per channel.
    // Required: layering rests on it. May exceed 1, f is then divided; one that is too low is found by `oc_material_audit`.
    oc_direction_fn albedo_bound;
    // The best estimate of that integral with `w` the viewer's; null: the bound.
    oc_direction_fn albedo;
    // Draws directions; null: cosine-weighted on `wo`'s side. Needs `pdf`.
    oc_sample_fn sample;
    // The density of `sample`.
    oc_pdf_fn pdf;
    // Handed to every callback.
    void *user;
} oc_closure;

// What changes by one pixel to the right (`x`) and one pixel down (`y`): of the position, of the direction the ray travels,
// of the surface parameters. Read only where the engine's `oc_host` says so.
typedef struct oc_differentials {
    // Of the position.
    float dpdx[3];
    // Of the position, downward.
    float dpdy[3];
    // Of the direction the ray travels.
    float didx[3];
    // Of the direction the ray travels, downward.
    float didy[3];
    // Of u.
    float dudx;
    // Of u, downward.
    float dudy;
    // Of v.
    float dvdx;
    // Of v, downward.
    float dvdy;
} oc_differentials;

// The shading point, in world space. Fill it with `oc_globals_default` first, then set what is known.
typedef struct oc_globals {
    // Position.
    float p[3];
    // Shading normal, toward the viewer; its length does not matter. Zero or not finite: `ng` is used.
    float n[3];
    // Geometric normal, toward the viewer.
    float ng[3];
    // dP/du: where tangents are measured from.
    float dpdu[3];
    // dP/dv.
    float dpdv[3];
    // Surface parameters.
    float u;
    // The second surface parameter.
    float v;
    // Shutter time in seconds.
    float time;
    // Not 0: the ray hit the back of the surface, and the host turned the normals toward the viewer.
    int32_t backfacing;
    // How it differs from the points that the neighbouring pixels show.
    struct oc_differentials differentials;
} oc_globals;

// One lookup of a texture.
typedef struct oc_lookup {
    // The file as the script names it: `name_len` bytes of UTF-8, without a closing 0.
    const char *name;
    // Length of `name` in bytes.
    size_t name_len;
    // Coordinates; 0 to 1 spans the picture, t downward.
    float s;
    // The second coordinate.
    float t;
    // The first channel asked for.
    int32_t first_channel;
    // How s and t change by one pixel to the right, then by one pixel down: as the script says, or as they follow from
    // `differentials`; else 0.
    float changes[2][2];
    // The shading point.
    struct oc_globals globals;
} oc_lookup;

// Looks up a texture: writes linear RGB and alpha to `rgba` and returns 1, or returns 0 if there is no such picture.
// Called from whatever thread shades; must neither unwind nor call the library.
typedef int32_t (*oc_texture_fn)(void *user, const struct oc_lookup *lookup, float *rgba);

// What a host answers, and gives besides.
typedef struct oc_host {
    // Looks up textures; null: none are found.
    oc_texture_fn texture;
    // Not 0: `differentials` of each `oc_globals` is filled in, and scripts may ask for derivatives.
    int32_t derivatives;
    // Handed to every callback.
    void *user;
} oc_host;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// f·|cos| per channel and the pdf for `n` directions; delta lobes left out. A direction that is not near unit length
// gives 0.
//
// `wi`: 3n floats. `f_cos`: receives 3n. `pdf`: receives n. They must not overlap.
//
// # Safety
// The arrays are null or as long as said.
enum oc_status oc_bsdf_eval(struct oc_bsdf *bsdf,
                            const float *wi,
                            size_t n,
                            float *f_cos,
                            float *pdf);

// `oc_bsdf_eval` for arrays whose elements (three floats, three floats, one float) lie so many bytes apart: fields of
// structs, for example.
//
// # Safety
// The arrays are null or reach as far as `n` and the strides say.
enum oc_status oc_bsdf_eval_strided(struct oc_bsdf *bsdf,
                                    const float *wi,
                                    size_t wi_stride,
                                    size_t n,
                                    float *f_cos,
                                    size_t f_cos_stride,
                                    float *pdf,
                                    size_t pdf_stride);

// Draws `n` directions; a sample that scatters nothing has pdf 0.
//
// `u`: 3n uniform numbers in [0, 1). `wi`, `f_cos`: receive 3n floats, `pdf`: n. `flags`: receives n, as in `oc_sample`; or
// null. They must not overlap. The weight of a sample is f_cos / pdf.
//
// # Safety
// The arrays are null or as long as said.
enum oc_status oc_bsdf_sample(struct oc_bsdf *bsdf,
                              const float *u,
                              size_t n,
                              float *wi,
                              float *f_cos,
                              float *pdf,
                              uint32_t *flags);

// `oc_bsdf_sample` with everything a sample tells: `n` of `oc_sample`, `stride` bytes apart. `u`: three floats each,
// `u_stride` bytes apart.
//
// # Safety
// The arrays are null or reach as far as `n` and the strides say.
enum oc_status oc_bsdf_sample_strided(struct oc_bsdf *bsdf,
                                      const float *u,
                                      size_t u_stride,
                                      size_t n,
                                      struct oc_sample *samples,
                                      size_t stride);

// A quick estimate of what is reflected and transmitted toward the viewer in white surroundings, per channel, delta
// lobes included.
//
// # Safety
// `out` is null or has room for three floats.
enum oc_status oc_bsdf_albedo(struct oc_bsdf *bsdf,
                              float *out);

// Never below the albedo with the viewer, or the light, along `w` (world space, unit), per channel.
//
// # Safety
// `w` is null or points to three floats; `out` is null or has room for as many.
enum oc_status oc_bsdf_albedo_bound(struct oc_bsdf *bsdf, const float *w, float *out);

// Radiance given off toward the viewer, per channel.
//
// # Safety
// `out` is null or has room for three floats.
enum oc_status oc_bsdf_emission(struct oc_bsdf *bsdf, float *out);

// What goes straight through, per channel: what a shadow ray is multiplied by.
//
// # Safety
// `out` is null or has room for three floats.
enum oc_status oc_bsdf_transparency(struct oc_bsdf *bsdf, float *out);

// Every kind of scattering that may occur: a sum of `OC_REFLECT` to `OC_EMISSION`. Equal to `OC_DELTA` plus sides where
// light samples are wasted.
//
// # Safety
// `out` is null or has room for one number.
enum oc_status oc_bsdf_flags(struct oc_bsdf *bsdf,
                             uint32_t *out);

// Frees a BSDF; null is fine.
enum oc_status oc_bsdf_free(struct oc_bsdf *bsdf);

// Lets the scripts compiled from here on call a closure of the host. It parses, layers, is sampled and audited like a
// built-in one, and is kept until the process ends: register once, not per scene. The texts and parameters are copied.
//
// # Safety
// `closure` is null or points to an `oc_closure` whose texts end with 0 and whose `params` has `param_count` elements. Its
// callbacks and `user` may be used from any thread as long as the process lasts; they write no more than they are asked
// for, and neither unwind nor call the library.
enum oc_status oc_register_closure(struct oc_engine *engine,
                                   const struct oc_closure *closure);

// Makes an engine: standard tier, layering `OC_LAYERING_MIN`. To be freed with `oc_engine_free`.
//
// # Safety
// `engine` is null or has room for a handle.
enum oc_status oc_engine_new(struct oc_engine **engine);

// Frees an engine; null is fine. Its materials stay as they are.
enum oc_status oc_engine_free(struct oc_engine *engine);

// Chooses the tier of the materials compiled from here on: `OC_TIER_FAST` or `OC_TIER_STANDARD`.
enum oc_status oc_engine_set_tier(struct oc_engine *engine, uint32_t tier);

// Chooses how layers scale in the materials compiled from here on: one of `OC_LAYERING_…`.
enum oc_status oc_engine_set_layering(struct oc_engine *engine, uint32_t rule);

// Sets the directory in which `#include` looks for files, after that of the script. Replaces the one set before.
//
// # Safety
// `path` is null or a text that ends with 0.
enum oc_status oc_engine_set_include_dir(struct oc_engine *engine,
                                         const char *path);

// Says what the host answers the scripts compiled from here on. Replaces what was said before.
//
// # Safety
// `host` is null, which is an error, or points to an `oc_host` whose callback and `user` may be used from any thread, as
// long as the process lasts.
enum oc_status oc_engine_set_host(struct oc_engine *engine,
                                  const struct oc_host *host);

// The origin of a plane with its normal along z and u along x.
//
// # Safety
// `globals` is null or has room for an `oc_globals`.
enum oc_status oc_globals_default(struct oc_globals *globals);

// Compiles a script to a material with all parameters at their defaults. To be freed with `oc_material_free`; the engine
// may be freed before.
//
// `source`: `len` bytes of UTF-8, no closing 0 needed. `name`: in messages; null: `material`.
//
// # Safety
// `source` points to `len` bytes, `name` is null or ends with 0, `material` is null or has room for a handle.
enum oc_status oc_material_compile(struct oc_engine *engine,
                                   const char *source,
                                   size_t len,
                                   const char *name,
                                   struct oc_material **material);

// Frees a material; null is fine. BSDFs shaded from it stay as they are.
enum oc_status oc_material_free(struct oc_material *material);

// Sets a float parameter, or every component of a color or vector. Costs milliseconds, not nanoseconds: once per
// edit, not per point. Of two threads that set parameters of one material at once, one may undo what the other did.
//
// # Safety
// `name` is null or ends with 0.
enum oc_status oc_material_set_float(struct oc_material *material,
                                     const char *name,
                                     float value);

// Sets an int parameter: see `oc_material_set_float`.
//
// # Safety
// `name` is null or ends with 0.
enum oc_status oc_material_set_int(struct oc_material *material, const char *name, int32_t value);

// Sets a color parameter (linear RGB), or a vector, normal or point: see `oc_material_set_float`.
//
// # Safety
// `name` is null or ends with 0; `value` is null or points to three floats.
enum oc_status oc_material_set_color(struct oc_material *material,
                                     const char *name,
                                     const float *value);

// Sets a string parameter: see `oc_material_set_float`.
//
// # Safety
// `name` and `value` are null or end with 0.
enum oc_status oc_material_set_string(struct oc_material *material,
                                      const char *name,
                                      const char *value);

// Measures the material in white surroundings from thirty directions, seen from the viewer and from the light:
// `OC_ERROR_GAINS` if it gives back more than it receives, with the direction in the message. Takes seconds. The test for
// closures of your own, whose bound on the albedo is otherwise taken on trust.
enum oc_status oc_material_audit(struct oc_material *material);

// The BSDF of a material at a point, seen from `wo` (world space, unit, away from the surface).
//
// If `*bsdf` is null a BSDF is made, to be freed with `oc_bsdf_free`; otherwise the one that is there is used again,
// which saves the allocation. Keep one per thread. After `OC_ERROR_BUDGET` it is black.
//
// # Safety
// `globals` points to an `oc_globals`, `wo` to three floats, `bsdf` to a handle or null. Each may be null itself, which
// is an error.
enum oc_status oc_shade(struct oc_material *material,
                        const struct oc_globals *globals,
                        const float *wo,
                        struct oc_bsdf **bsdf);

// `OC_ABI_VERSION` of the library that is linked: compare it with the header's before anything else.
uint32_t oc_abi_version(void);

// f·|cos| per channel and the pdf for `n` directions; delta lobes left out. A direction that is not near unit length
// gives 0.
//
// `wi`: 3n floats. `f_cos`: receives 3n. `pdf`: receives n. They must not overlap.
//
// # Safety
// The arrays are null or as long as said.
enum oc_status oc_bsdf_eval(struct oc_bsdf *bsdf,
                            const float *wi,
                            size_t n,
                            float *f_cos,
                            float *pdf);

// `oc_bsdf_eval` for arrays whose elements (three floats, three floats, one float) lie so many bytes apart: fields of
// structs, for example.
//
// # Safety
// The arrays are null or reach as far as `n` and the strides say.
enum oc_status oc_bsdf_eval_strided(struct oc_bsdf *bsdf,
                                    const float *wi,
                                    size_t wi_stride,
                                    size_t n,
                                    float *f_cos,
                                    size_t f_cos_stride,
                                    float *pdf,
                                    size_t pdf_stride);

// Draws `n` directions; a sample that scatters nothing has pdf 0.
//
// `u`: 3n uniform numbers in [0, 1). `wi`, `f_cos`: receive 3n floats, `pdf`: n. `flags`: receives n, as in `oc_sample`; or
// null. They must not overlap. The weight of a sample is f_cos / pdf.
//
// # Safety
// The arrays are null or as long as said.
enum oc_status oc_bsdf_sample(struct oc_bsdf *bsdf,
                              const float *u,
                              size_t n,
                              float *wi,
                              float *f_cos,
                              float *pdf,
                              uint32_t *flags);

// `oc_bsdf_sample` with everything a sample tells: `n` of `oc_sample`, `stride` bytes apart. `u`: three floats each,
// `u_stride` bytes apart.
//
// # Safety
// The arrays are null or reach as far as `n` and the strides say.
enum oc_status oc_bsdf_sample_strided(struct oc_bsdf *bsdf,
                                      const float *u,
                                      size_t u_stride,
                                      size_t n,
                                      struct oc_sample *samples,
                                      size_t stride);

// A quick estimate of what is reflected and transmitted toward the viewer in white surroundings, per channel, delta
// lobes included.
//
// # Safety
// `out` is null or has room for three floats.
enum oc_status oc_bsdf_albedo(struct oc_bsdf *bsdf,
                              float *out);

// Never below the albedo with the viewer, or the light, along `w` (world space, unit), per channel.
//
// # Safety
// `w` is null or points to three floats; `out` is null or has room for as many.
enum oc_status oc_bsdf_albedo_bound(struct oc_bsdf *bsdf, const float *w, float *out);

// Radiance given off toward the viewer, per channel.
//
// # Safety
// `out` is null or has room for three floats.
enum oc_status oc_bsdf_emission(struct oc_bsdf *bsdf, float *out);

// What goes straight through, per channel: what a shadow ray is multiplied by.
//
// # Safety
// `out` is null or has room for three floats.
enum oc_status oc_bsdf_transparency(struct oc_bsdf *bsdf, float *out);

// Every kind of scattering that may occur: a sum of `OC_REFLECT` to `OC_EMISSION`. Equal to `OC_DELTA` plus sides where
// light samples are wasted.
//
// # Safety
// `out` is null or has room for one number.
enum oc_status oc_bsdf_flags(struct oc_bsdf *bsdf,
                             uint32_t *out);

// Frees a BSDF; null is fine.
enum oc_status oc_bsdf_free(struct oc_bsdf *bsdf);

// Lets the scripts compiled from here on call a closure of the host. It parses, layers, is sampled and audited like a
// built-in one, and is kept until the process ends: register once, not per scene. The texts and parameters are copied.
//
// # Safety
// `closure` is null or points to an `oc_closure` whose texts end with 0 and whose `params` has `param_count` elements. Its
// callbacks and `user` may be used from any thread as long as the process lasts; they write no more than they are asked
// for, and neither unwind nor call the library.
enum oc_status oc_register_closure(struct oc_engine *engine,
                                   const struct oc_closure *closure);

// Makes an engine: standard tier, layering `OC_LAYERING_MIN`. To be freed with `oc_engine_free`.
//
// # Safety
// `engine` is null or has room for a handle.
enum oc_status oc_engine_new(struct oc_engine **engine);

// Frees an engine; null is fine. Its materials stay as they are.
enum oc_status oc_engine_free(struct oc_engine *engine);

// Chooses the tier of the materials compiled from here on: `OC_TIER_FAST` or `OC_TIER_STANDARD`.
enum oc_status oc_engine_set_tier(struct oc_engine *engine, uint32_t tier);

// Chooses how layers scale in the materials compiled from here on: one of `OC_LAYERING_…`.
enum oc_status oc_engine_set_layering(struct oc_engine *engine, uint32_t rule);

// Sets the directory in which `#include` looks for files, after that of the script. Replaces the one set before.
//
// # Safety
// `path` is null or a text that ends with 0.
enum oc_status oc_engine_set_include_dir(struct oc_engine *engine,
                                         const char *path);

// Says what the host answers the scripts compiled from here on. Replaces what was said before.
//
// # Safety
// `host` is null, which is an error, or points to an `oc_host` whose callback and `user` may be used from any thread, as
// long as the process lasts.
enum oc_status oc_engine_set_host(struct oc_engine *engine,
                                  const struct oc_host *host);

// The origin of a plane with its normal along z and u along x.
//
// # Safety
// `globals` is null or has room for an `oc_globals`.
enum oc_status oc_globals_default(struct oc_globals *globals);

// Compiles a script to a material with all parameters at their defaults. To be freed with `oc_material_free`; the engine
// may be freed before.
//
// `source`: `len` bytes of UTF-8, no closing 0 needed. `name`: in messages; null: `material`.
//
// # Safety
// `source` points to `len` bytes, `name` is null or ends with 0, `material` is null or has room for a handle.
enum oc_status oc_material_compile(struct oc_engine *engine,
                                   const char *source,
                                   size_t len,
                                   const char *name,
                                   struct oc_material **material);

// Frees a material; null is fine. BSDFs shaded from it stay as they are.
enum oc_status oc_material_free(struct oc_material *material);

// Sets a float parameter, or every component of a color or vector. Costs milliseconds, not nanoseconds: once per
// edit, not per point. Of two threads that set parameters of one material at once, one may undo what the other did.
//
// # Safety
// `name` is null or ends with 0.
enum oc_status oc_material_set_float(struct oc_material *material,
                                     const char *name,
                                     float value);

// Sets an int parameter: see `oc_material_set_float`.
//
// # Safety
// `name` is null or ends with 0.
enum oc_status oc_material_set_int(struct oc_material *material, const char *name, int32_t value);

// Sets a color parameter (linear RGB), or a vector, normal or point: see `oc_material_set_float`.
//
// # Safety
// `name` is null or ends with 0; `value` is null or points to three floats.
enum oc_status oc_material_set_color(struct oc_material *material,
                                     const char *name,
                                     const float *value);

// Sets a string parameter: see `oc_material_set_float`.
//
// # Safety
// `name` and `value` are null or end with 0.
enum oc_status oc_material_set_string(struct oc_material *material,
                                      const char *name,
                                      const char *value);

// Measures the material in white surroundings from thirty directions, seen from the viewer and from the light:
// `OC_ERROR_GAINS` if it gives back more than it receives, with the direction in the message. Takes seconds. The test for
// closures of your own, whose bound on the albedo is otherwise taken on trust.
enum oc_status oc_material_audit(struct oc_material *material);

// The BSDF of a material at a point, seen from `wo` (world space, unit, away from the surface).
//
// If `*bsdf` is null a BSDF is made, to be freed with `oc_bsdf_free`; otherwise the one that is there is used again,
// which saves the allocation. Keep one per thread. After `OC_ERROR_BUDGET` it is black.
//
// # Safety
// `globals` points to an `oc_globals`, `wo` to three floats, `bsdf` to a handle or null. Each may be null itself, which
// is an error.
enum oc_status oc_shade(struct oc_material *material,
                        const struct oc_globals *globals,
                        const float *wo,
                        struct oc_bsdf **bsdf);

// The message of the last call of this thread that failed: what is wrong, and for scripts where, with the source line.
// Writes at most `len` bytes with the closing 0 to `buffer` (UTF-8, cut between characters); returns the length of the
// whole message without the 0. A null `buffer` only asks for that length.
//
// # Safety
// `buffer` is null or has room for `len` bytes.
size_t oc_last_error(char *buffer,
                     size_t len);

// The message of the last call of this thread that failed: what is wrong, and for scripts where, with the source line.
// Writes at most `len` bytes with the closing 0 to `buffer` (UTF-8, cut between characters); returns the length of the
// whole message without the 0. A null `buffer` only asks for that length.
//
// # Safety
// `buffer` is null or has room for `len` bytes.
size_t oc_last_error(char *buffer,
                     size_t len);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OVERCOAT_H */
