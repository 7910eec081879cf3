/* A C host: a script becomes a material, a point is shaded, its BSDF evaluated and sampled; then a closure of the host's
 * own, layered under a built-in one and audited.
 *
 *     sh examples/c/run.sh
 */
#include <overcoat.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char velvet[] =
    "surface velvet(color ground = color(0.6, 0.02, 0.05), float roughness = 0.3)\n"
    "{\n"
    "    Ci = ground * diffuse(N);\n"
    "    Ci = sheen(Ci, N, color(1), roughness);\n"
    "}\n";

/* Ends the program with the library's message if a call fails. */
static void check(oc_status status)
{
    char message[2000];
    if (status == OC_OK)
        return;
    oc_last_error(message, sizeof message);
    fprintf(stderr, "overcoat: error %d: %s\n", (int)status, message);
    exit(1);
}

/* A uniform number in [0, 1), good enough for an example. */
static float uniform(void)
{
    static unsigned state = 1;
    state = state * 1664525u + 1013904223u;
    return (float)(state >> 8) / 16777216.0f;
}

/* A closure of the host's: chalk, w/pi on the side of the normal. Its values: N (3), w (1). */
static void chalk(void *user, const float *values, const double *wo, const double *wi, double *out)
{
    double f = wo[2] > 0 && wi[2] > 0 ? values[3] / 3.14159265358979 : 0;
    (void)user;
    out[0] = out[1] = out[2] = f;
}

static void chalk_bound(void *user, const float *values, const double *w, double *out)
{
    (void)user;
    out[0] = out[1] = out[2] = w[2] > 0 ? values[3] : 0;
}

static void register_chalk(oc_engine *engine)
{
    oc_closure_param params[2];
    oc_closure closure;
    memset(params, 0, sizeof params);
    memset(&closure, 0, sizeof closure);
    params[0].name = "N";
    params[0].kind = OC_PARAM_NORMAL;
    params[1].name = "w";
    params[1].kind = OC_PARAM_FLOAT;
    params[1].default_value[0] = 0.8f;
    params[1].max = 1;
    closure.name = "chalk";
    closure.params = params;
    closure.param_count = 2;
    closure.f = chalk;
    closure.albedo_bound = chalk_bound;
    check(oc_register_closure(engine, &closure));
}

int main(void)
{
    enum { count = 10000 };
    const float wo[3] = {0.6f, 0, 0.8f}, toward_light[3] = {0, 0.6f, 0.8f}, blue[3] = {0.05f, 0.1f, 0.6f};
    oc_engine *engine = NULL;
    oc_material *material = NULL, *dusty = NULL;
    oc_bsdf *bsdf = NULL;
    oc_globals globals;
    float f_cos[3], pdf, albedo[3], sum = 0;
    float *u = malloc(count * sizeof *u * 3), *wi = malloc(count * sizeof *wi * 3);
    float *weights = malloc(count * sizeof *weights * 3), *pdfs = malloc(count * sizeof *pdfs);
    int k;

    if (oc_abi_version() != OC_ABI_VERSION || !u || !wi || !weights || !pdfs)
        return 1;

    /* Once per material. */
    check(oc_engine_new(&engine));
    check(oc_material_compile(engine, velvet, strlen(velvet), "velvet.osl", &material));
    check(oc_material_set_float(material, "roughness", 0.5f));
    check(oc_material_set_color(material, "ground", blue));

    /* Once per shading point. */
    check(oc_globals_default(&globals));
    check(oc_shade(material, &globals, wo, &bsdf));

    /* A light sample. */
    check(oc_bsdf_eval(bsdf, toward_light, 1, f_cos, &pdf));
    printf("toward the light: f cos %.4f %.4f %.4f, pdf %.4f\n", f_cos[0], f_cos[1], f_cos[2], pdf);

    /* Many BSDF samples at once: their weights average to the albedo. */
    for (k = 0; k < 3 * count; k++)
        u[k] = uniform();
    check(oc_bsdf_sample(bsdf, u, count, wi, weights, pdfs, NULL));
    for (k = 0; k < count; k++)
        if (pdfs[k] > 0)
            sum += weights[3 * k + 2] / pdfs[k];
    check(oc_bsdf_albedo(bsdf, albedo));
    printf("blue albedo: %.3f by sampling, %.3f estimated\n", sum / count, albedo[2]);
    if (sum / count > albedo[2] + 0.02f)
        return 1;

    /* A closure of the host's own, in a script of its own. */
    register_chalk(engine);
    check(oc_material_compile(engine, "Ci = sheen(chalk(N, 0.9), N, 1, 0.4);", 37, "dusty.osl", &dusty));
    check(oc_material_audit(dusty));
    check(oc_shade(dusty, &globals, wo, &bsdf)); /* the same BSDF again: no allocation but for the new material */
    check(oc_bsdf_albedo(bsdf, albedo));
    printf("dusty chalk: albedo %.3f, gains nothing\n", albedo[0]);

    check(oc_bsdf_free(bsdf));
    check(oc_material_free(material));
    check(oc_material_free(dusty));
    check(oc_engine_free(engine));
    free(u);
    free(wi);
    free(weights);
    free(pdfs);
    return 0;
}
