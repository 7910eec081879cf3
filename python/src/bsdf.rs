//! BSDFs: what a material does at a point.

use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArrayLike2, PyArrayMethods, PyUntypedArrayMethods};
use overcoat::OwnedBsdf;
use overcoat::closure::Eval;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Rows of three numbers; float32 in rows that lie side by side is not copied.
pub type Rows<'py> = PyArrayLike2<'py, f32, AllowTypeChange>;

/// The rows of an array of shape (n, 3).
pub fn rows<'a>(name: &str, array: &'a Rows<'_>) -> PyResult<&'a [[f32; 3]]> {
    let wrong = || PyValueError::new_err(format!("`{name}` must have shape (n, 3) and be contiguous"));
    if array.shape()[1] != 3 {
        return Err(wrong());
    }
    Ok(array.as_slice().map_err(|_| wrong())?.as_chunks::<3>().0)
}

/// Rows as an array that takes the vector over.
pub fn array<'py>(py: Python<'py>, rows: Vec<[f32; 3]>) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, 3])
}

/// What a surface does with light at one point, seen from one direction. Made by `Material.shade`.
#[pyclass(frozen, module = "overcoat")]
pub struct Bsdf(pub OwnedBsdf);

/// Directions drawn from a BSDF, as arrays.
#[pyclass(frozen, get_all, module = "overcoat")]
pub struct Samples {
    /// Directions (n, 3): world space, unit, away from the surface.
    wi: Py<PyArray2<f32>>,
    /// f·|cos| per channel (n, 3).
    f_cos: Py<PyArray2<f32>>,
    /// Densities over solid angle (n), or probabilities of delta samples; 0 where nothing is scattered.
    pdf: Py<PyArray1<f32>>,
    /// f_cos / pdf (n, 3).
    weight: Py<PyArray2<f32>>,
    /// Kinds of scattering (n), as in `overcoat.REFLECT` and its like.
    flags: Py<PyArray1<u32>>,
    /// Relative index of refraction (n).
    eta: Py<PyArray1<f32>>,
    /// How wide the sampled lobes scatter (n): 0 to 1.
    roughness: Py<PyArray1<f32>>,
}

#[pymethods]
impl Bsdf {
    /// f·|cos| (n, 3) and pdf (n) for directions `wi` (n, 3): world space, unit, away from the surface.
    #[allow(clippy::type_complexity)]
    fn eval<'py>(
        &self,
        py: Python<'py>,
        wi: Rows<'py>,
    ) -> PyResult<(Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f32>>)> {
        let wi = rows("wi", &wi)?;
        let (f, pdf) = py.detach(|| {
            let (mut f, mut pdf) = (Vec::with_capacity(wi.len()), Vec::with_capacity(wi.len()));
            let mut results = [Eval { f_cos: [0.0; 3], pdf: 0.0 }; 256];
            self.0.with(|bsdf| {
                for wi in wi.chunks(results.len()) {
                    bsdf.eval_batch(wi, &mut results);
                    f.extend(results[..wi.len()].iter().map(|e| e.f_cos));
                    pdf.extend(results[..wi.len()].iter().map(|e| e.pdf));
                }
            });
            (f, pdf)
        });
        Ok((array(py, f)?, PyArray1::from_vec(py, pdf)))
    }

    /// Draws a direction for each row of `u` (n, 3): uniform numbers in [0, 1).
    fn sample<'py>(&self, py: Python<'py>, u: Rows<'py>) -> PyResult<Samples> {
        let u = rows("u", &u)?;
        let drawn = py.detach(|| self.0.with(|bsdf| u.iter().map(|u| bsdf.sample(*u)).collect::<Vec<_>>()));
        let triples = |f: fn(&overcoat::closure::Sample) -> [f32; 3]| {
            array(py, drawn.iter().map(|s| s.as_ref().map_or([0.0; 3], f)).collect()).map(Bound::unbind)
        };
        let floats = |f: fn(&overcoat::closure::Sample) -> f32| {
            PyArray1::from_vec(py, drawn.iter().map(|s| s.as_ref().map_or(0.0, f)).collect()).unbind()
        };
        let flags = drawn.iter().map(|s| s.as_ref().map_or(0, |s| s.scattering().bits())).collect();
        Ok(Samples {
            wi: triples(|s| s.wi)?,
            f_cos: triples(|s| s.f_cos)?,
            pdf: floats(|s| s.pdf),
            weight: triples(|s| s.weight)?,
            flags: PyArray1::from_vec(py, flags).unbind(),
            eta: floats(|s| s.eta),
            roughness: floats(|s| s.roughness),
        })
    }

    /// A quick estimate of the albedo toward the viewer, per channel, delta lobes included.
    #[getter]
    fn albedo(&self) -> [f32; 3] {
        self.0.with(|b| b.albedo())
    }

    /// Never below the albedo with the viewer, or the light, along `w`.
    fn albedo_bound(&self, w: [f32; 3]) -> [f32; 3] {
        self.0.with(|b| b.albedo_bound(w))
    }

    /// Radiance given off toward the viewer.
    #[getter]
    fn emission(&self) -> [f32; 3] {
        self.0.with(|b| b.emission())
    }

    /// What goes straight through: what a shadow ray is multiplied by.
    #[getter]
    fn transparency(&self) -> [f32; 3] {
        self.0.with(|b| b.transparency())
    }

    /// Kinds of scattering that may occur: a sum of `overcoat.REFLECT` and its like.
    #[getter]
    fn flags(&self) -> u32 {
        self.0.with(|b| b.flags().bits())
    }

    /// The direction toward the viewer.
    #[getter]
    fn wo(&self) -> [f32; 3] {
        self.0.with(|b| b.wo())
    }
}
