//! What a facet of a rough surface does with light: what the tables of [`super::facets`] are asked for.

use crate::optics::fresnel;
use crate::optics::microfacet::Shape;

/// The narrowest surface, and the most one width may exceed the other.
pub const MIN_ALPHA: f64 = 1e-4;
/// See [`MIN_ALPHA`].
pub const MAX_STRETCH: f64 = 64.0;
/// Most components beside the total.
pub const PARTS: usize = 6;
/// What a reflectance depends on beside the cosine.
pub type FacetKey = [f64; 8];

/// What a facet does with light.
#[derive(Clone, Copy, Debug)]
pub enum Facet {
    /// Reflects all. Beside the total the table holds what is reflected under these reflectances, at the cosine between
    /// direction and facet.
    Mirror {
        /// The reflectances.
        reflectance: fn(&FacetKey, f64) -> [f64; 3],
        /// What it is given.
        key: FacetKey,
        /// How many of them are in use.
        parts: usize,
    },
    /// Reflects or refracts; the table has two parts, reflected and refracted, and two sheets, above and below.
    Dielectric {
        /// Index below over index above.
        eta: f64,
    },
    /// The same with a reflectance of its own per channel, at the cosine above the surface; six parts, reflected per channel,
    /// then refracted. What is totally reflected stays so.
    Colored {
        /// Index below over index above.
        eta: f64,
        /// The reflectances.
        reflectance: fn(&FacetKey, f64) -> [f64; 3],
        /// What it is given.
        key: FacetKey,
    },
}

impl Facet {
    /// Sheets of a table, and parts where the widths are known.
    pub(super) fn size(&self) -> (usize, usize) {
        match self {
            Facet::Mirror { parts, .. } => (1, *parts),
            Facet::Dielectric { .. } => (2, 2),
            Facet::Colored { .. } => (2, PARTS),
        }
    }

    /// Index of what lies beyond over that of the side of `w`; `None` for a mirror.
    pub(super) fn beyond(&self, below: bool) -> Option<f64> {
        match self {
            Facet::Mirror { .. } => None,
            Facet::Dielectric { eta } | Facet::Colored { eta, .. } => Some(if below { 1.0 / eta } else { *eta }),
        }
    }

    /// The total and the parts for a facet seen at the cosine `c` that passes on `reflected` if it mirrors and `refracted` if it
    /// refracts, at the cosine `bent`, which is `None` where nothing is refracted. `below`: seen from below.
    pub(super) fn parts(&self, below: bool, (c, reflected): (f64, f64), bent: Option<(f64, f64)>) -> [f64; PARTS + 1] {
        let refracted = bent.map_or(0.0, |b| b.1);
        let mut parts = [0.0; PARTS + 1];
        match self {
            Facet::Mirror { reflectance, key, parts: count } => {
                parts[0] = reflected;
                if *count > 0 {
                    parts[1..4].copy_from_slice(&reflectance(key, c).map(|f| f * reflected));
                }
            }
            Facet::Dielectric { eta } => {
                let eta = if below { 1.0 / eta } else { *eta };
                let f = fresnel::dielectric((eta - 1.0) * (eta + 1.0), c);
                parts[1..3].copy_from_slice(&[f * reflected, (1.0 - f) * refracted]);
                parts[0] = parts[1] + parts[2];
            }
            Facet::Colored { reflectance, key, .. } => {
                let above = if below { bent.map(|b| b.0) } else { Some(c) };
                let f = if bent.is_some() { above.map_or([1.0; 3], |c| reflectance(key, c)) } else { [1.0; 3] };
                for i in 0..3 {
                    parts[1 + i] = f[i] * reflected;
                    parts[4 + i] = (1.0 - f[i]) * refracted;
                }
                // The largest channel, once it is integrated: see `total`.
                parts[0] = 0.0;
            }
        }
        parts
    }

    /// Completes integrals of [`parts`](Self::parts): values, and how far off they may be.
    pub(super) fn total(&self, mut sums: [(f64, f64); PARTS + 1]) -> [(f64, f64); PARTS + 1] {
        if let Facet::Colored { .. } = self {
            let channel = |i: usize| (sums[1 + i].0 + sums[4 + i].0, sums[1 + i].1 + sums[4 + i].1);
            sums[0] = (0..3).map(channel).fold((0.0, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        }
        sums
    }
}

/// What to bake for a rough surface.
#[derive(Clone, Copy, Debug)]
pub struct FacetSpec {
    /// The distribution of slopes.
    pub shape: Shape,
    /// Widths along x and y; `None` where they vary: then the table is over one α, and has no parts.
    pub alpha: Option<[f64; 2]>,
    /// What a facet does.
    pub facet: Facet,
}

impl PartialEq for FacetSpec {
    fn eq(&self, o: &Self) -> bool {
        let facets = match (self.facet, o.facet) {
            (Facet::Mirror { reflectance: f, key, parts }, Facet::Mirror { reflectance: g, key: k, parts: p }) => {
                parts == p && (parts == 0 || (std::ptr::fn_addr_eq(f, g) && key == k))
            }
            (Facet::Dielectric { eta }, Facet::Dielectric { eta: e }) => eta == e,
            (Facet::Colored { eta, reflectance: f, key }, Facet::Colored { eta: e, reflectance: g, key: k }) => {
                eta == e && std::ptr::fn_addr_eq(f, g) && key == k
            }
            _ => false,
        };
        facets && self.shape == o.shape && self.alpha == o.alpha
    }
}

/// For [`Facet::Mirror`]: no reflectance.
pub fn white(_: &FacetKey, _: f64) -> [f64; 3] {
    [1.0; 3]
}
