//! How shading grows with threads that share one material: evaluations and shaded points per second, over one thread's.
//!
//!     cargo bench --bench threads
//!
//! Nothing in a material is locked or counted while it shades, so the ratio should be the number of threads as far as there are
//! cores of one's own. Ratios are of one run: every number of threads has its turn in each round, and the best round counts, so
//! that what else the machine does meets all alike. Two threads on one core, and clocks that slow down under load, show as less.

mod stacks;

use overcoat::{Engine, Globals, Material, Scratch};
use stacks::{WO, directions, material, names};
use std::hint::black_box;
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

const ROUNDS: usize = 5;
const TURN: Duration = Duration::from_millis(100);

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let most = thread::available_parallelism().map_or(1, usize::from);
    // Powers of two, and all there are.
    let mut counts: Vec<usize> = (0..).map(|k| 1 << k).take_while(|n| *n < most).collect();
    counts.push(most);
    println!("millions per second on one thread, and the ratio to it\n");
    print!("{:<24}{:<10}{:>10}", "stack", "call", "1 thread");
    counts[1..].iter().for_each(|n| print!("{:>10}", format!("{n} threads")));
    println!();
    for stack in names().filter(|name| wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str()))) {
        let material = material(&Engine::new(), stack);
        row(stack, "eval", &counts, &|| evals(&material));
        row(stack, "shade_in", &counts, &|| points(&material));
    }
}

/// A thread's work: how many calls of one go.
type Work<'w> = Box<dyn FnMut() -> usize + 'w>;

fn evals(material: &Material) -> Work<'_> {
    let (globals, wi) = (Globals::default(), directions());
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    Box::new(move || {
        for w in &wi {
            black_box(&bsdf.eval(*black_box(w)));
        }
        wi.len()
    })
}

fn points(material: &Material) -> Work<'_> {
    let (globals, mut scratch) = (Globals::default(), Scratch::new());
    Box::new(move || {
        for _ in 0..256 {
            let bsdf = material.shade_in(black_box(&globals), (*black_box(&WO)).into(), &mut scratch);
            black_box(bsdf.is_ok());
        }
        256
    })
}

fn row<'w>(stack: &str, call: &str, counts: &[usize], work: &(dyn Fn() -> Work<'w> + Sync)) {
    let mut best = vec![0.0f64; counts.len()];
    for _ in 0..ROUNDS {
        for (best, threads) in best.iter_mut().zip(counts) {
            *best = best.max(rate(*threads, work));
        }
    }
    print!("{stack:<24}{call:<10}{:>10.2}", best[0] / 1e6);
    best[1..].iter().for_each(|rate| print!("{:>10.2}", rate / best[0]));
    println!();
}

/// Calls per second of all threads together.
fn rate<'w>(threads: usize, work: &(dyn Fn() -> Work<'w> + Sync)) -> f64 {
    let (start, done) = (Barrier::new(threads + 1), AtomicBool::new(false));
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let mut work = work();
                    work();
                    start.wait();
                    let (begun, mut calls) = (Instant::now(), 0);
                    while !done.load(Ordering::Relaxed) {
                        calls += work();
                    }
                    calls as f64 / begun.elapsed().as_secs_f64()
                })
            })
            .collect();
        start.wait();
        thread::sleep(TURN);
        done.store(true, Ordering::Relaxed);
        workers.into_iter().map(|w| w.join().expect("no bench panics")).sum()
    })
}
