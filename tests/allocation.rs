//! Shading up to eight lobes, and evaluating and sampling any number, leave the heap alone; three lobes are small.
#![cfg(feature = "cloth")]
#![allow(unsafe_code)]

use overcoat::{Engine, Globals};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, counting per thread.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is passed on unchanged to the system's allocator; counting touches only a `const` thread local,
// which needs no allocation itself.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> u64 {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
}

const EIGHT_LOBES: &str = "
    Ci = color(0.2, 0.1, 0.1) * diffuse(N) + 0.1 * translucent(N) + u * transparent();
    Ci = sheen(Ci, N, color(0.5, 0.4, 0.3), 0.2 + 0.5 * u);
    Ci = sheen(Ci + 0.2 * oren_nayar(normalize(N + 0.1 * dPdu), 0.4), N, 0.3, 0.8);
    Ci = layer(0.5 * sheen_bsdf(N, 1, 0.5) + 0.1 * diffuse(N), Ci);";

#[test]
fn shading_evaluating_and_sampling_leave_the_heap_alone() {
    assert!(allocations(|| drop(std::hint::black_box(vec![0u8; 100]))) > 0, "the counter counts");
    for script in ["Ci = sheen(diffuse(N), N, 1, 0.3);", EIGHT_LOBES] {
        let shader = Engine::new().compile("stack", script).expect("compiles");
        let material = shader.material(&[]).expect("specialises");
        let globals = Globals { u: 0.3, ..Globals::default() };
        let count = allocations(|| {
            for k in 0..100 {
                let wo = glam::Vec3::new(0.01 * k as f32, 0.2, 0.5).normalize();
                let bsdf = material.shade(&globals, wo).expect("within budget");
                let eval = bsdf.eval([0.0, 0.6, 0.8]);
                let sample = bsdf.sample([0.1, 0.01 * k as f32, 0.4]);
                std::hint::black_box((eval, sample, bsdf.albedo(), bsdf.delta_albedo()));
            }
        });
        assert_eq!(count, 0, "{script}");
    }
}

#[test]
fn batches_leave_the_heap_alone_once_they_have_grown() {
    let varying = "float x = 0; for (int i = 0; i < 9 * u; i++) if (v < 0.5) x += noise(i * P); Ci = x * diffuse(N);";
    for script in ["Ci = sheen(diffuse(N), N, 1, 0.3);", EIGHT_LOBES, varying] {
        let shader = Engine::new().compile("stack", script).expect("compiles");
        let material = shader.material(&[]).expect("specialises");
        let at = |k: usize| Globals { u: 0.03 * k as f32, v: (k % 2) as f32, ..Globals::default() };
        let points: Vec<Globals> = (0..30).map(at).collect();
        let directions = [[0.6, 0.0, 0.8]; 30];
        let (mut batch, mut bsdfs) = (overcoat::ir::Batch::new(), overcoat::Bsdfs::new());
        let mut out = [overcoat::closure::Eval::default(); 30];
        material.shade_batch(&points, &mut batch);
        material.shade_many(&points, &directions, &mut bsdfs).expect("small");
        let count = allocations(|| {
            for k in 0..10 {
                material.shade_batch(&points[k..], &mut batch);
                material.shade_batch(&points[k..], &mut batch);
                material.shade_many(&points[k..], &directions, &mut bsdfs).expect("small");
                bsdfs.eval(&directions, &mut out);
            }
        });
        assert_eq!(count, 0, "{script}");
    }
}

/// Where the material is the same at every point.
#[cfg(feature = "microfacet")]
#[test]
fn a_bsdf_of_three_lobes_takes_half_a_kilobyte() {
    let middles = [
        r#"dielectric_bsdf(N, dPdu, 1, 1, 0.3, 0.3, 1.5, "ggx")"#,
        r#"conductor_bsdf(N, dPdu, 0.2, 0.3, color(1.2), color(3.9), "ggx")"#,
        r#"microfacet("beckmann", N, dPdu, 0.2, 0.3, 0, 0)"#,
        "eon(N, color(0.8), 0.5)",
        "velvet(N, 0.3)",
        "thread(N, dPdu, color(0.5, 0.1, 0.1), 1.46, 0.3, 12, 24)",
        r#"microcylinder(N, dPdu, "linen")"#,
    ];
    for middle in middles {
        let text = format!("Ci = sheen(layer(0.5 * {middle}, oren_nayar(N, 0.4)), N, 0.5, 0.3);");
        let material = Engine::new().material(middle, &text).expect("compiles");
        let bsdf = material.shade(&Globals::default(), glam::Vec3::new(0.6, 0.0, 0.8)).expect("small");
        println!("{middle}: {} bytes", bsdf.bytes());
        assert_eq!(bsdf.lobe_count(), 3);
        assert!(bsdf.bytes() <= 512, "{middle}: {} bytes", bsdf.bytes());
    }
}
