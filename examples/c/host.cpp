// A C++ host: handles owned by unique_ptr, statuses turned into exceptions, batches over the host's own structs.
//
//     sh examples/c/run.sh
#include <overcoat.h>

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

void check(oc_status status) {
    if (status == OC_OK) return;
    std::string message(oc_last_error(nullptr, 0) + 1, '\0');
    oc_last_error(message.data(), message.size());
    throw std::runtime_error(message);
}

struct Free {
    void operator()(oc_engine *e) const { oc_engine_free(e); }
    void operator()(oc_material *m) const { oc_material_free(m); }
    void operator()(oc_bsdf *b) const { oc_bsdf_free(b); }
};
using Engine = std::unique_ptr<oc_engine, Free>;
using Material = std::unique_ptr<oc_material, Free>;
using Bsdf = std::unique_ptr<oc_bsdf, Free>;

Material compile(const Engine &engine, const std::string &source, const char *name) {
    oc_material *material = nullptr;
    check(oc_material_compile(engine.get(), source.data(), source.size(), name, &material));
    return Material(material);
}

// A light as this host keeps it: what the library reads and writes lies between fields it never sees.
struct Light {
    int id;
    float direction[3];
    float f_cos[3];
    float pdf;
    double importance;
};

int run() {
    oc_engine *made = nullptr;
    check(oc_engine_new(&made));
    Engine engine(made);
    check(oc_engine_set_layering(engine.get(), OC_LAYERING_BALANCED));
    Material cloth = compile(engine, "Ci = sheen(0.8 * diffuse(N), N, color(1, 0.9, 0.8), 0.5);", "cloth.osl");

    oc_globals globals;
    check(oc_globals_default(&globals));
    const float wo[3] = {0.0f, 0.6f, 0.8f};
    oc_bsdf *shaded = nullptr;
    check(oc_shade(cloth.get(), &globals, wo, &shaded));
    Bsdf bsdf(shaded);

    std::vector<Light> lights(100);
    for (int k = 0; k < 100; k++) {
        const float x = 0.008f * static_cast<float>(k);
        lights[k] = Light{k, {x, 0.0f, 1.0f - 0.625f * x * x}, {0, 0, 0}, 0, 1};
    }
    check(oc_bsdf_eval_strided(bsdf.get(), lights[0].direction, sizeof(Light), lights.size(), lights[0].f_cos,
                               sizeof(Light), &lights[0].pdf, sizeof(Light)));
    std::printf("light 0: f cos %.4f, light 99: f cos %.4f\n", lights[0].f_cos[0], lights[99].f_cos[0]);
    if (!(lights[0].f_cos[0] > 0 && lights[99].pdf > 0 && lights[50].id == 50)) return 1;

    const float u[6] = {0.1f, 0.5f, 0.9f, 0.7f, 0.2f, 0.3f};
    oc_sample samples[2];
    check(oc_bsdf_sample_strided(bsdf.get(), u, 3 * sizeof(float), 2, samples, sizeof(oc_sample)));
    if (!(samples[0].pdf > 0 && samples[1].flags == (OC_REFLECT | OC_DIFFUSE))) return 1;

    // Mistakes carry their place.
    try {
        compile(engine, "Ci = difuse(N);", "typo.osl");
        return 1;
    } catch (const std::runtime_error &e) {
        const std::string message = e.what();
        if (message.find("typo.osl:1:6") == std::string::npos) return 1;
        std::printf("%s\n", e.what());
    }
    return 0;
}

}  // namespace

int main() {
    try {
        return run();
    } catch (const std::exception &e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
