//! The register program that a specialised shader is, and its interpreter.
//!
//! In: a shading point. Out: a closure tree. Typical programs run without touching the heap. Closures are shared, so a
//! few instructions can describe a tree of any size; going beyond the tree's budget is an error rather than a surprise
//! further down.

use super::body::{Cells, GlobalVar, Op};
use super::builtins::{BUILTINS, MAX_ARGS};
use super::host::Host;
use super::ops;
use super::tasks::{Strings, Surroundings, Task};
use super::types::Ty;
use crate::Globals;
use crate::closure::{ClosureTree, NodeId, TreeError};
use crate::diag::Diagnostic;
use crate::lobes::LobeKind;
use crate::span::Span;
use smallvec::SmallVec;
use std::fmt;
use std::sync::Arc;

/// Shading went beyond a budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadeError {
    /// The closure tree is too large.
    Tree(TreeError),
    /// Loops took more rounds than this.
    Iterations(u32),
}

impl From<TreeError> for ShadeError {
    fn from(e: TreeError) -> ShadeError {
        ShadeError::Tree(e)
    }
}

impl fmt::Display for ShadeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ShadeError::Tree(e) => e.fmt(f),
            ShadeError::Iterations(most) => {
                write!(
                    f,
                    "loops take more than {most} rounds at one point; `Limits::iterations` sets how many they may"
                )
            }
        }
    }
}

impl std::error::Error for ShadeError {}

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
    /// One of `len` values of `width` cells.
    Element {
        width: u8,
        dst: u32,
        base: u32,
        len: u32,
        index: u32,
    },
    ElementC {
        dst: u32,
        base: u32,
        len: u32,
        index: u32,
    },
    Store {
        width: u8,
        base: u32,
        len: u32,
        index: u32,
        src: u32,
    },
    StoreC {
        base: u32,
        len: u32,
        index: u32,
        src: u32,
    },
    /// One of [`Program::deeds`].
    Do {
        deed: u32,
    },
    /// A loop starts a round.
    Round,
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

/// A task with its registers.
#[derive(Clone, Debug)]
pub(super) struct Call {
    pub task: Task,
    pub args: Vec<(Ty, u32)>,
    pub outs: Vec<(Ty, u32)>,
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
    pub(super) deeds: Vec<Call>,
    pub(super) layer_pairs: Vec<(u32, u32)>,
    pub(super) strings: Vec<String>,
    pub(super) globals: Vec<GlobalVar>,
    pub(super) constant: bool,
    pub(super) host: Option<Arc<dyn Host>>,
    pub(super) iterations: u32,
    pub(super) removed: Vec<String>,
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

    /// What specialising removed, and why: one sentence each.
    pub fn removed(&self) -> &[String] {
        &self.removed
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
    /// The tree is larger, or loops run longer, than a budget allows; it is then black.
    pub fn shade(&self, globals: &Globals, tree: &mut ClosureTree) -> Result<(), ShadeError> {
        tree.clear();
        let mut cells: SmallVec<[u32; 512]> = SmallVec::from_slice(&self.image);
        let mut rounds = self.iterations;
        let mut strings = Strings::new(&self.strings);
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
                    let name = strings.get(cells[name as usize]);
                    // A name that is only known now and unknown to the lobe means its first option.
                    let index = options.iter().position(|option| *option == name).unwrap_or(0);
                    cells[dst as usize] = (index as f32).to_bits();
                }
                Instr::Element { .. } | Instr::ElementC { .. } | Instr::Store { .. } | Instr::StoreC { .. } => {
                    indexed(*instr, &mut cells, &mut closures);
                }
                Instr::Do { deed } => {
                    let host = self.host.as_deref();
                    let mut around = Surroundings { strings: &mut strings, host, globals };
                    self.deeds[deed as usize].run(&mut cells, &mut around);
                }
                Instr::Round => match rounds.checked_sub(1) {
                    Some(left) => rounds = left,
                    None => {
                        tree.set_root(tree.zero());
                        return Err(ShadeError::Iterations(self.iterations));
                    }
                },
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
        tree.within_budget().inspect_err(|_| tree.set_root(tree.zero()))?;
        Ok(())
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

impl Call {
    fn run(&self, cells: &mut [u32], around: &mut Surroundings) {
        let get = |(ty, reg): &(Ty, u32)| (*ty, read(cells, *reg, ty.cells()));
        let args: SmallVec<[(Ty, Cells); 32]> = self.args.iter().map(get).collect();
        let mut outs: SmallVec<[(Ty, Cells); 17]> = self.outs.iter().map(get).collect();
        self.task.run(&args, around, &mut outs);
        for ((ty, reg), (_, value)) in self.outs.iter().zip(outs) {
            write(cells, *reg, ty.cells(), value);
        }
    }
}

/// Reads or writes one of several registers.
fn indexed(instr: Instr, cells: &mut [u32], closures: &mut [NodeId]) {
    match instr {
        Instr::Element { width, dst, base, len, index } => {
            let at = limited(cells[index as usize], len);
            let value = read(cells, base + at * u32::from(width), width as usize);
            write(cells, dst, width as usize, value);
        }
        Instr::ElementC { dst, base, len, index } => {
            closures[dst as usize] = closures[(base + limited(cells[index as usize], len)) as usize];
        }
        Instr::Store { width, base, len, index, src } => {
            let at = limited(cells[index as usize], len);
            let value = read(cells, src, width as usize);
            write(cells, base + at * u32::from(width), width as usize, value);
        }
        Instr::StoreC { base, len, index, src } => {
            closures[(base + limited(cells[index as usize], len)) as usize] = closures[src as usize];
        }
        _ => {}
    }
}

/// An index limited to what there is.
fn limited(index: u32, len: u32) -> u32 {
    (index as i32).clamp(0, len as i32 - 1) as u32
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
