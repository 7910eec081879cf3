//! A closure tree as the text of a script that builds it: what a random tree is reported as.

use crate::closure::{ClosureTree, Node, NodeId};
use crate::lobes::registry::{ParamSpec, ParamTy};
use crate::lobes::{LobeKind, tags};
use std::fmt::Write;

/// A script whose closure is `tree`, with every number written out.
///
/// A number for which `varies(site, slot)` holds is written as `x + u`, which is x at the default shading point: its
/// table is then made as for a parameter that is not known before shading.
pub fn script(tree: &ClosureTree, varies: impl Fn(u32, usize) -> bool) -> String {
    let uses = uses(tree);
    let mut names: Vec<String> = vec![String::new(); tree.len()];
    let mut text = String::new();
    // Nodes refer only to nodes before them.
    for (index, count) in uses.iter().enumerate().filter(|(_, count)| **count > 0) {
        let id = tree.id_at(index);
        let (expression, plain) = match tree.node(id) {
            Node::Zero => ("0 * diffuse(N)".to_owned(), true),
            Node::Lobe { kind, site, slots } => (lobe(kind, tree.values(kind, slots), |s| varies(site, s)), true),
            Node::Mul(w, c) => {
                let [r, g, b] = w;
                let weight = if r == g && g == b { format!("{r}") } else { format!("color({r}, {g}, {b})") };
                (format!("{weight} * {}", names[c.index()]), matches!(tree.node(c), Node::Lobe { .. }))
            }
            Node::Layer { top, base } => (format!("layer({}, {})", names[top.index()], names[base.index()]), false),
            Node::Add(..) if *count == 1 && index != tree.root().index() && in_sum(tree, id, &uses) => continue,
            Node::Add(..) => {
                let terms: Vec<&str> = terms(tree, id, &uses).iter().map(|t| names[t.index()].as_str()).collect();
                (terms.join("\n    + "), false)
            }
        };
        names[index] = if index == tree.root().index() {
            let _ = writeln!(text, "Ci = {expression};");
            break;
        } else if plain && *count == 1 {
            expression
        } else {
            let _ = writeln!(text, "closure color c{index} = {expression};");
            format!("c{index}")
        };
    }
    text
}

/// How often each node is used by those the root reaches; the root counts as used once.
fn uses(tree: &ClosureTree) -> Vec<u32> {
    let mut uses = vec![0u32; tree.len()];
    uses[tree.root().index()] = 1;
    for index in (0..=tree.root().index()).rev() {
        if uses[index] == 0 {
            continue;
        }
        match tree.node(tree.id_at(index)) {
            Node::Zero | Node::Lobe { .. } => {}
            Node::Mul(_, c) => uses[c.index()] += 1,
            Node::Add(a, b) | Node::Layer { top: a, base: b } => {
                uses[a.index()] += 1;
                uses[b.index()] += 1;
            }
        }
    }
    uses
}

/// Whether what uses the sum `id` is itself a sum.
fn in_sum(tree: &ClosureTree, id: NodeId, uses: &[u32]) -> bool {
    (id.index() + 1..=tree.root().index()).filter(|i| uses[*i] > 0).any(|i| match tree.node(tree.id_at(i)) {
        Node::Add(a, b) => a == id || b == id,
        _ => false,
    })
}

/// The terms of a sum in order; a sum used once within it is dissolved.
fn terms(tree: &ClosureTree, id: NodeId, uses: &[u32]) -> Vec<NodeId> {
    let (mut found, mut waiting) = (Vec::new(), vec![id]);
    while let Some(next) = waiting.pop() {
        match tree.node(next) {
            Node::Add(a, b) if next == id || uses[next.index()] == 1 => waiting.extend([b, a]),
            _ => found.push(next),
        }
    }
    found
}

fn lobe(kind: LobeKind, values: &[f32], varies: impl Fn(usize) -> bool) -> String {
    let mut arguments = Vec::new();
    let mut at = 0;
    for p in kind.spec().params {
        let slots = &values[at..at + p.ty.slots()];
        let value = argument(p, slots, varies(at));
        arguments.push(if p.keyword { format!("\"{}\", {value}", p.name) } else { value });
        at += p.ty.slots();
    }
    format!("{}({})", kind.spec().name, arguments.join(", "))
}

fn argument(p: &ParamSpec, slots: &[f32], varies: bool) -> String {
    match (p.ty, slots) {
        (ParamTy::String, [x]) if p.options.is_empty() => format!("\"{}\"", tags::name(*x as usize)),
        (ParamTy::String, [x]) => format!("\"{}\"", p.options.get(p.clamp(0, *x) as usize).copied().unwrap_or("")),
        (ParamTy::Int, [x]) => format!("{}", p.clamp(0, *x) as i64),
        (ParamTy::Float, [x]) if varies => format!("{x} + u"),
        (_, [x]) => format!("{x}"),
        (ty, xs) => {
            let numbers: Vec<String> = xs.iter().map(f32::to_string).collect();
            format!("{}({})", ty.name(), numbers.join(", "))
        }
    }
}
