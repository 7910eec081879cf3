//! Runs a register program.
//!
//! In: a shading point. Out: a closure tree. Typical programs run without touching the heap. Closures are shared, so a
//! few instructions can describe a tree of any size; going beyond the tree's budget is an error rather than a surprise
//! further down.

use super::body::Cells;
use super::builtins::{BUILTINS, MAX_ARGS};
use super::functions::{near, noise};
use super::ops;
use super::program::{Call, Instr, Program, ShadeError};
use super::tasks::{Strings, Surroundings};
use super::types::Ty;
use crate::Globals;
use crate::closure::{ClosureTree, NodeId};
use crate::lobes::registry::option_index;
use smallvec::SmallVec;

impl Program {
    /// Makes `tree` the closure at a shading point, from the first instruction to the last.
    pub(super) fn run(&self, globals: &Globals, tree: &mut ClosureTree) -> Result<(), ShadeError> {
        tree.clear();
        let mut cells: SmallVec<[u32; 512]> = SmallVec::from_slice(&self.image);
        let mut closures: SmallVec<[NodeId; 32]> = SmallVec::new();
        closures.resize(self.closures, tree.zero());
        let (cells, closures) = (&mut cells[..], &mut closures[..]);
        let mut rounds = self.iterations;
        let mut strings = Strings::new(&self.strings);
        let mut at = 0;
        while let Some(instr) = self.code.get(at) {
            at += 1;
            match *instr {
                Instr::Global { global, dst } => write(cells, dst, global.ty().cells(), global.read(globals)),
                Instr::Scalar { op, dst, a, b } => {
                    cells[dst as usize] = ops::scalar(op, cells[a as usize], cells[b as usize]);
                }
                Instr::Componentwise { op, dst, a, b } => {
                    let value = ops::componentwise(op, triple(cells, a), triple(cells, b));
                    write3(cells, dst, value);
                }
                Instr::Splat { dst, a } => write3(cells, dst, [cells[a as usize]; 3]),
                Instr::Op { op, n, width, dst, args } => {
                    let [a, b, c] = args.map(|reg| read(cells, reg, 3));
                    write(cells, dst, width as usize, ops::apply(op, n as usize, a, b, c));
                }
                Instr::Call { .. } | Instr::Noise { .. } => self.function(instr, cells),
                Instr::OptionIndex { options, dst, name } => {
                    let name = strings.get(cells[name as usize]);
                    // A name that is only known now and unknown to the lobe means its first option.
                    let index = option_index(options, name).unwrap_or(0);
                    cells[dst as usize] = (index as f32).to_bits();
                }
                Instr::Element { .. } | Instr::ElementC { .. } | Instr::Store { .. } | Instr::StoreC { .. } => {
                    indexed(*instr, cells, closures);
                }
                Instr::Do { deed } => {
                    let host = self.host.as_deref();
                    let mut around = Surroundings { strings: &mut strings, host, globals };
                    self.deeds[deed as usize].run(cells, &mut around);
                }
                Instr::Round => match rounds.checked_sub(1) {
                    Some(left) => rounds = left,
                    None => {
                        tree.set_root(tree.zero());
                        return Err(ShadeError::Iterations(self.iterations));
                    }
                },
                Instr::Copy1 { dst, src } => cells[dst as usize] = cells[src as usize],
                Instr::Copy3 { dst, src } => write3(cells, dst, triple(cells, src)),
                Instr::CopyC { dst, src } => closures[dst as usize] = closures[src as usize],
                Instr::Lobe { .. } | Instr::AddC { .. } | Instr::MulC { .. } | Instr::Layer { .. } => {
                    self.compose(*instr, cells, closures, tree);
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

    /// Makes a node.
    #[inline(always)]
    fn compose(&self, instr: Instr, cells: &[u32], closures: &mut [NodeId], tree: &mut ClosureTree) {
        match instr {
            Instr::Lobe { site, dst } => {
                let maker = &self.makers[site as usize];
                let open = maker.open.iter().map(|(slot, reg)| (*slot, f32::from_bits(cells[*reg as usize])));
                closures[dst as usize] = tree.lobe_from(maker.kind, site, &maker.known, open);
            }
            Instr::AddC { dst, a, b } => {
                closures[dst as usize] = tree.add(closures[a as usize], closures[b as usize]);
            }
            Instr::MulC { dst, weight, closure } => {
                let weight = triple(cells, weight).map(f32::from_bits);
                closures[dst as usize] = tree.mul(weight, closures[closure as usize]);
            }
            Instr::Layer { dst, top, base } => {
                closures[dst as usize] = tree.layer(closures[top as usize], closures[base as usize]);
            }
            _ => {}
        }
    }

    /// Calls a function. Apart from [`run`](Self::run), whose loop would have no registers left beside it.
    #[inline(never)]
    fn function(&self, instr: &Instr, cells: &mut [u32]) {
        match *instr {
            Instr::Call { function, width, count, dst, args } => {
                let mut values = [[0; 3]; MAX_ARGS];
                let pairs = self.args[args as usize..].chunks_exact(2).take(count as usize);
                for (value, pair) in values.iter_mut().zip(pairs) {
                    *value = read(cells, pair[0], pair[1] as usize);
                }
                let value = BUILTINS[function as usize].apply(width as usize, &values[..count as usize]);
                write(cells, dst, width as usize, value);
            }
            Instr::Noise { kind, dimensions, periodic, width, dst, args } => {
                let (kind, regs) = (kind as usize, &self.args[args as usize..]);
                if width == 1 && !periodic {
                    let near = match dimensions {
                        1 => near_noise::<1>(kind, regs, cells),
                        2 => near_noise::<2>(kind, regs, cells),
                        3 => near_noise::<3>(kind, regs, cells),
                        _ => near_noise::<4>(kind, regs, cells),
                    };
                    if let Some(value) = near {
                        cells[dst as usize] = value.to_bits();
                        return;
                    }
                }
                let n = dimensions as usize;
                let mut at = noise::At { x: [[0.0]; 4], n, period: [[0.0]; 4] };
                let periods = if periodic { &mut at.period[..n] } else { &mut [] };
                for (x, reg) in at.x[..n].iter_mut().chain(periods).zip(regs) {
                    *x = [f32::from_bits(cells[*reg as usize])];
                }
                for channel in 0..u32::from(width) {
                    cells[(dst + channel) as usize] = noise::noise(kind, &at, channel)[0].to_bits();
                }
            }
            _ => {}
        }
    }
}

/// Noise of one number where it is worked out fastest.
#[inline(always)]
fn near_noise<const N: usize>(kind: usize, regs: &[u32], cells: &[u32]) -> Option<f32> {
    let regs = regs.first_chunk::<N>()?;
    // A loop: `map` is a call.
    let mut x = [0.0; N];
    for d in 0..N {
        x[d] = f32::from_bits(cells[regs[d] as usize]);
    }
    near::is_near(kind, &x).then(|| near::near(kind, x))
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

/// Three cells.
fn triple(cells: &[u32], reg: u32) -> Cells {
    let from = &cells[reg as usize..reg as usize + 3];
    [from[0], from[1], from[2]]
}

/// Values have one cell or three; a copy of any other length would be a call.
fn write(cells: &mut [u32], reg: u32, n: usize, value: Cells) {
    match n {
        1 => cells[reg as usize] = value[0],
        _ => write3(cells, reg, value),
    }
}

fn write3(cells: &mut [u32], reg: u32, value: Cells) {
    cells[reg as usize..reg as usize + 3].copy_from_slice(&value);
}
