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
    /// Lobes in it.
    all: BTreeSet<u32>,
}

impl Held {
    fn extend(&mut self, o: Held) {
        self.single.extend(o.single);
        self.open.extend(o.open);
        self.all.extend(o.all);
    }

    /// Both, as a sum.
    fn with(&self, o: &Held) -> Held {
        let mut sum = Held { single: BTreeSet::new(), ..self.clone() };
        sum.extend(Held { single: BTreeSet::new(), ..o.clone() });
        sum
    }
}

impl Program {
    /// Every pair of sites (top, base) such that the lobe made at `top` may be a whole top, and the one made at `base`
    /// lie below it and below no other layer. May name pairs that never come about; a pair that is missing rests on a
    /// term that happened to be black.
    pub fn layer_pairs(&self) -> Vec<(u32, u32)> {
        let mut pairs = BTreeSet::new();
        self.each_layer(|top, base| {
            pairs.extend(top.single.iter().flat_map(|t| base.open.iter().map(|b| (*t, *b))));
        });
        pairs.into_iter().collect()
    }

    /// Every site whose lobe may stand in the top of a layer.
    pub fn tops(&self) -> Vec<u32> {
        let mut tops = BTreeSet::new();
        self.each_layer(|top, _| tops.extend(&top.all));
        tops.into_iter().collect()
    }

    /// Calls `see` with what top and base of each layer may hold, at least once with all of it.
    fn each_layer(&self, mut see: impl FnMut(&Held, &Held)) {
        let mut held = vec![Held::default(); self.closures];
        // Without regard to the order in which registers are written: until nothing is new.
        loop {
            let before = held.clone();
            for instr in &self.code {
                let (dst, new) = match *instr {
                    Instr::Lobe { site, dst, .. } => {
                        let one = BTreeSet::from([site]);
                        (dst, Held { single: one.clone(), open: one.clone(), all: one })
                    }
                    Instr::CopyC { dst, src } => (dst, held[src as usize].clone()),
                    Instr::MulC { dst, closure, .. } => (dst, held[closure as usize].clone()),
                    Instr::AddC { dst, a, b } => (dst, held[a as usize].with(&held[b as usize])),
                    Instr::Layer { dst, top, base } => {
                        let (top, base) = (&held[top as usize], &held[base as usize]);
                        see(top, base);
                        (dst, Held { open: top.open.clone(), ..top.with(base) })
                    }
                    _ => continue,
                };
                held[dst as usize].extend(new);
            }
            if held == before {
                return;
            }
        }
    }
}
