//! `overcoat tree`.

use super::output::{number, numbers};
use super::{Failure, Global, Outcome, output};
use crate::closure::{ClosureTree, Fate, LayeringRule, Node, NodeId};
use crate::engine::Material;
use crate::globals::Globals;
use crate::lobes::registry::ParamTy;
use crate::lobes::{LobeKind, tags};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::Path;

/// Deeper documents overflow the stack of those who write and read them.
const MAX_DEPTH: u32 = 1000;

pub fn run(global: &Global, file: &Path, explain: bool) -> Outcome {
    let material = global.material(file, &[])?;
    let tree = material.tree(&Globals::default())?;
    let depth = tree.size(tree.root()).depth;
    if depth > MAX_DEPTH {
        return Err(Failure::Script(format!(
            "error: the closure tree is {depth} nodes deep; up to {MAX_DEPTH} can be printed"
        )));
    }
    if global.json {
        let mut document = json!({ "shader": material.name(), "closure": node(&tree, tree.root()) });
        if explain {
            document["layering"] = layering(&material);
            document["removed"] = json!(material.program().removed());
        }
        return output::json(&document);
    }
    let mut text = format!("{}\n", material.name());
    outline(&tree, &mut text);
    if explain {
        layering_text(&layering(&material), &mut text);
        for line in material.program().removed() {
            let _ = writeln!(text, "{line}");
        }
    }
    output::write(&text)
}

/// By which rule layers scale what lies below them, and where `balanced` is not to be had, why.
fn layering(material: &Material) -> Value {
    let rule = match material.layering().rule {
        LayeringRule::Min => "min",
        LayeringRule::View => "view",
        LayeringRule::Balanced => "balanced",
    };
    let Some(balance) = material.balance() else { return json!({ "rule": rule }) };
    let lobes = balance.fates().into_iter().filter_map(|(kind, fate)| {
        let name = kind.spec().name;
        match fate {
            Fate::Uncovered => None,
            Fate::Balanced => Some(json!({ "lobe": name, "rule": "balanced" })),
            Fate::Min(why) => Some(json!({ "lobe": name, "rule": "min", "why": why.reason() })),
        }
    });
    if material.program().is_constant() {
        return json!({ "rule": rule, "lobes": lobes.collect::<Vec<_>>() });
    }
    let sites = material.program().sites();
    let name = |site: u32| sites[site as usize].kind.spec().name;
    let pairs =
        balance.pairs().into_iter().map(|(t, b)| json!({ "lobe": name(b), "below": name(t), "rule": "balanced" }));
    json!({ "rule": rule, "varies": true, "lobes": pairs.collect::<Vec<_>>() })
}

fn layering_text(layering: &Value, text: &mut String) {
    let word = |v: &Value| v.as_str().unwrap_or("").to_owned();
    let _ = writeln!(text, "layers scale by {}", word(&layering["rule"]));
    for lobe in layering["lobes"].as_array().into_iter().flatten() {
        let below = lobe["below"].as_str().map_or(String::new(), |top| format!(" below {top}"));
        let why = lobe["why"].as_str().map_or(String::new(), |why| format!(": {why}"));
        let _ = writeln!(text, "  {}{below}: {}{why}", word(&lobe["lobe"]), word(&lobe["rule"]));
    }
    if layering["varies"] == true {
        text.push_str("  everything else, where the tree varies: min\n");
    }
}

/// What an unfinished node waits for.
enum Step {
    Visit(NodeId),
    /// Takes as many finished terms as the number says.
    Add(usize),
    Mul([f32; 3]),
    Layer,
}

/// The tree as JSON; sums of sums become one sum. A loop, because sums may be very long.
fn node(tree: &ClosureTree, root: NodeId) -> Value {
    let mut steps = vec![Step::Visit(root)];
    let mut done: Vec<Value> = Vec::new();
    while let Some(step) = steps.pop() {
        match step {
            Step::Visit(id) => match tree.node(id) {
                Node::Zero => done.push(json!({"kind": "zero"})),
                Node::Lobe { kind, slots, .. } => done.push(lobe(kind, tree.values(kind, slots))),
                Node::Mul(weight, c) => steps.extend([Step::Mul(weight), Step::Visit(c)]),
                Node::Layer { top, base } => steps.extend([Step::Layer, Step::Visit(base), Step::Visit(top)]),
                Node::Add(..) => {
                    let terms = tree.terms(id);
                    steps.push(Step::Add(terms.len()));
                    steps.extend(terms.into_iter().rev().map(Step::Visit));
                }
            },
            Step::Add(count) => {
                let terms = done.split_off(done.len() - count);
                done.push(json!({"kind": "add", "terms": terms}));
            }
            Step::Mul(weight) => {
                let closure = done.pop();
                done.push(json!({"kind": "mul", "weight": numbers(&weight), "closure": closure}));
            }
            Step::Layer => {
                let (base, top) = (done.pop(), done.pop());
                done.push(json!({"kind": "layer", "top": top, "base": base}));
            }
        }
    }
    done.pop().unwrap_or(Value::Null)
}

fn lobe(kind: LobeKind, values: &[f32]) -> Value {
    let mut params = Map::new();
    let mut at = 0;
    for p in kind.spec().params {
        let slots = &values[at..at + p.ty.slots()];
        at += p.ty.slots();
        let value = match (p.ty, slots) {
            (ParamTy::String, [index]) if p.options.is_empty() => json!(tags::name(*index as usize)),
            (ParamTy::String, [index]) => json!(p.options.get(p.clamp(0, *index) as usize)),
            (ParamTy::Int, [x]) => json!(*x as i64),
            (_, [x]) => number(*x),
            (_, xs) => numbers(xs),
        };
        params.insert(p.name.to_owned(), value);
    }
    json!({"kind": "lobe", "name": kind.spec().name, "params": params})
}

/// The tree as indented lines.
fn outline(tree: &ClosureTree, text: &mut String) {
    let mut waiting = vec![(tree.root(), 1, String::new())];
    while let Some((id, depth, role)) = waiting.pop() {
        let indent = "  ".repeat(depth);
        let _ = write!(text, "{indent}{role}");
        match tree.node(id) {
            Node::Zero => text.push_str("black\n"),
            Node::Lobe { kind, slots, .. } => {
                let Value::Object(params) = &lobe(kind, tree.values(kind, slots))["params"] else { continue };
                let list: Vec<String> = params.iter().map(|(name, value)| format!("{name} {value}")).collect();
                let _ = writeln!(text, "{} ({})", kind.spec().name, list.join(", "));
            }
            Node::Mul([r, g, b], c) => {
                let _ = writeln!(text, "× {r} {g} {b}");
                waiting.push((c, depth + 1, String::new()));
            }
            Node::Layer { top, base } => {
                text.push_str("layer\n");
                waiting.push((base, depth + 1, "base: ".into()));
                waiting.push((top, depth + 1, "top: ".into()));
            }
            Node::Add(..) => {
                text.push_str("sum\n");
                waiting.extend(tree.terms(id).into_iter().rev().map(|t| (t, depth + 1, String::new())));
            }
        }
    }
}
