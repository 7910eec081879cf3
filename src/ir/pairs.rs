//! Which lobes a program may lay over which.

use super::program::{Instr, Program};
use smallvec::{SmallVec, smallvec};
use std::collections::{BTreeSet, HashSet};

/// Registers looked at in search of pairs, at most: every layer looks through its whole base.
const BUDGET: usize = 1 << 16;

/// The closure registers an instruction reads.
fn operands(instr: Instr) -> SmallVec<[u32; 2]> {
    match instr {
        Instr::CopyC { src, .. } => smallvec![src],
        Instr::MulC { closure, .. } => smallvec![closure],
        Instr::AddC { a, b, .. } => smallvec![a, b],
        Instr::Layer { top, base, .. } => smallvec![top, base],
        _ => smallvec![],
    }
}

impl Program {
    /// Every pair of sites (top, base) such that the lobe made at `top` may be a whole top, and the one made at `base`
    /// lie below it and below no other layer. May name pairs that never come about. A pair is missing where it rests on
    /// a term that happened to be black, or in programs of very many layers.
    pub fn layer_pairs(&self) -> Vec<(u32, u32)> {
        let writers = self.writers();
        let mut budget = BUDGET;
        let mut pairs = BTreeSet::new();
        for instr in &self.code {
            let Instr::Layer { top, base, .. } = *instr else { continue };
            let single = |i: Instr| match i {
                Instr::CopyC { .. } | Instr::MulC { .. } => operands(i),
                _ => smallvec![],
            };
            let open = |i: Instr| match i {
                Instr::Layer { top, .. } => smallvec![top],
                _ => operands(i),
            };
            let tops = self.reach(&writers, &[top], &mut budget, single);
            let bases = self.reach(&writers, &[base], &mut budget, open);
            pairs.extend(tops.iter().flat_map(|t| bases.iter().map(|b| (*t, *b))));
            if budget == 0 {
                break;
            }
        }
        pairs.into_iter().collect()
    }

    /// Every site whose lobe may stand in the top of a layer.
    pub fn tops(&self) -> Vec<u32> {
        let tops = self.code.iter().filter_map(|i| match i {
            Instr::Layer { top, .. } => Some(*top),
            _ => None,
        });
        let tops: Vec<u32> = tops.collect();
        if tops.is_empty() {
            return vec![];
        }
        self.reach(&self.writers(), &tops, &mut usize::MAX.clone(), operands)
    }

    /// The instructions that write each closure register. Their order does not matter here.
    fn writers(&self) -> Vec<Vec<usize>> {
        let mut writers = vec![vec![]; self.closures];
        for (at, instr) in self.code.iter().enumerate() {
            match *instr {
                Instr::Lobe { dst, .. }
                | Instr::CopyC { dst, .. }
                | Instr::MulC { dst, .. }
                | Instr::AddC { dst, .. }
                | Instr::Layer { dst, .. } => writers[dst as usize].push(at),
                _ => {}
            }
        }
        writers
    }

    /// The sites of all lobes that registers reachable from `from` may hold, going on as `follow` says.
    fn reach(
        &self,
        writers: &[Vec<usize>],
        from: &[u32],
        budget: &mut usize,
        follow: impl Fn(Instr) -> SmallVec<[u32; 2]>,
    ) -> Vec<u32> {
        let mut seen: HashSet<u32> = from.iter().copied().collect();
        let mut waiting: Vec<u32> = seen.iter().copied().collect();
        let mut sites = BTreeSet::new();
        while let Some(register) = waiting.pop() {
            *budget = budget.saturating_sub(1);
            if *budget == 0 {
                break;
            }
            for at in &writers[register as usize] {
                let instr = self.code[*at];
                if let Instr::Lobe { site, .. } = instr {
                    sites.insert(site);
                }
                waiting.extend(follow(instr).into_iter().filter(|r| seen.insert(*r)));
            }
        }
        sites.into_iter().collect()
    }
}
