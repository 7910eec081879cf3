//! What happens to a body between checking and lowering: one pure function per file.

mod copies;
mod dead;
pub mod derive;
mod env;
pub mod fold;
pub mod layers;
mod merge;
pub mod needs;
mod starts;

use super::body::{Body, ExprId, ExprKind, Root, Stmt, VarId};
use std::collections::HashSet;

/// A folded body without what nothing needs done at a point: dead code, values that are only handed on, known starts.
pub fn tighten(body: Body) -> Body {
    starts::take(merge::merge(dead::remove(copies::read_through(body))))
}

/// Calls `see` for each expression that the value of a run depends on, the run's root first.
pub(super) fn each_used(body: &Body, run: Root, used: &mut Vec<bool>, mut see: impl FnMut(ExprId, ExprKind)) {
    let first = run.first.min(run.root.0);
    used.clear();
    used.resize((run.root.0 - first + 1) as usize, false);
    if let Some(root) = used.last_mut() {
        *root = true;
    }
    for id in (first..=run.root.0).rev() {
        if !used[(id - first) as usize] {
            continue;
        }
        let id = ExprId(id);
        see(id, body.expr(id).kind);
        body.operands(id, |operand| {
            if let Some(entry) = operand.0.checked_sub(first).and_then(|i| used.get_mut(i as usize)) {
                *entry = true;
            }
        });
    }
}

/// Marks the variables that are reached by an index.
fn indexed(body: &Body, stmts: &[Stmt]) -> Vec<bool> {
    fn stores(stmts: &[Stmt], ranges: &mut HashSet<(VarId, u32)>) {
        for stmt in stmts {
            match stmt {
                Stmt::Store { base, len, .. } => {
                    ranges.insert((*base, *len));
                }
                Stmt::Loop { before: a, body: b, .. } | Stmt::If { then: a, other: b, .. } => {
                    stores(a, ranges);
                    stores(b, ranges);
                }
                Stmt::Assign(..) | Stmt::Do(_) => {}
            }
        }
    }
    let mut ranges = HashSet::new();
    stores(stmts, &mut ranges);
    ranges.extend(body.exprs.iter().filter_map(|expr| match expr.kind {
        ExprKind::Element(base, len, _) => Some((base, len)),
        _ => None,
    }));
    let mut indexed = vec![false; body.vars.len()];
    for (base, len) in ranges {
        indexed[base.index()..][..len as usize].fill(true);
    }
    indexed
}

#[cfg(test)]
mod tests {
    use super::super::host::{Answers, Host, Subject};
    use super::super::{Program, compile_with, lower};
    use super::*;
    use crate::closure::ClosureTree;
    use crate::globals::{Differentials, Globals};
    use crate::syntax::Options;
    use std::sync::Arc;

    /// Gives derivatives.
    struct Given;

    impl Host for Given {
        fn answers(&self, subject: Subject) -> bool {
            subject == Subject::Derivatives
        }
    }

    /// The program of a script as it was folded, and tightened.
    fn programs(script: &str) -> [Program; 2] {
        let host: Arc<dyn Host> = Arc::new(Given);
        let answers = Answers::of(Some(&*host));
        let (shader, _) = compile_with("test", script, &[], &Options::default(), Some(host)).expect("compiles");
        let folded = fold::fold(&shader.body, &vec![None; shader.body.vars.len()], answers);
        [dead::remove(folded.clone()), tighten(folded)].map(|body| Program {
            iterations: 1000,
            ..lower::lower(&body, &needs::needs(&body, answers), &layers::layers(&body), Vec::new())
        })
    }

    fn tree(program: &Program, k: usize) -> String {
        let [u, v] = [0.1 * k as f32, 1.0 - 0.13 * k as f32];
        let differentials = Differentials { dudx: 0.25, dvdy: -0.5, dpdx: glam::Vec3::X, ..Differentials::default() };
        let globals = Globals { u, v, p: glam::vec3(u, v, u * v), differentials, ..Globals::default() };
        let mut tree = ClosureTree::new();
        program.shade(&globals, &mut tree).expect("within budget");
        format!("{:?} {tree:?}", tree.root())
    }

    /// Scripts with what they come to before and after, in instructions.
    const SCRIPTS: &[(&str, usize, usize)] = &[
        // A call: its parameters and its result.
        ("float f(float x, float y) { return x * y + 1; } float a = u * 3; Ci = f(a, v) * diffuse(N);", 10, 9),
        // Both ways of a branch end with the result.
        ("float f(float x) { float r; if (x > 0.5) r = x - 0.5; else r = x * 2; return r; } Ci = f(u) * diffuse(N);", 11, 10),
        // What is copied changes afterwards, in a branch, in a loop, in both.
        ("float a = u; float b = a + v; float c = b; b = b * 2; Ci = (b + 3 * c) * diffuse(N);", 11, 11),
        ("float b = u + v; float c = b; if (u > 0.4) b = v; Ci = (b + 3 * c) * diffuse(N);", 13, 13),
        ("float b = u + v; float c = b; for (int i = 0; i < 9 * u; i++) { c = b; b += c; } Ci = (b + 3 * c) * diffuse(N);", 21, 20),
        ("float a = u, b = v; for (int i = 0; i < 9 * u; i++) { float t = a; a = b; b = t + 0.1; } Ci = (a + 3 * b) * diffuse(N);", 22, 21),
        // Break and continue.
        ("float s = 0; for (int i = 0; i < 20 * u; i++) { float t = s; if (i > 7) break; if (t > v) { s = t * 0.5; continue; }
          s = t + u; } Ci = s * diffuse(N);", 29, 25),
        // An array read by name and by index.
        ("float a[3] = {u, v, 1}; float b = a[1]; a[(int)(u * 3)] = 7; float c = b + a[1]; Ci = (c + 3 * b) * diffuse(N);", 14, 13),
        // Output arguments.
        ("void g(output float x, float y) { x = x * 2 + y; } float a = u; g(a, v); float b = a; g(b, a); Ci = (a + b) * diffuse(N);", 13, 11),
        // Derivatives.
        ("float f(float x) { float y = x * x; return y; } float a = f(u + v); Ci = abs(Dx(a) + Dy(a) + a) * diffuse(N);", 41, 23),
        // Values that are known at first, and one that is not first.
        ("float s = 2; color c = color(1, 0.5, 0); float t = u; if (t > 0.5) { s = t; c = t; } t = 3; Ci = (s + t) * c * diffuse(N);", 13, 11),
        ("float a[3] = {1, 2, 3}; float b = a[(int)(3 * u)]; a[1] = 4; Ci = (b + a[(int)(3 * v)]) * diffuse(N);", 17, 14),
        // Choices.
        ("float a = u; a = u > 0.5 ? (v > a ? a + 1 : a * 2) : a - 3; Ci = abs(a) * diffuse(N);", 16, 16),
        // Closures and triples.
        ("closure color f(color c) { closure color r = c * diffuse(N); return r; } closure color d = f(color(u, v, 1));
          closure color e = d; d = d + translucent(N); Ci = e + 0.5 * d;", 13, 10),
    ];

    #[test]
    fn tight_programs_are_shorter_and_give_the_same() {
        let mut found = String::new();
        let mut wrong = false;
        for (script, before, after) in SCRIPTS {
            let [plain, tight] = programs(script);
            for k in 0..10 {
                assert_eq!(tree(&plain, k), tree(&tight, k), "{script} at point {k}");
            }
            wrong |= (plain.len(), tight.len()) != (*before, *after);
            found += &format!("{}, {}: {script}\n", plain.len(), tight.len());
        }
        assert!(!wrong, "{found}");
    }
}
