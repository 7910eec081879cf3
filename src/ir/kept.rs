//! The tree of a program that makes the same one at every point.
//!
//! Such a program reads globals only as the normals and tangents of lobes: only those slots differ between points.

use super::body::GlobalVar;
use super::program::{Instr, Program, ShadeError};
use crate::Globals;
use crate::closure::ClosureTree;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// A tree and what changes in it.
#[derive(Debug)]
pub struct Kept {
    /// Tells it from all others, so that a tree can remember whose copy it is.
    id: u64,
    tree: ClosureTree,
    /// The first of three slots, and the direction they hold.
    directions: Vec<(u32, GlobalVar)>,
    /// The same by site, slots counted within the block.
    of_site: Vec<Vec<(u32, GlobalVar)>>,
}

impl Kept {
    /// Runs a constant program.
    pub(super) fn new(program: &Program) -> Result<Kept, ShadeError> {
        static LAST: AtomicU64 = AtomicU64::new(0);
        let mut tree = ClosureTree::new();
        program.run(&Globals::default(), &mut tree)?;
        let held: HashMap<u32, GlobalVar> = program
            .code
            .iter()
            .filter_map(|instr| match *instr {
                Instr::Global { global, dst } => Some((dst, global)),
                _ => None,
            })
            .collect();
        let of_site: Vec<Vec<(u32, GlobalVar)>> = program
            .makers
            .iter()
            .map(|maker| maker.open.iter().filter_map(|(slot, reg)| Some((*slot, *held.get(reg)?))).collect())
            .collect();
        let directions = tree
            .lobe_slots()
            .flat_map(|(site, slots)| of_site[site as usize].iter().map(move |(slot, global)| (slots + slot, *global)))
            .collect();
        Ok(Kept { id: LAST.fetch_add(1, Ordering::Relaxed) + 1, tree, directions, of_site })
    }

    /// The global that the direction of a site is read from which begins at `slot` of its block; `None` if it is always the
    /// same.
    pub fn source(&self, site: u32, slot: usize) -> Option<GlobalVar> {
        let of_site = self.of_site.get(site as usize)?;
        of_site.iter().find(|(s, _)| *s as usize == slot).map(|(_, global)| *global)
    }

    /// The tree, with the directions of one point.
    pub fn tree(&self) -> &ClosureTree {
        &self.tree
    }

    /// Makes `tree` this tree at a shading point.
    pub fn give(&self, globals: &Globals, tree: &mut ClosureTree) {
        tree.become_copy(self.id, &self.tree);
        for (slot, global) in &self.directions {
            tree.set_direction(*slot, global.read(globals).map(f32::from_bits));
        }
    }
}
