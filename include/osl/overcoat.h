// The closures that stdosl.h lacks. Made by `overcoat lobes --header`; do not edit.

#ifndef OVERCOAT_H
#define OVERCOAT_H

#ifndef BUILTIN
#define BUILTIN [[ int builtin = 1 ]]
#endif

// Woven cloth whose threads run along T: a highlight in a cone about them.
closure color fabric(normal N, vector T, float roughness) BUILTIN;
// Dielectric threads lying along T: a streak of surface reflection and colored light from inside.
closure color thread(normal N, vector T, color A, float eta, float kd, float gamma_s, float gamma_v) BUILTIN;
// Woven cloth of two families of dielectric threads, one along T, one across it.
closure color microcylinder(normal N, vector T, string preset) BUILTIN;
// Woven cloth of two families of dielectric threads, one along T, one across it, parameter by parameter.
closure color microcylinder_threads(normal N, vector T, color A1, float eta1, float kd1, float gamma_s1, float gamma_v1, float a1, float offset1, color A2, float eta2, float kd2, float gamma_s2, float gamma_v2, float a2, float offset2) BUILTIN;
// Velvet after Ashikhmin: an even body with a rim toward grazing angles.
closure color velvet(normal N, float roughness) BUILTIN;
// Rough diffuse reflection that loses no energy: what bounces between the facets is added back.
closure color eon(normal N, color albedo, float roughness) BUILTIN;
// Reflection by a metal's facets, the metal given by its colors.
closure color metal(normal N, vector U, float roughness_x, float roughness_y, color reflectivity, color edge_tint, string distribution) BUILTIN;
// Woven cloth of two families of dielectric threads, one along T, one across it, parameter by parameter.
closure color microcylinder(normal N, vector T, color A1, float eta1, float kd1, float gamma_s1, float gamma_v1, float a1, float offset1, color A2, float eta2, float kd2, float gamma_s2, float gamma_v2, float a2, float offset2) BUILTIN;
// Sheen layered over a closure: `layer(tint * sheen_bsdf(N, 1, roughness), base)`.
closure color sheen(closure color base, normal N, color tint, float roughness) BUILTIN;
// The bare sheen lobe: `sheen_bsdf(N, 1, roughness)`.
closure color sheen(normal N, float roughness) BUILTIN;
// `microfacet("ggx", N, 0, alpha, alpha, 0, 0)`, as Cycles calls it.
closure color microfacet_ggx(normal N, float alpha) BUILTIN;
// `microfacet("beckmann", N, 0, alpha, alpha, 0, 0)`, as Cycles calls it.
closure color microfacet_beckmann(normal N, float alpha) BUILTIN;
// `microfacet("ggx", N, 0, alpha, alpha, eta, 0)`, as early OSL calls it.
closure color microfacet_ggx(normal N, float alpha, float eta) BUILTIN;
// `microfacet("beckmann", N, 0, alpha, alpha, eta, 0)`, as early OSL calls it.
closure color microfacet_beckmann(normal N, float alpha, float eta) BUILTIN;
// `microfacet("ggx", N, T, xalpha, yalpha, 0, 0)`, as Cycles calls it.
closure color microfacet_ggx_aniso(normal N, vector T, float xalpha, float yalpha) BUILTIN;
// `microfacet("beckmann", N, T, xalpha, yalpha, 0, 0)`, as Cycles calls it.
closure color microfacet_beckmann_aniso(normal N, vector T, float xalpha, float yalpha) BUILTIN;
// `microfacet("ggx", N, 0, alpha, alpha, eta, 1)`, as Cycles calls it.
closure color microfacet_ggx_refraction(normal N, float alpha, float eta) BUILTIN;
// `microfacet("beckmann", N, 0, alpha, alpha, eta, 1)`, as Cycles calls it.
closure color microfacet_beckmann_refraction(normal N, float alpha, float eta) BUILTIN;
// `microfacet("multi_ggx", N, 0, alpha, alpha, 0, 0)`, as Cycles calls it.
closure color microfacet_multi_ggx(normal N, float alpha, color C) BUILTIN;
// `microfacet("multi_ggx", N, T, xalpha, yalpha, 0, 0)`, as Cycles calls it.
closure color microfacet_multi_ggx_aniso(normal N, vector T, float xalpha, float yalpha, color C) BUILTIN;
// `microfacet("multi_ggx", N, 0, alpha, alpha, eta, 2)`, as Cycles calls it.
closure color microfacet_multi_ggx_glass(normal N, float alpha, float eta, color C) BUILTIN;
// `generalized_schlick_bsdf(N, T, 1, 0, xalpha, yalpha, f0, f90, 5, distribution)`, nearly as Cycles has it.
closure color microfacet_aniso_fresnel(normal N, vector T, float xalpha, float yalpha, color f0, color f90, float eta, string distribution) BUILTIN;
// `velvet(N, sigma)`, nearly as Cycles has it.
closure color ashikhmin_velvet(normal N, float sigma) BUILTIN;
// `subsurface_bssrdf(N, albedo, radius, 0)`, as Cycles calls it.
closure color bssrdf(string method, normal N, vector radius, color albedo) BUILTIN;

#endif
