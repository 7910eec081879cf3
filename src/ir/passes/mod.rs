//! What happens to a body between checking and lowering: one pure function per file.

pub mod dead;
pub mod derive;
mod env;
pub mod fold;
pub mod layers;
pub mod needs;

use super::body::{Body, ExprId, ExprKind, Root};

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
