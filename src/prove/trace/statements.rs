//! Loops, arrays and tasks in the trace.

use super::super::graph::{Id, LeafKind, Node, Order};
use super::super::interval::Interval;
use super::{Held, MAX_STEPS, Tracer};
use crate::ir::Ty;
use crate::ir::body::{Cells, Deed, Root, Stmt, VarId};
use crate::ir::tasks::{Strings, Surroundings, Task};

/// Rounds of a loop that are followed although it is open whether they are taken.
pub(super) const MAX_OPEN_ROUNDS: usize = 32;
/// The most elements of which one is chosen by an index that is not known.
const MAX_CHOICE: u32 = 256;

impl Tracer<'_> {
    /// Round after round; where it is open whether there is another one, both are followed.
    pub(super) fn rounds(&mut self, before: &[Stmt], condition: Root, body: &[Stmt], left: usize) -> Option<()> {
        loop {
            self.block(before)?;
            let Held::Cells([holds, ..]) = self.run(condition)? else { return None };
            match self.graph.value(holds) {
                Some(0.0) => return Some(()),
                Some(_) => self.block(body)?,
                None => {
                    self.steps += 2 * self.env.len();
                    if left == 0 || self.steps > MAX_STEPS {
                        return None;
                    }
                    let out = self.env.clone();
                    let assumed = self.assume(holds, true);
                    self.block(body)?;
                    self.rounds(before, condition, body, left - 1)?;
                    self.unassume(assumed);
                    for (var, other) in out.into_iter().enumerate() {
                        let then = self.env[var];
                        if then != other {
                            self.env[var] = self.choice(holds, then, other);
                        }
                    }
                    return Some(());
                }
            }
        }
    }

    /// Goes on as if a condition held, or did not: choices that it settles are taken. What variables held before and hold
    /// now goes to [`Tracer::unassume`].
    pub(super) fn assume(&mut self, condition: Id, holds: bool) -> Vec<(usize, Held, Held)> {
        let mut settled = Vec::new();
        let mut waiting = vec![(condition, holds)];
        while let Some((id, holds)) = waiting.pop() {
            settled.push((id, holds));
            let other = |id: Id| self.graph.value(id).is_some_and(|x| (x != 0.0) != holds);
            match self.graph.node(id) {
                Node::Not(a) => waiting.push((a, !holds)),
                Node::Truth(a) => waiting.push((a, holds)),
                Node::And(a, b) if holds => waiting.extend([(a, true), (b, true)]),
                Node::Or(a, b) if !holds => waiting.extend([(a, false), (b, false)]),
                Node::Select(c, a, b) if other(b) => waiting.extend([(c, true), (a, holds)]),
                Node::Select(c, a, b) if other(a) => waiting.extend([(c, false), (b, holds)]),
                _ => {}
            }
        }
        let mut changed = Vec::new();
        for (var, held) in self.env.iter_mut().enumerate() {
            let before = *held;
            let Held::Cells(ids) = held else { continue };
            for id in ids {
                while let Node::Select(c, a, b) = self.graph.node(*id)
                    && let Some((_, holds)) = settled.iter().find(|(s, _)| *s == c)
                {
                    *id = if *holds { a } else { b };
                }
            }
            if *held != before {
                changed.push((var, before, *held));
            }
        }
        changed
    }

    /// Gives variables that still hold what was assumed what they held before.
    pub(super) fn unassume(&mut self, assumed: Vec<(usize, Held, Held)>) {
        for (var, before, after) in assumed {
            if self.env[var] == after {
                self.env[var] = before;
            }
        }
    }

    /// One of several variables.
    pub(super) fn element(&mut self, base: VarId, len: u32, index: Id) -> Held {
        let at = |i: u32| (base.0 + i) as usize;
        if let Some(i) = self.graph.value(index) {
            return self.env[at(i.clamp(0.0, f64::from(len - 1)) as u32)];
        }
        let mut value = self.env[at(len - 1)];
        for i in (0..len - 1).rev() {
            let limit = self.graph.push(Node::Int(i as i32));
            let up_to = self.graph.push(Node::Compare(Order::AtMost, index, limit));
            value = self.choice(up_to, self.env[at(i)], value);
        }
        value
    }

    pub(super) fn store(&mut self, base: VarId, len: u32, index: VarId, value: VarId) -> Option<()> {
        let (Held::Cells([index, ..]), new) = (self.env[index.index()], self.env[value.index()]) else { return None };
        let at = |i: u32| (base.0 + i) as usize;
        if let Some(i) = self.graph.value(index) {
            self.env[at(i.clamp(0.0, f64::from(len - 1)) as u32)] = new;
            return Some(());
        }
        self.steps += len as usize;
        if len > MAX_CHOICE || self.steps > MAX_STEPS {
            return None;
        }
        let mut below = self.graph.push(Node::Int(0));
        for i in 0..len {
            let limit = self.graph.push(Node::Int(i as i32));
            // The last element takes what lies beyond.
            let up_to = match i + 1 == len {
                true => self.graph.push(Node::Int(1)),
                false => self.graph.push(Node::Compare(Order::AtMost, index, limit)),
            };
            let above = self.graph.push(Node::Not(below));
            let here = self.graph.push(Node::And(up_to, above));
            self.env[at(i)] = self.choice(here, new, self.env[at(i)]);
            below = up_to;
        }
        Some(())
    }

    /// What a task leaves, if all it is given is known; else anything.
    pub(super) fn deed(&mut self, deed: &Deed) {
        let asked = deed.task.asks(self.answers);
        let cells = |held: Held| match held {
            Held::Cells(ids) => ids,
            Held::Closure(_) => [Id(0); 3],
        };
        if let (Task::Between(_), false) = (deed.task, asked) {
            // Without a host every space is the same.
            self.env[deed.outs[0].index()] = self.env[deed.args[2].index()];
            return;
        }
        let ty = |var: &VarId| self.body.vars[var.index()];
        let known: Option<Vec<(Ty, Cells)>> = deed
            .args
            .iter()
            .map(|arg| {
                let ids = cells(self.env[arg.index()]);
                let mut bits = [0; 3];
                for k in 0..ty(arg).cells() {
                    bits[k] = self.graph.bits(ids[k])?;
                }
                Some((ty(arg), bits))
            })
            .collect();
        if let Some(args) = known.filter(|_| !asked && deed.task != Task::IsConstant) {
            let mut outs: Vec<(Ty, Cells)> = deed.outs.iter().map(|var| (ty(var), [0; 3])).collect();
            let mut strings = Strings::new(&self.body.strings);
            let globals = crate::Globals::default();
            deed.task.run(&args, &mut Surroundings { strings: &mut strings, host: None, globals: &globals }, &mut outs);
            if strings.into_made().is_empty() {
                for (var, (ty, bits)) in deed.outs.iter().zip(outs) {
                    self.env[var.index()] = self.constant(bits, ty);
                }
                return;
            }
        }
        for var in &deed.outs {
            let ids = match deed.task {
                // Pictures hold what reflects: 0 to 1.
                Task::Texture => std::array::from_fn(|_| {
                    self.opaque += 1;
                    self.graph.leaf(LeafKind::Picture(self.opaque), Interval::new(0.0, 1.0), false)
                }),
                _ => [self.opaque(), self.opaque(), self.opaque()],
            };
            self.env[var.index()] = Held::Cells(ids);
        }
    }
}
