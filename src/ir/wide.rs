//! Runs a register program at several points at once.
//!
//! A register holds one cell per lane, so that the cost of reading an instruction is shared and arithmetic is done side
//! by side. Lanes that take different ways at a branch part and meet again: those that are least far go on, the others
//! wait until they are caught up with. Every lane gets bit for bit what [`machine`](super::machine) gets.

use super::body::Cells;
use super::builtins::{BUILTINS, Eval, MAX_ARGS};
use super::functions::noise;
use super::ops;
use super::program::{Call, Instr, Program, ShadeError};
use super::tasks::{Strings, Surroundings};
use super::types::Ty;
use crate::Globals;
use crate::closure::{ClosureTree, NodeId};
use smallvec::SmallVec;

/// Points that are shaded side by side.
pub const LANES: usize = 8;

/// A cell of every lane.
pub type Row = [u32; LANES];

/// A set of lanes, a bit each.
type Lanes = u32;

/// Registers, kept from one run to the next.
#[derive(Clone, Debug, Default)]
pub struct Registers {
    cells: Vec<Row>,
    closures: Vec<[NodeId; LANES]>,
}

/// A run at up to [`LANES`] points.
struct Wide<'a> {
    program: &'a Program,
    points: &'a [Globals],
    trees: &'a mut [ClosureTree],
    cells: &'a mut [Row],
    closures: &'a mut [[NodeId; LANES]],
    strings: Strings<'a>,
    /// Rounds left to loops.
    rounds: [u32; LANES],
    /// Every lane that has a point.
    all: Lanes,
    /// The lanes that instructions are carried out for.
    live: Lanes,
    /// Lanes that are further on, and where; the nearest last.
    waiting: SmallVec<[(u32, Lanes); 8]>,
    errors: [Option<ShadeError>; LANES],
}

/// Makes each of `trees` the closure at the point of the same number; there are at most [`LANES`].
pub fn run(
    program: &Program,
    points: &[Globals],
    trees: &mut [ClosureTree],
    registers: &mut Registers,
) -> [Option<ShadeError>; LANES] {
    let zero = ClosureTree::new().zero();
    trees.iter_mut().for_each(ClosureTree::clear);
    registers.cells.clear();
    registers.cells.extend(program.image.iter().map(|cell| [*cell; LANES]));
    registers.closures.clear();
    registers.closures.resize(program.closures, [zero; LANES]);
    let all = (1 << points.len().min(LANES)) - 1;
    let mut wide = Wide {
        program,
        points,
        trees,
        cells: &mut registers.cells,
        closures: &mut registers.closures,
        strings: Strings::new(&program.strings),
        rounds: [program.iterations; LANES],
        all,
        live: all,
        waiting: SmallVec::new(),
        errors: [None; LANES],
    };
    wide.go();
    wide.finish();
    wide.errors
}

/// The cells of a row as floats. (A loop: `map` is a call.)
#[inline(always)]
fn floats(row: &Row) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        out[l] = f32::from_bits(row[l]);
    }
    out
}

#[inline(always)]
fn bits(values: &[f32; LANES]) -> Row {
    let mut out = [0; LANES];
    for l in 0..LANES {
        out[l] = values[l].to_bits();
    }
    out
}

/// The lanes of a set.
#[inline(always)]
fn each(mut lanes: Lanes) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (lanes != 0).then(|| lanes.trailing_zeros() as usize)?;
        lanes &= lanes - 1;
        Some(lane)
    })
}

impl Wide<'_> {
    fn go(&mut self) {
        let code = &self.program.code[..];
        let (mut at, mut meet) = (0, usize::MAX);
        while self.live != 0 {
            if at >= meet {
                (at, meet) = self.meet(at);
            }
            let Some(instr) = code.get(at) else { return };
            at += 1;
            match *instr {
                Instr::Scalar { op, dst, a, b } => {
                    let value = ops::wide(op, &self.cells[a as usize], &self.cells[b as usize]);
                    self.put(dst, value);
                }
                Instr::Componentwise { op, dst, a, b } => {
                    let value: [Row; 3] = std::array::from_fn(|k| {
                        ops::wide(op, &self.cells[a as usize + k], &self.cells[b as usize + k])
                    });
                    self.put3(dst, value);
                }
                Instr::Splat { dst, a } => self.put3(dst, [self.cells[a as usize]; 3]),
                Instr::Copy1 { dst, src } => self.put(dst, self.cells[src as usize]),
                Instr::Copy3 { dst, src } => self.put3(dst, self.triple(src)),
                Instr::Noise { .. } => self.noise(*instr),
                Instr::Call { .. } => self.call(*instr),
                Instr::Jump { to } => {
                    at = to as usize;
                }
                Instr::JumpIfZero { condition, to } => {
                    let jump = self.zero(condition);
                    (at, meet) = self.part(jump, at, to as usize);
                }
                Instr::JumpUnlessZero { condition, to } => {
                    let jump = self.live & !self.zero(condition);
                    (at, meet) = self.part(jump, at, to as usize);
                }
                Instr::Round => {
                    self.round();
                    if self.live == 0 {
                        (at, meet) = self.next();
                    }
                }
                Instr::Lobe { .. } | Instr::AddC { .. } | Instr::MulC { .. } | Instr::Layer { .. } => {
                    self.compose(*instr);
                }
                _ => self.by_lane(*instr),
            }
        }
    }

    /// Roots, and what went beyond a budget.
    fn finish(&mut self) {
        for (lane, tree) in self.trees.iter_mut().enumerate() {
            let error = match self.errors[lane] {
                Some(e) => Some(e),
                None => {
                    tree.set_root(self.closures[self.program.ci as usize][lane]);
                    tree.within_budget().err().map(ShadeError::from)
                }
            };
            if error.is_some() {
                tree.set_root(tree.zero());
            }
            self.errors[lane] = error;
        }
    }

    /// The live lanes whose cell is zero.
    fn zero(&self, cell: u32) -> Lanes {
        let zeros = self.cells[cell as usize].iter().enumerate().map(|(lane, x)| u32::from(*x == 0) << lane);
        self.live & zeros.sum::<u32>()
    }

    /// Some lanes jump: those that are less far go on. Where they are, and where the next are met.
    fn part(&mut self, jump: Lanes, at: usize, to: usize) -> (usize, usize) {
        if jump == 0 {
            return (at, self.nearest());
        }
        if jump == self.live {
            return (to, self.nearest());
        }
        let stay = self.live & !jump;
        let (here, there) = if at < to { (stay, (to, jump)) } else { (jump, (at, stay)) };
        self.live = here;
        self.wait(there.0, there.1);
        (at.min(to), self.nearest())
    }

    fn wait(&mut self, at: usize, lanes: Lanes) {
        let at = at as u32;
        let place = self.waiting.iter().position(|(other, _)| *other <= at).unwrap_or(self.waiting.len());
        match self.waiting.get_mut(place) {
            Some(group) if group.0 == at => group.1 |= lanes,
            _ => self.waiting.insert(place, (at, lanes)),
        }
    }

    fn nearest(&self) -> usize {
        self.waiting.last().map_or(usize::MAX, |group| group.0 as usize)
    }

    /// The lanes at hand have come to those that wait, or past them.
    fn meet(&mut self, at: usize) -> (usize, usize) {
        let live = std::mem::replace(&mut self.live, 0);
        self.wait(at, live);
        self.next()
    }

    /// Goes on with the lanes that are least far.
    fn next(&mut self) -> (usize, usize) {
        match self.waiting.pop() {
            Some((at, lanes)) => {
                self.live = lanes;
                (at as usize, self.nearest())
            }
            None => (usize::MAX, usize::MAX),
        }
    }

    /// A loop starts a round; lanes that have none left stop.
    fn round(&mut self) {
        for lane in each(self.live) {
            match self.rounds[lane].checked_sub(1) {
                Some(left) => self.rounds[lane] = left,
                None => {
                    self.errors[lane] = Some(ShadeError::Iterations(self.program.iterations));
                    self.live &= !(1 << lane);
                }
            }
        }
    }

    #[inline(always)]
    fn put(&mut self, dst: u32, value: Row) {
        let row = &mut self.cells[dst as usize];
        if self.live == self.all {
            *row = value;
        } else {
            blend(row, &value, self.live);
        }
    }

    #[inline(always)]
    fn put3(&mut self, dst: u32, value: [Row; 3]) {
        for k in 0..3 {
            self.put(dst + k, value[k as usize]);
        }
    }

    fn triple(&self, reg: u32) -> [Row; 3] {
        std::array::from_fn(|k| self.cells[reg as usize + k])
    }

    fn noise(&mut self, instr: Instr) {
        let Instr::Noise { kind, dimensions, periodic, width, dst, args } = instr else { return };
        let n = dimensions as usize;
        let regs = &self.program.args[args as usize..];
        let mut at = noise::At { x: [[0.0; LANES]; 4], n, period: [[0.0; LANES]; 4] };
        for (x, reg) in at.x.iter_mut().zip(&regs[..n]) {
            *x = floats(&self.cells[*reg as usize]);
        }
        if periodic {
            for (period, reg) in at.period.iter_mut().zip(&regs[n..2 * n]) {
                *period = floats(&self.cells[*reg as usize]);
            }
        }
        for channel in 0..u32::from(width) {
            self.put(dst + channel, bits(&noise::noise(kind as usize, &at, channel)));
        }
    }

    fn call(&mut self, instr: Instr) {
        let Instr::Call { function, width, count, dst, args } = instr else { return };
        let builtin = &BUILTINS[function as usize];
        let pairs = &self.program.args[args as usize..][..2 * count as usize];
        for k in 0..width as usize {
            let row = |i: usize| floats(&self.cells[pairs[2 * i] as usize + k]);
            let value: Row = match builtin.eval {
                Eval::F1(f) => {
                    let a = row(0);
                    std::array::from_fn(|l| f(a[l]).to_bits())
                }
                Eval::F2(f) => {
                    let (a, b) = (row(0), row(1));
                    std::array::from_fn(|l| f(a[l], b[l]).to_bits())
                }
                Eval::F3(f) => {
                    let (a, b, c) = (row(0), row(1), row(2));
                    std::array::from_fn(|l| f(a[l], b[l], c[l]).to_bits())
                }
                _ => return self.whole_call(instr),
            };
            self.put(dst + k as u32, value);
        }
    }

    /// A call that is made lane by lane.
    fn whole_call(&mut self, instr: Instr) {
        let Instr::Call { function, width, count, dst, args } = instr else { return };
        let pairs = &self.program.args[args as usize..][..2 * count as usize];
        for lane in each(self.live) {
            let mut values = [[0; 3]; MAX_ARGS];
            for (value, pair) in values.iter_mut().zip(pairs.chunks_exact(2)) {
                *value = read(self.cells, lane, pair[0], pair[1] as usize);
            }
            let value = BUILTINS[function as usize].apply(width as usize, &values[..count as usize]);
            write(self.cells, lane, dst, width as usize, value);
        }
    }

    /// What is done for each lane by itself.
    fn by_lane(&mut self, instr: Instr) {
        for lane in each(self.live) {
            let (cells, closures) = (&mut *self.cells, &mut *self.closures);
            match instr {
                Instr::Global { global, dst } => {
                    write(cells, lane, dst, global.ty().cells(), global.read(&self.points[lane]));
                }
                Instr::Op { op, n, width, dst, args } => {
                    let [a, b, c] = args.map(|reg| read(cells, lane, reg, 3));
                    write(cells, lane, dst, width as usize, ops::apply(op, n as usize, a, b, c));
                }
                Instr::OptionIndex { options, dst, name } => {
                    let name = self.strings.get(cells[name as usize][lane]);
                    let index = options.iter().position(|option| *option == name).unwrap_or(0);
                    cells[dst as usize][lane] = (index as f32).to_bits();
                }
                Instr::Element { width, dst, base, len, index } => {
                    let from = base + limited(cells[index as usize][lane], len) * u32::from(width);
                    let value = read(cells, lane, from, width as usize);
                    write(cells, lane, dst, width as usize, value);
                }
                Instr::Store { width, base, len, index, src } => {
                    let to = base + limited(cells[index as usize][lane], len) * u32::from(width);
                    let value = read(cells, lane, src, width as usize);
                    write(cells, lane, to, width as usize, value);
                }
                Instr::ElementC { dst, base, len, index } => {
                    let from = base + limited(cells[index as usize][lane], len);
                    closures[dst as usize][lane] = closures[from as usize][lane];
                }
                Instr::StoreC { base, len, index, src } => {
                    let to = base + limited(cells[index as usize][lane], len);
                    closures[to as usize][lane] = closures[src as usize][lane];
                }
                Instr::CopyC { dst, src } => closures[dst as usize][lane] = closures[src as usize][lane],
                Instr::Do { deed } => {
                    let host = self.program.host.as_deref();
                    let mut around = Surroundings { strings: &mut self.strings, host, globals: &self.points[lane] };
                    run_deed(&self.program.deeds[deed as usize], cells, lane, &mut around);
                }
                _ => {}
            }
        }
    }

    /// Makes a node in the tree of each lane.
    fn compose(&mut self, instr: Instr) {
        let Wide { cells, closures, trees, program, live, .. } = self;
        match instr {
            Instr::Lobe { site, dst } => {
                let maker = &program.makers[site as usize];
                let target = &mut closures[dst as usize];
                for lane in each(*live) {
                    let open = maker.open.iter().map(|(slot, reg)| (*slot, f32::from_bits(cells[*reg as usize][lane])));
                    target[lane] = trees[lane].lobe_from(maker.kind, site, &maker.known, open);
                }
            }
            Instr::AddC { dst, a, b } => {
                let (a, b) = (closures[a as usize], closures[b as usize]);
                each(*live).for_each(|l| closures[dst as usize][l] = trees[l].add(a[l], b[l]));
            }
            Instr::MulC { dst, weight, closure } => {
                let closure = closures[closure as usize];
                for lane in each(*live) {
                    let weight = [0, 1, 2].map(|k| f32::from_bits(cells[weight as usize + k][lane]));
                    closures[dst as usize][lane] = trees[lane].mul(weight, closure[lane]);
                }
            }
            Instr::Layer { dst, top, base } => {
                let (top, base) = (closures[top as usize], closures[base as usize]);
                each(*live).for_each(|l| closures[dst as usize][l] = trees[l].layer(top[l], base[l]));
            }
            _ => {}
        }
    }
}

fn run_deed(call: &Call, cells: &mut [Row], lane: usize, around: &mut Surroundings) {
    let get = |(ty, reg): &(Ty, u32)| (*ty, read(cells, lane, *reg, ty.cells()));
    let args: SmallVec<[(Ty, Cells); 32]> = call.args.iter().map(get).collect();
    let mut outs: SmallVec<[(Ty, Cells); 17]> = call.outs.iter().map(get).collect();
    call.task.run(&args, around, &mut outs);
    for ((ty, reg), (_, value)) in call.outs.iter().zip(outs) {
        write(cells, lane, *reg, ty.cells(), value);
    }
}

fn blend(row: &mut Row, value: &Row, live: Lanes) {
    for lane in 0..LANES {
        row[lane] = if live >> lane & 1 != 0 { value[lane] } else { row[lane] };
    }
}

/// An index limited to what there is.
fn limited(index: u32, len: u32) -> u32 {
    (index as i32).clamp(0, len as i32 - 1) as u32
}

/// Up to `n` cells of a lane; what lies beyond the registers reads as zero.
fn read(cells: &[Row], lane: usize, reg: u32, n: usize) -> Cells {
    let mut out = [0; 3];
    for (out, row) in out.iter_mut().zip(cells.get(reg as usize..).unwrap_or(&[])).take(n) {
        *out = row[lane];
    }
    out
}

fn write(cells: &mut [Row], lane: usize, reg: u32, n: usize, value: Cells) {
    for (row, cell) in cells[reg as usize..].iter_mut().zip(value).take(n) {
        row[lane] = cell;
    }
}
