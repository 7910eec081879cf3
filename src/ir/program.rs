//! The register program that a specialised shader is, and its interpreter.
//!
//! In: a shading point. Out: a closure tree. Typical programs run without touching the heap. Closures are shared, so a
//! few instructions can describe a tree of any size; going beyond the tree's budget is an error rather than a surprise
//! further down.

use super::body::{Cells, GlobalVar, Op};
use super::builtins::{BUILTINS, MAX_ARGS};
use super::ops;
use crate::Globals;
use crate::closure::{ClosureTree, NodeId, TreeError};
use crate::diag::Diagnostic;
use crate::lobes::LobeKind;
use crate::span::Span;
use smallvec::SmallVec;

/// Shading went beyond a budget.
pub type ShadeError = TreeError;

/// One place in a program that makes a lobe.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// Which lobe.
    pub kind: LobeKind,
    /// Its parameter block; `None` where the value is not known before shading.
    pub values: Vec<Option<f32>>,
    /// The call in the script.
    pub span: Span,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Instr {
    Global {
        global: GlobalVar,
        dst: u32,
    },
    Op {
        op: Op,
        n: u8,
        width: u8,
        dst: u32,
        args: [u32; 3],
    },
    /// `args` starts a list of pairs: a register and its number of cells.
    Call {
        function: u16,
        width: u8,
        count: u8,
        dst: u32,
        args: u32,
    },
    OptionIndex {
        options: &'static [&'static str],
        dst: u32,
        name: u32,
    },
    Copy {
        n: u8,
        dst: u32,
        src: u32,
    },
    CopyC {
        dst: u32,
        src: u32,
    },
    /// `args` starts a list of one register per slot.
    Lobe {
        kind: LobeKind,
        site: u32,
        dst: u32,
        args: u32,
    },
    AddC {
        dst: u32,
        a: u32,
        b: u32,
    },
    MulC {
        dst: u32,
        weight: u32,
        closure: u32,
    },
    Layer {
        dst: u32,
        top: u32,
        base: u32,
    },
    Jump {
        to: u32,
    },
    JumpIfZero {
        condition: u32,
        to: u32,
    },
    JumpUnlessZero {
        condition: u32,
        to: u32,
    },
}

/// A shader with its parameters fixed, ready to shade.
#[derive(Clone, Debug)]
pub struct Program {
    pub(super) code: Vec<Instr>,
    pub(super) args: Vec<u32>,
    pub(super) image: Vec<u32>,
    pub(super) registers: usize,
    pub(super) closures: usize,
    pub(super) ci: u32,
    pub(super) sites: Vec<Site>,
    pub(super) layer_pairs: Vec<(u32, u32)>,
    pub(super) strings: Vec<String>,
    pub(super) globals: Vec<GlobalVar>,
    pub(super) constant: bool,
    /// Values set outside their declared range.
    pub warnings: Vec<Diagnostic>,
}

impl Program {
    /// Whether the tree is the same at every point, up to the directions that lobes take as their normals and tangents
    /// straight from the globals.
    pub fn is_constant(&self) -> bool {
        self.constant
    }

    /// The globals that live code reads.
    pub fn globals(&self) -> &[GlobalVar] {
        &self.globals
    }

    /// One entry for each place that makes a lobe; [`ClosureTree::lobe`] receives the index.
    pub fn sites(&self) -> &[Site] {
        &self.sites
    }

    /// Every pair of sites (top, base) such that the lobe made at `top` may be a whole top, and the one made at `base`
    /// lie below it and below no other layer. May name pairs that never come about.
    pub fn layer_pairs(&self) -> &[(u32, u32)] {
        &self.layer_pairs
    }

    /// Number of instructions.
    pub fn len(&self) -> usize {
        self.code.len()
    }

    /// Whether there is nothing to do: the material is black.
    pub fn is_empty(&self) -> bool {
        self.code.is_empty()
    }

    /// Makes `tree` the closure at a shading point.
    ///
    /// # Errors
    /// The tree is larger than a budget allows; it is then black.
    pub fn shade(&self, globals: &Globals, tree: &mut ClosureTree) -> Result<(), ShadeError> {
        tree.clear();
        let mut cells: SmallVec<[u32; 160]> = SmallVec::from_slice(&self.image);
        cells.resize(self.registers, 0);
        let mut closures: SmallVec<[NodeId; 32]> = SmallVec::from_elem(tree.zero(), self.closures);
        let mut at = 0;
        while let Some(instr) = self.code.get(at) {
            at += 1;
            match *instr {
                Instr::Global { global, dst } => write(&mut cells, dst, global.ty().cells(), global.read(globals)),
                Instr::Op { op, n, width, dst, args } => {
                    let [a, b, c] = args.map(|reg| read(&cells, reg, 3));
                    write(&mut cells, dst, width as usize, ops::apply(op, n as usize, a, b, c));
                }
                Instr::Call { function, width, count, dst, args } => {
                    let value = self.call(&cells, function, width, count, args);
                    write(&mut cells, dst, width as usize, value);
                }
                Instr::OptionIndex { options, dst, name } => {
                    let name = self.strings.get(cells[name as usize] as usize).map_or("", String::as_str);
                    // A name that is only known now and unknown to the lobe means its first option.
                    let index = options.iter().position(|option| *option == name).unwrap_or(0);
                    cells[dst as usize] = (index as f32).to_bits();
                }
                Instr::Copy { n, dst, src } => {
                    let value = read(&cells, src, n as usize);
                    write(&mut cells, dst, n as usize, value);
                }
                Instr::CopyC { dst, src } => closures[dst as usize] = closures[src as usize],
                Instr::Lobe { kind, site, dst, args } => {
                    let slots = &self.args[args as usize..args as usize + kind.spec().slot_count()];
                    let values: SmallVec<[f32; 32]> =
                        slots.iter().map(|reg| f32::from_bits(cells[*reg as usize])).collect();
                    closures[dst as usize] = tree.lobe(kind, site, &values);
                }
                Instr::AddC { dst, a, b } => {
                    closures[dst as usize] = tree.add(closures[a as usize], closures[b as usize]);
                }
                Instr::MulC { dst, weight, closure } => {
                    let weight = read(&cells, weight, 3).map(f32::from_bits);
                    closures[dst as usize] = tree.mul(weight, closures[closure as usize]);
                }
                Instr::Layer { dst, top, base } => {
                    closures[dst as usize] = tree.layer(closures[top as usize], closures[base as usize]);
                }
                Instr::Jump { to } => at = to as usize,
                Instr::JumpIfZero { condition, to } => {
                    if cells[condition as usize] == 0 {
                        at = to as usize;
                    }
                }
                Instr::JumpUnlessZero { condition, to } => {
                    if cells[condition as usize] != 0 {
                        at = to as usize;
                    }
                }
            }
        }
        tree.set_root(closures[self.ci as usize]);
        tree.within_budget().inspect_err(|_| tree.set_root(tree.zero()))
    }

    fn call(&self, cells: &[u32], function: u16, width: u8, count: u8, args: u32) -> Cells {
        let mut values = [[0; 3]; MAX_ARGS];
        let pairs = self.args[args as usize..].chunks_exact(2).take(count as usize);
        for (value, pair) in values.iter_mut().zip(pairs) {
            *value = read(cells, pair[0], pair[1] as usize);
        }
        BUILTINS[function as usize].apply(width as usize, &values[..count as usize])
    }
}

/// Up to `n` cells; what lies beyond the registers reads as zero.
fn read(cells: &[u32], reg: u32, n: usize) -> Cells {
    let mut out = [0; 3];
    for (out, cell) in out.iter_mut().zip(cells.get(reg as usize..).unwrap_or(&[])).take(n) {
        *out = *cell;
    }
    out
}

fn write(cells: &mut [u32], reg: u32, n: usize, value: Cells) {
    cells[reg as usize..reg as usize + n].copy_from_slice(&value[..n]);
}
