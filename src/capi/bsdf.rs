//! What a BSDF answers: `oc_bsdf_…`.

use super::handle::{self, OcBsdf};
use super::memory::{self, Strided};
use super::status::{Failure, OcStatus, guard};
use crate::closure::{Bsdf, Eval, Scattering};

/// To the side `wo` is on.
pub const OC_REFLECT: u32 = 1;
/// To the other side.
pub const OC_TRANSMIT: u32 = 2;
/// As wide as a diffuse surface.
pub const OC_DIFFUSE: u32 = 4;
/// Narrower than that, and not a delta.
pub const OC_GLOSSY: u32 = 8;
/// Into one direction; `oc_bsdf_eval` does not see it, and the pdf of a sample is a probability.
pub const OC_DELTA: u32 = 16;
/// Straight through: `oc_bsdf_transparency` is not black. Of whole BSDFs only.
pub const OC_NULL: u32 = 32;
/// Light is given off: `oc_bsdf_emission` is not black. Of whole BSDFs only.
pub const OC_EMISSION: u32 = 64;

const _: () = {
    assert!(OC_REFLECT == Scattering::REFLECT.bits() && OC_TRANSMIT == Scattering::TRANSMIT.bits());
    assert!(OC_DIFFUSE == Scattering::DIFFUSE.bits() && OC_GLOSSY == Scattering::GLOSSY.bits());
    assert!(OC_DELTA == Scattering::DELTA.bits() && OC_NULL == Scattering::NULL.bits());
    assert!(OC_EMISSION == Scattering::EMISSION.bits());
};

/// One sample with all there is to know of it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OcSample {
    /// World space, unit, away from the surface.
    pub wi: [f32; 3],
    /// f·|cos| per channel; for a delta sample what it scatters.
    pub f_cos: [f32; 3],
    /// Density over solid angle, or the probability of a delta sample; 0: nothing is scattered that way, the rest is 0 too.
    pub pdf: f32,
    /// Index of refraction on `wi`'s side over that on `wo`'s: 1 unless light was refracted. Radiance is divided by its square.
    pub eta: f32,
    /// How wide the sampled lobe scatters: 0 one direction, 1 as wide as a diffuse surface.
    pub roughness: f32,
    /// `OC_REFLECT` or `OC_TRANSMIT`, with one of `OC_DIFFUSE`, `OC_GLOSSY`, `OC_DELTA`.
    pub flags: u32,
}

fn drawn(bsdf: &Bsdf<'_>, u: [f32; 3]) -> OcSample {
    bsdf.sample(u).map_or(OcSample::default(), |s| OcSample {
        wi: s.wi,
        f_cos: s.f_cos,
        pdf: s.pdf,
        eta: s.eta,
        roughness: s.roughness,
        flags: s.scattering().bits(),
    })
}

/// f·|cos| per channel and the pdf for `n` directions; delta lobes left out. A direction that is not near unit length
/// gives 0.
///
/// `wi`: 3n floats. `f_cos`: receives 3n. `pdf`: receives n. They must not overlap.
///
/// # Safety
/// The arrays are null or as long as said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_eval(
    bsdf: *mut OcBsdf,
    wi: *const f32,
    n: usize,
    f_cos: *mut f32,
    pdf: *mut f32,
) -> OcStatus {
    // SAFETY: passed on, with the strides of dense arrays.
    unsafe { oc_bsdf_eval_strided(bsdf, wi, 12, n, f_cos, 12, pdf, 4) }
}

/// `oc_bsdf_eval` for arrays whose elements (three floats, three floats, one float) lie so many bytes apart: fields of
/// structs, for example.
///
/// # Safety
/// The arrays are null or reach as far as `n` and the strides say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_eval_strided(
    bsdf: *mut OcBsdf,
    wi: *const f32,
    wi_stride: usize,
    n: usize,
    f_cos: *mut f32,
    f_cos_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> OcStatus {
    const CHUNK: usize = 64;
    /// Fewer than this are cheaper one by one than as eight lanes.
    const FEW: usize = 4;
    guard(|| {
        let found = handle::get(bsdf)?;
        let wi = Strided::new(wi.cast_mut().cast::<[f32; 3]>(), wi_stride, n, "wi")?;
        let f_cos = Strided::new(f_cos.cast::<[f32; 3]>(), f_cos_stride, n, "f_cos")?;
        let pdf = Strided::new(pdf, pdf_stride, n, "pdf")?;
        // SAFETY: called with indices below `n`.
        let put = |k: usize, eval: &Eval| unsafe {
            f_cos.set(k, eval.f_cos);
            pdf.set(k, eval.pdf);
        };
        if n < FEW {
            found.bsdf()?.with(|bsdf| {
                for k in 0..n {
                    // SAFETY: below `n`.
                    put(k, &bsdf.eval(unsafe { wi.get(k) }));
                }
            });
            return Ok(());
        }
        let mut directions = [[0.0; 3]; CHUNK];
        let mut results = [Eval { f_cos: [0.0; 3], pdf: 0.0 }; CHUNK];
        found.bsdf()?.with(|bsdf| {
            for start in (0..n).step_by(CHUNK) {
                let count = CHUNK.min(n - start);
                for (k, direction) in directions[..count].iter_mut().enumerate() {
                    // SAFETY: below `n`.
                    *direction = unsafe { wi.get(start + k) };
                }
                bsdf.eval_batch(&directions[..count], &mut results[..count]);
                results[..count].iter().enumerate().for_each(|(k, eval)| put(start + k, eval));
            }
        });
        Ok(())
    })
}

/// Draws `n` directions; a sample that scatters nothing has pdf 0.
///
/// `u`: 3n uniform numbers in [0, 1). `wi`, `f_cos`: receive 3n floats, `pdf`: n. `flags`: receives n, as in `oc_sample`; or
/// null. They must not overlap. The weight of a sample is f_cos / pdf.
///
/// # Safety
/// The arrays are null or as long as said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_sample(
    bsdf: *mut OcBsdf,
    u: *const f32,
    n: usize,
    wi: *mut f32,
    f_cos: *mut f32,
    pdf: *mut f32,
    flags: *mut u32,
) -> OcStatus {
    guard(|| {
        let found = handle::get(bsdf)?;
        let u = Strided::new(u.cast_mut().cast::<[f32; 3]>(), 12, n, "u")?;
        let wi = Strided::new(wi.cast::<[f32; 3]>(), 12, n, "wi")?;
        let f_cos = Strided::new(f_cos.cast::<[f32; 3]>(), 12, n, "f_cos")?;
        let pdf = Strided::new(pdf, 4, n, "pdf")?;
        let kinds = if flags.is_null() { None } else { Some(Strided::new(flags, 4, n, "flags")?) };
        found.bsdf()?.with(|bsdf| {
            for k in 0..n {
                // SAFETY: below `n`.
                unsafe {
                    let sample = drawn(bsdf, u.get(k));
                    wi.set(k, sample.wi);
                    f_cos.set(k, sample.f_cos);
                    pdf.set(k, sample.pdf);
                    if let Some(kinds) = kinds {
                        kinds.set(k, sample.flags);
                    }
                }
            }
        });
        Ok(())
    })
}

/// `oc_bsdf_sample` with everything a sample tells: `n` of `oc_sample`, `stride` bytes apart. `u`: three floats each,
/// `u_stride` bytes apart.
///
/// # Safety
/// The arrays are null or reach as far as `n` and the strides say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_sample_strided(
    bsdf: *mut OcBsdf,
    u: *const f32,
    u_stride: usize,
    n: usize,
    samples: *mut OcSample,
    stride: usize,
) -> OcStatus {
    guard(|| {
        let found = handle::get(bsdf)?;
        let u = Strided::new(u.cast_mut().cast::<[f32; 3]>(), u_stride, n, "u")?;
        let samples = Strided::new(samples, stride, n, "samples")?;
        found.bsdf()?.with(|bsdf| {
            for k in 0..n {
                // SAFETY: below `n`.
                unsafe { samples.set(k, drawn(bsdf, u.get(k))) };
            }
        });
        Ok(())
    })
}

/// Writes what `f` asks of a BSDF.
///
/// # Safety
/// `out` is null or has room.
unsafe fn answer<T: Copy>(bsdf: *mut OcBsdf, out: *mut T, f: impl FnOnce(&Bsdf<'_>) -> T) -> Result<(), Failure> {
    let found = handle::get(bsdf)?;
    let value = found.bsdf()?.with(f);
    // SAFETY: the caller promises room.
    unsafe { memory::write(out, value, "out") }
}

/// A quick estimate of what is reflected and transmitted toward the viewer in white surroundings, per channel, delta
/// lobes included.
///
/// # Safety
/// `out` is null or has room for three floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_albedo(bsdf: *mut OcBsdf, out: *mut f32) -> OcStatus {
    // SAFETY: passed on.
    guard(|| unsafe { answer(bsdf, out.cast::<[f32; 3]>(), |b| b.albedo()) })
}

/// Never below the albedo with the viewer, or the light, along `w` (world space, unit), per channel.
///
/// # Safety
/// `w` is null or points to three floats; `out` is null or has room for as many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_albedo_bound(bsdf: *mut OcBsdf, w: *const f32, out: *mut f32) -> OcStatus {
    guard(|| {
        // SAFETY: the caller promises both.
        unsafe {
            let w = memory::read(w.cast::<[f32; 3]>(), "w")?;
            answer(bsdf, out.cast::<[f32; 3]>(), |b| b.albedo_bound(w))
        }
    })
}

/// Radiance given off toward the viewer, per channel.
///
/// # Safety
/// `out` is null or has room for three floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_emission(bsdf: *mut OcBsdf, out: *mut f32) -> OcStatus {
    // SAFETY: passed on.
    guard(|| unsafe { answer(bsdf, out.cast::<[f32; 3]>(), |b| b.emission()) })
}

/// What goes straight through, per channel: what a shadow ray is multiplied by.
///
/// # Safety
/// `out` is null or has room for three floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_transparency(bsdf: *mut OcBsdf, out: *mut f32) -> OcStatus {
    // SAFETY: passed on.
    guard(|| unsafe { answer(bsdf, out.cast::<[f32; 3]>(), |b| b.transparency()) })
}

/// Every kind of scattering that may occur: a sum of `OC_REFLECT` to `OC_EMISSION`. Equal to `OC_DELTA` plus sides where
/// light samples are wasted.
///
/// # Safety
/// `out` is null or has room for one number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn oc_bsdf_flags(bsdf: *mut OcBsdf, out: *mut u32) -> OcStatus {
    // SAFETY: passed on.
    guard(|| unsafe { answer(bsdf, out, |b| b.flags().bits()) })
}

/// Frees a BSDF; null is fine.
#[unsafe(no_mangle)]
pub extern "C" fn oc_bsdf_free(bsdf: *mut OcBsdf) -> OcStatus {
    guard(|| handle::free(bsdf))
}
