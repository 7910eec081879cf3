//! Which lobes a program may lay over which.

use super::program::{Instr, Program};
use std::collections::BTreeSet;

/// What a closure register may hold, by sites.
#[derive(Clone, Default, PartialEq)]
struct Held {
    /// Lobes it may be, weighted, and nothing else.
    single: BTreeSet<u32>,
    /// Lobes in it with no layer above them.
    open: BTreeSet<u32>,
}

impl Program {
    /// Every pair of sites (top, base) such that the lobe made at `top` may be a whole top, and the one made at `base`
    /// lie below it and below no other layer. May name pairs that never come about; a pair that is missing rests on a
    /// term that happened to be black.
    pub fn layer_pairs(&self) -> Vec<(u32, u32)> {
        let mut held = vec![Held::default(); self.closures];
        let mut pairs = BTreeSet::new();
        // Without regard to the order in which registers are written: until nothing is new.
        loop {
            let before = held.clone();
            for instr in &self.code {
                let (dst, new) = match *instr {
                    Instr::Lobe { site, dst, .. } => {
                        (dst, Held { single: BTreeSet::from([site]), open: BTreeSet::from([site]) })
                    }
                    Instr::CopyC { dst, src } => (dst, held[src as usize].clone()),
                    Instr::MulC { dst, closure, .. } => (dst, held[closure as usize].clone()),
                    Instr::AddC { dst, a, b } => {
                        let open = held[a as usize].open.union(&held[b as usize].open).copied().collect();
                        (dst, Held { single: BTreeSet::new(), open })
                    }
                    Instr::Layer { dst, top, base } => {
                        let (top, base) = (&held[top as usize], &held[base as usize]);
                        pairs.extend(top.single.iter().flat_map(|t| base.open.iter().map(|b| (*t, *b))));
                        (dst, Held { single: BTreeSet::new(), open: top.open.clone() })
                    }
                    _ => continue,
                };
                held[dst as usize].single.extend(new.single);
                held[dst as usize].open.extend(new.open);
            }
            if held == before {
                return pairs.into_iter().collect();
            }
        }
    }
}
