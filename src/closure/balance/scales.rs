//! The table of a solved scale, and how evaluation reads it.

use crate::lobes::Rgb;
use crate::optics::{Over, Scalar, array};

/// s over μ = x⁴ at uniform x, for a row per weight and parameter of the top.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scales<S> {
    /// One block per channel; in it a row of `nodes` values per weight, for every parameter.
    pub values: Vec<S>,
    pub nodes: usize,
    /// 1 where they do not vary.
    pub weights: usize,
    pub params: usize,
    /// 1 if all channels are alike, else 3.
    pub channels: usize,
    /// √ of the lowest parameter, and 1/(√hi − √lo).
    pub lo: S,
    pub inv_range: S,
}

/// Where between the rows of a table a point lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row<S> {
    first: u32,
    weight: S,
    param: S,
}

/// The weight of row `i` of `rows`: graded toward 1, where the top takes all and s changes fastest.
pub(super) fn weight_at(i: usize, rows: usize) -> f64 {
    1.0 - (1.0 - i as f64 / (rows - 1) as f64).powi(2)
}

/// The cosine at `x` in [0, 1] along a row. The horizon itself, where a one-sided lobe is black, is approached only.
pub(super) fn cosine_at(x: f64) -> f64 {
    x.powi(4).max(1e-12)
}

impl<S: Scalar> Scales<S> {
    /// The row for a top of weight `w`, its parameter at `p`; what does not vary is ignored.
    pub fn row(&self, w: S, p: S) -> Row<S> {
        let (i, mut weight) = cell(S::one() - (S::one() - w).safe_sqrt(), self.weights);
        if self.weights > 1 {
            let (a, b) = (weight_at(i, self.weights), weight_at(i + 1, self.weights));
            weight = ((w - S::c(a)) * S::c(1.0 / (b - a))).clamp(S::zero(), S::one());
        }
        let (j, param) = cell((p.safe_sqrt() - self.lo) * self.inv_range, self.params);
        Row { first: (j * self.weights + i) as u32, weight, param }
    }

    /// s at `cos`, per channel.
    #[inline(always)]
    pub fn read<L: Over<S>>(&self, row: Row<S>, cos: L) -> Rgb<L> {
        let x = cos.clamp(L::zero(), L::one()).sqrt().sqrt() * L::c((self.nodes - 1) as f64);
        let i = x.floor().min(L::c((self.nodes - 2) as f64));
        let t = x - i;
        let mut channels = [L::zero(); 3];
        for c in 0..self.channels {
            let first = c * self.weights * self.params + row.first as usize;
            let a = self.over_weight(row, first, i, t);
            channels[c] = if self.params == 1 {
                a
            } else {
                (self.over_weight(row, first + self.weights, i, t) - a).mul_add(L::lift(row.param), a)
            };
        }
        if self.channels == 1 { [channels[0]; 3] } else { channels }
    }

    /// Between the rows `first` and the next by the weight; `i` and `t` are the place along them.
    #[inline(always)]
    fn over_weight<L: Over<S>>(&self, row: Row<S>, first: usize, i: L, t: L) -> L {
        let start = |row: usize| i + L::c((row * self.nodes) as f64);
        let a = L::between(&self.values, start(first), t);
        if self.weights == 1 {
            a
        } else {
            (L::between(&self.values, start(first + 1), t) - a).mul_add(L::lift(row.weight), a)
        }
    }

    pub fn cast<T: Scalar>(&self) -> Scales<T> {
        let &Scales { nodes, weights, params, channels, .. } = self;
        let values = self.values.iter().map(|v| T::c(v.to_f64())).collect();
        let [lo, inv_range] = [self.lo, self.inv_range].map(|x| T::c(x.to_f64()));
        Scales { values, nodes, weights, params, channels, lo, inv_range }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.values)
    }
}

/// Cell and fraction for `x` in [0, 1] over `count` uniform nodes.
fn cell<S: Scalar>(x: S, count: usize) -> (usize, S) {
    if count < 2 {
        return (0, S::zero());
    }
    let x = x.clamp(S::zero(), S::one()) * S::c((count - 1) as f64);
    let i = x.floor().min(S::c((count - 2) as f64));
    (i.to_f64() as usize, x - i)
}

/// The scale of one lobe, read for one ωo.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Balanced<'m, S> {
    scales: &'m Scales<S>,
    row: Row<S>,
    toward_viewer: Rgb<S>,
}

impl<'m, S: Scalar> Balanced<'m, S> {
    pub(super) fn new(scales: &'m Scales<S>, row: Row<S>, cos_o: S) -> Self {
        Balanced { scales, row, toward_viewer: scales.read(row, cos_o) }
    }

    /// s(ωo)·s(ωi) for the cosine of ωi. Of a single direction apart: walks without it stay short.
    #[inline(always)]
    pub fn scale<L: Over<S>>(&self, cos: L) -> Rgb<L> {
        if L::WIDE { self.product(cos) } else { self.scale_apart(cos) }
    }

    #[inline(never)]
    fn scale_apart<L: Over<S>>(&self, cos: L) -> Rgb<L> {
        self.product(cos)
    }

    #[inline(always)]
    fn product<L: Over<S>>(&self, cos: L) -> Rgb<L> {
        let s = self.scales.read(self.row, cos);
        array(|c| L::lift(self.toward_viewer[c]) * s[c])
    }
}
