//! The register program that a specialised shader is. [`machine`](super::machine) runs it.

use super::body::{GlobalVar, Op};
use super::host::Host;
use super::kept::Kept;
use super::tasks::Task;
use super::types::Ty;
use crate::Globals;
use crate::closure::{ClosureTree, TreeError};
use crate::diag::Diagnostic;
use crate::lobes::LobeKind;
use crate::span::Span;
use std::fmt;
use std::sync::{Arc, OnceLock};

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
    /// An operation on one cell each that gives one.
    Scalar {
        op: Op,
        dst: u32,
        a: u32,
        b: u32,
    },
    /// An operation on floats, component by component.
    Componentwise {
        op: Op,
        dst: u32,
        a: u32,
        b: u32,
    },
    /// A float in every component.
    Splat {
        dst: u32,
        a: u32,
    },
    /// Any operation.
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
    /// Noise of a kind that is known. `args` starts a list of registers: coordinates, then as many periods if it repeats.
    Noise {
        kind: u8,
        dimensions: u8,
        periodic: bool,
        width: u8,
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
    Copy1 {
        dst: u32,
        src: u32,
    },
    Copy3 {
        dst: u32,
        src: u32,
    },
    CopyC {
        dst: u32,
        src: u32,
    },
    /// By the entry of [`Program::makers`] for its site.
    Lobe {
        site: u32,
        dst: u32,
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

/// How the lobe of a site is made.
#[derive(Clone, Debug)]
pub(super) struct Maker {
    pub kind: LobeKind,
    /// Its parameter block, zero where the value is not known before shading.
    pub known: Vec<f32>,
    /// The slots that are not known, and their registers.
    pub open: Vec<(u32, u32)>,
}

/// A shader with its parameters fixed, ready to shade.
#[derive(Clone, Debug)]
pub struct Program {
    pub(super) code: Vec<Instr>,
    pub(super) args: Vec<u32>,
    /// What every cell starts with.
    pub(super) image: Vec<u32>,
    pub(super) closures: usize,
    pub(super) ci: u32,
    pub(super) sites: Vec<Site>,
    pub(super) makers: Vec<Maker>,
    pub(super) deeds: Vec<Call>,
    pub(super) layer_pairs: Vec<(u32, u32)>,
    pub(super) strings: Vec<String>,
    pub(super) globals: Vec<GlobalVar>,
    pub(super) constant: bool,
    /// The tree of a constant program, once it has been shaded; `None` for programs that run at every point.
    pub(super) kept: Option<OnceLock<Result<Arc<Kept>, ShadeError>>>,
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

    /// Makes `tree` the closure at a shading point. A constant program runs once; from then on its tree is copied, and a
    /// `tree` that it filled last time only has its directions brought up to date.
    ///
    /// # Errors
    /// The tree is larger, or loops run longer, than a budget allows; it is then black.
    pub fn shade(&self, globals: &Globals, tree: &mut ClosureTree) -> Result<(), ShadeError> {
        match self.kept() {
            None => return self.run(globals, tree),
            Some(Ok(kept)) => kept.give(globals, tree),
            Some(Err(e)) => {
                tree.clear();
                return Err(*e);
            }
        }
        Ok(())
    }

    /// The tree of a constant program. The first call makes it, so that no shading point has to.
    pub(crate) fn kept(&self) -> Option<&Result<Arc<Kept>, ShadeError>> {
        Some(self.kept.as_ref()?.get_or_init(|| Kept::new(self).map(Arc::new)))
    }
}
