//! Metals by their colors: facing, and toward the edge.
//!
//! n and k follow from both (Gulbrandsen 2014), and the rest is [`super::conductor`]: a dark edge tint makes the rim whiten
//! late, a pale one keeps the facing color. Gold is about (1, 0.78, 0.34) with an edge tint of (1, 0.9, 0.6).
//!
//! Where this departs from the source: reflectivity counts as at most 0.99; roughness is used as the width α of the slopes.

use super::conductor::{Conductor, ConductorParams};
use super::lobe::keeps_that_of;
use super::registry::{ClosureParams, closure};
use super::rough::{ReflectorSeen, widths};
use super::{Evaluated, Lobe, Rgb};
use crate::albedo::{AlbedoCurve, TableSpec};
use crate::optics::{Over, Real, V3, fresnel};

closure! {
    /// Reflection by a metal's facets, the metal given by its colors. One-sided.
    closure "metal" as MetalParams {
        /// Shading normal.
        normal N;
        /// Direction that `roughness_x` is measured along.
        vector U;
        /// Width of the facets' slopes (α) along U.
        float roughness_x = 0.3, in (1e-4, 1.0);
        /// Width of the slopes across U.
        float roughness_y = 0.3, in (1e-4, 1.0);
        /// Reflectance facing (paper: r).
        color reflectivity = [0.95, 0.64, 0.54], in (0.0, 0.99);
        /// Tint toward the edge (paper: g): 0 whitens late, 1 keeps the color.
        color edge_tint = [0.8, 0.8, 0.8], in (0.0, 1.0);
        /// Distribution of the slopes; "default" and "multi_ggx" are "ggx".
        string distribution = 0.0, in (0.0, 3.0), of ["ggx", "beckmann", "default", "multi_ggx"];
        /// Thickness of a film on the metal, in nanometres; 0: none.
        @keyword float thinfilm_thickness = 0.0, in (0.0, 2000.0);
        /// Index of refraction of the film.
        @keyword float thinfilm_ior = 1.5, in (1.0, 4.0);
    }
    source: "Gulbrandsen 2014; Born & Wolf, §14.2; Kulla & Conty 2017",
    reciprocal: true,
    class: Scatter,
}

/// See [`MetalParams`].
#[derive(Clone, Copy, Debug)]
pub struct Metal<S> {
    metal: Conductor<S>,
}

keeps_that_of!(Metal { metal: ReflectorSeen });

impl<S: Real> Lobe<S> for Metal<S> {
    type Params = MetalParams;
    type Aimed = ReflectorSeen<S>;

    fn roughness(&self) -> S {
        Lobe::roughness(&self.metal)
    }

    fn table(values: &[Option<f32>]) -> Option<TableSpec> {
        let mut block = values.to_vec();
        let color = |at: usize, param: usize| -> Option<[f32; 3]> {
            let spec = &MetalParams::SPEC.params[param];
            let mut color = [0.0; 3];
            for (c, color) in color.iter_mut().enumerate() {
                *color = spec.clamp(c, values[at + c]?);
            }
            Some(color)
        };
        let known = color(8, 4).zip(color(11, 5)).map(|(r, g)| fresnel::artistic_ior(r, g));
        for c in 0..3 {
            block[8 + c] = known.map(|k| k.0[c]);
            block[11 + c] = known.map(|k| k.1[c]);
        }
        <Conductor<S> as Lobe<S>>::table(&block)
    }

    fn follows_tangent(params: &MetalParams) -> bool {
        let [x, y] = widths([params.roughness_x, params.roughness_y]);
        x != y
    }

    fn new(params: &MetalParams, wo: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Self {
        let MetalParams { N, U, roughness_x, roughness_y, reflectivity, edge_tint, distribution, .. } = *params;
        let (ior, extinction) = fresnel::artistic_ior(reflectivity, edge_tint);
        let MetalParams { thinfilm_thickness, thinfilm_ior, .. } = *params;
        let params = ConductorParams {
            N,
            U,
            roughness_x,
            roughness_y,
            ior,
            extinction,
            distribution,
            thinfilm_thickness,
            thinfilm_ior,
        };
        Metal { metal: Conductor::new(&params, wo, curve) }
    }

    #[inline(always)]
    fn f<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.metal.f(wi, curve)
    }

    #[inline(always)]
    fn pdf<L: Over<S>>(&self, wi: V3<L>) -> L {
        self.metal.pdf(wi)
    }

    #[inline(always)]
    fn evaluate<L: Over<S>>(&self, wi: V3<L>, curve: &AlbedoCurve<S::Entry>, bound: bool) -> Evaluated<L> {
        self.metal.evaluate(wi, curve, bound)
    }

    fn sample(&self, u: [S; 2]) -> V3<S> {
        self.metal.sample(u)
    }

    fn albedo(&self, w: V3<S>, curve: &AlbedoCurve<S::Entry>) -> Rgb<S> {
        self.metal.albedo(w, curve)
    }

    #[inline(always)]
    fn albedo_bound<L: Over<S>>(&self, w: V3<L>, curve: &AlbedoCurve<S::Entry>) -> Rgb<L> {
        self.metal.albedo_bound(w, curve)
    }
}
