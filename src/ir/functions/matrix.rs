//! Matrices of four rows; points and vectors are rows on their left, as OSL has it.

/// Sixteen floats, rows first.
pub type Matrix = [f32; 16];

/// Leaves everything where it is.
pub const IDENTITY: Matrix = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

/// First a, then b.
pub fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|at| (0..4).map(|k| a[at / 4 * 4 + k] * b[k * 4 + at % 4]).sum())
}

/// Rows as columns.
pub fn transpose(m: &Matrix) -> Matrix {
    std::array::from_fn(|at| m[at % 4 * 4 + at / 4])
}

/// Of the whole matrix.
pub fn determinant(m: &Matrix) -> f32 {
    glam::DMat4::from_cols_array(&m.map(f64::from)).determinant() as f32
}

/// The inverse; the identity where there is none.
pub fn inverse(m: &Matrix) -> Matrix {
    let whole = glam::DMat4::from_cols_array(&m.map(f64::from));
    match whole.determinant() {
        d if d == 0.0 || !d.is_finite() => IDENTITY,
        _ => whole.inverse().to_cols_array().map(|x| x as f32),
    }
}

/// What moves: how a transformation treats three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Moves, and is divided by w.
    Point,
    /// Turns and stretches.
    Vector,
    /// Turns as a surface's normal: by the inverse, transposed.
    Normal,
}

/// Three numbers moved by a matrix.
pub fn transform(kind: Kind, m: &Matrix, v: [f32; 3]) -> [f32; 3] {
    let row = |m: &Matrix, c: usize, w: f32| v[0] * m[c] + v[1] * m[4 + c] + v[2] * m[8 + c] + w * m[12 + c];
    match kind {
        Kind::Point => {
            let w = row(m, 3, 1.0);
            std::array::from_fn(|c| crate::ir::ops::divide(row(m, c, 1.0), w))
        }
        Kind::Vector => std::array::from_fn(|c| row(m, c, 0.0)),
        Kind::Normal => {
            let turned = transpose(&inverse(m));
            std::array::from_fn(|c| row(&turned, c, 0.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverses_undo() {
        let m = [2., 0., 0., 0., 0., 3., 1., 0., 0., 0., 4., 0., 1., 2., 3., 1.];
        let back = multiply(&m, &inverse(&m));
        assert!(back.iter().zip(&IDENTITY).all(|(a, b)| (a - b).abs() < 1e-6), "{back:?}");
        assert_eq!(determinant(&m), 24.0);
        assert_eq!(transform(Kind::Point, &m, [1., 1., 1.]), [3., 5., 8.]);
        assert_eq!(transform(Kind::Vector, &m, [1., 1., 1.]), [2., 3., 5.]);
        assert_eq!(inverse(&[0.0; 16]), IDENTITY);
    }
}
