//! How many instructions a shading point takes: the same on every run and however busy the machine is, where a clock is
//! not. They are counted, not timed: a wait for memory or for a division costs nothing here, so read them beside
//! `cargo bench --bench bsdf`.
//!
//!     cargo bench --bench instructions -- sheen
//!
//! The program runs itself under valgrind's callgrind, which writes down what each call of [`counted`] took; without valgrind
//! it says so and measures nothing. Counts belong to one compiler and one kind of processor: those with AVX2 take fewer in
//! batches.

mod stacks;

use overcoat::albedo::Precision;
use overcoat::{Engine, Globals, Scratch};
use stacks::{WO, directions, material, names, numbers};
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, exit};

/// What is counted.
const CALLS: [&str; 4] = ["shade_in", "eval", "sample", "eval_batch"];

/// How often each is called.
const TIMES: usize = 1024;

/// Set for the program that runs under callgrind.
const COUNTED: &str = "OVERCOAT_COUNTED_STACK";

fn main() {
    if let Ok(stack) = std::env::var(COUNTED) {
        return run(&stack);
    }
    // Cargo passes flags of its own.
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    if !Command::new("valgrind").arg("--version").output().is_ok_and(|o| o.status.success()) {
        println!("valgrind is not installed: no instructions are counted");
        return;
    }
    let mut unknown = false;
    println!("instructions per call; eval_batch: per direction\n");
    print!("{:<24}", "stack");
    CALLS.iter().for_each(|call| print!("{call:>12}"));
    println!();
    for stack in names().filter(|name| wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str()))) {
        let totals = count(stack).unwrap_or_else(|problem| {
            eprintln!("{stack}: {problem}");
            exit(1)
        });
        print!("{stack:<24}");
        for total in totals {
            match total {
                Some(total) => print!("{:>12.1}", total as f64 / TIMES as f64),
                None => {
                    unknown = true;
                    print!("{:>12}", "–");
                }
            }
        }
        println!();
    }
    if unknown {
        println!("\n– valgrind does not know an instruction that the batch has");
    }
}

/// Does what is to be counted.
fn run(stack: &str) {
    // Small tables are read as large ones are, and valgrind takes minutes to bake those.
    let coarse = Precision { cos_nodes: 8, axis_nodes: 8, polar: 8, azimuth: 8, ..Precision::FAST };
    let material = material(&Engine::new().precision(coarse), stack);
    let (globals, wi, u) = (Globals::default(), directions(), numbers());
    let mut scratch = Scratch::new();
    let bsdf = material.shade(&globals, WO.into()).expect("shades");
    let mut out = vec![bsdf.eval(wi[0]); wi.len()];
    assert_eq!(wi.len(), TIMES);
    // The first round warms what is kept between calls; callgrind's counters go back to zero after each.
    for _ in 0..2 {
        counted(TIMES, &mut |_| {});
        counted(TIMES, &mut |_| {
            let bsdf = material.shade_in(black_box(&globals), (*black_box(&WO)).into(), &mut scratch);
            black_box(bsdf.is_ok());
        });
        counted(TIMES, &mut |k| {
            black_box(&bsdf.eval(*black_box(&wi[k])));
        });
        counted(TIMES, &mut |k| {
            black_box(&bsdf.sample(*black_box(&u[k])));
        });
    }
    // At the end: valgrind does not know all instructions of vector code.
    for _ in 0..2 {
        counted(1, &mut |_| bsdf.eval_batch(black_box(&wi), black_box(&mut out)));
    }
}

/// Callgrind counts while this runs, and writes the count down when it returns.
#[inline(never)]
fn counted(times: usize, call: &mut dyn FnMut(usize)) {
    for k in 0..times {
        call(k);
    }
}

/// The totals of [`CALLS`] for a stack.
fn count(stack: &str) -> Result<[Option<u64>; CALLS.len()], String> {
    let folder = std::env::temp_dir().join(format!("overcoat-instructions-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let totals = callgrind(stack, &folder);
    // What is left behind in the system's temporary folder does no harm.
    let _ = std::fs::remove_dir_all(&folder);
    totals
}

fn callgrind(stack: &str, folder: &Path) -> Result<[Option<u64>; CALLS.len()], String> {
    let out = folder.join("out");
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let done = Command::new("valgrind")
        // By its full name: with a pattern nothing is written down on return.
        .args(["--tool=callgrind", "--toggle-collect=instructions::counted", "--dump-after=instructions::counted"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(program)
        .env(COUNTED, stack)
        .output()
        .map_err(|e| e.to_string())?;
    // Numbered in the order of [`run`], from 1.
    let total = |number: usize| -> Option<u64> {
        let text = std::fs::read_to_string(folder.join(format!("out.{number}"))).ok()?;
        let line = text.lines().find_map(|l| l.strip_prefix("totals: ").or(l.strip_prefix("summary: ")));
        line?.trim().parse().ok()
    };
    let around = total(5);
    let [shade, eval, sample] = [6, 7, 8].map(|number| Some(total(number)?.saturating_sub(around?)));
    if sample.is_none() {
        return Err(String::from_utf8_lossy(&done.stderr).into_owned());
    }
    // A batch is one call for all its directions, without a loop around it.
    Ok([shade, eval, sample, total(10)])
}
