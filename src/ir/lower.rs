//! From a folded body to register instructions.
//!
//! Cells of variables, constants and globals come first, temporaries after them; closures have registers of their own.
//! Expressions are walked with an explicit stack, and temporaries are given out as a stack too: an operation's result
//! takes the place where its operands began. `&&`, `||` and `? :` become jumps.

use super::body::{Args, Body, ExprId, ExprKind, Op, Root, Stmt, VarId};
use super::builtins::{BUILTINS, Eval, Repeats};
use super::passes::layers::Layers;
use super::passes::needs::Needs;
use super::program::{Call, Instr, Maker, Program, Site};
use super::types::Ty;
use crate::diag::Diagnostic;
use crate::lobes::LobeKind;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Lowers a body whose live expressions are marked in `needs`.
pub fn lower(body: &Body, needs: &Needs, layers: &Layers, warnings: Vec<Diagnostic>) -> Program {
    let mut lower = Lower::new(body, needs);
    lower.block(&body.stmts);
    let strings = body.strings.clone();
    let site = |id: ExprId| lower.site_of.get(&id.0).copied();
    let mut image = lower.image;
    image.resize(lower.max_cells as usize, 0);
    let layer_pairs = layers.pairs().into_iter().filter_map(|(top, base)| Some((site(top)?, site(base)?))).collect();
    Program {
        code: lower.code,
        args: lower.args,
        image,
        closures: lower.max_closures as usize,
        ci: lower.closure_vars[VarId::CI.index()],
        sites: lower.sites,
        makers: lower.makers,
        deeds: lower.deeds,
        layer_pairs,
        strings,
        globals: needs.globals.iter().copied().collect(),
        constant: !needs.varying,
        kept: (!needs.varying).then(OnceLock::new),
        warnings,
        host: None,
        iterations: u32::MAX,
        removed: Vec::new(),
    }
}

/// A register, of cells or of closures as the type of the expression says.
type Reg = u32;
/// The closure register that stays black.
const BLACK: Reg = 0;

/// What is left to do for an expression, last first.
enum Work {
    Eval(ExprId, Option<Reg>),
    /// All operands are there; temporaries from the mark on are theirs.
    Emit(ExprId, Option<Reg>, Mark),
    /// The condition is there.
    Branch(ExprId, Option<Reg>, Mark),
    /// The first value is there: the jump to patch, and where the value goes.
    Otherwise(ExprId, usize, Reg, Mark),
    /// The second value is there.
    Join(ExprId, usize, Reg, Mark),
}

/// How many temporaries are in use.
#[derive(Clone, Copy)]
struct Mark {
    cells: u32,
    closures: u32,
}

struct Lower<'a> {
    body: &'a Body,
    code: Vec<Instr>,
    args: Vec<Reg>,
    /// What the cells before the temporaries start with.
    image: Vec<u32>,
    cell_vars: Vec<Reg>,
    closure_vars: Vec<Reg>,
    constants: HashMap<(usize, [u32; 3]), Reg>,
    globals: HashMap<super::GlobalVar, Reg>,
    free: Mark,
    max_cells: u32,
    max_closures: u32,
    values: Vec<Reg>,
    sites: Vec<Site>,
    makers: Vec<Maker>,
    deeds: Vec<Call>,
    /// The site of each lobe expression.
    site_of: HashMap<u32, u32>,
}

impl<'a> Lower<'a> {
    fn new(body: &'a Body, needs: &Needs) -> Self {
        let mut lower = Lower {
            body,
            code: Vec::new(),
            args: Vec::new(),
            image: Vec::new(),
            cell_vars: vec![0; body.vars.len()],
            closure_vars: vec![BLACK; body.vars.len()],
            constants: HashMap::new(),
            globals: HashMap::new(),
            free: Mark { cells: 0, closures: 1 },
            max_cells: 0,
            max_closures: 1,
            values: Vec::new(),
            sites: Vec::new(),
            makers: Vec::new(),
            deeds: Vec::new(),
            site_of: HashMap::new(),
        };
        lower.closure_vars[VarId::CI.index()] = lower.closure();
        let mut placed = vec![false; body.vars.len()];
        // Variables that are indexed follow each other.
        lower.place_ranges(&body.stmts, &mut placed);
        for (expr, _) in body.exprs.iter().zip(&needs.used).filter(|(_, used)| **used) {
            if let ExprKind::Element(base, len, _) = expr.kind {
                lower.place_range(base, len, &mut placed);
            }
        }
        lower.place_targets(&body.stmts, &mut placed);
        for (var, cells) in &body.starts {
            lower.place_var(*var, &mut placed);
            let n = body.vars[var.index()].cells();
            lower.image[lower.cell_vars[var.index()] as usize..][..n].copy_from_slice(&cells[..n]);
        }
        for (i, used) in needs.used.iter().enumerate() {
            if *used {
                lower.place(ExprId(i as u32), &mut placed);
            }
        }
        lower.free.cells = lower.image.len() as u32;
        lower.max_cells = lower.max_cells.max(lower.free.cells);
        lower
    }

    fn place_targets(&mut self, stmts: &[Stmt], placed: &mut [bool]) {
        for stmt in stmts {
            match stmt {
                Stmt::Assign(var, _) => self.place_var(*var, placed),
                Stmt::Store { index, value, .. } => {
                    self.place_var(*index, placed);
                    self.place_var(*value, placed);
                }
                Stmt::Do(deed) => deed.args.iter().chain(&deed.outs).for_each(|var| self.place_var(*var, placed)),
                Stmt::Loop { before, body, .. } => {
                    self.place_targets(before, placed);
                    self.place_targets(body, placed);
                }
                Stmt::If { then, other, .. } => {
                    self.place_targets(then, placed);
                    self.place_targets(other, placed);
                }
            }
        }
    }

    fn place_ranges(&mut self, stmts: &[Stmt], placed: &mut [bool]) {
        for stmt in stmts {
            match stmt {
                Stmt::Store { base, len, .. } => self.place_range(*base, *len, placed),
                Stmt::Loop { before: a, body: b, .. } | Stmt::If { then: a, other: b, .. } => {
                    self.place_ranges(a, placed);
                    self.place_ranges(b, placed);
                }
                Stmt::Assign(..) | Stmt::Do(_) => {}
            }
        }
    }

    fn place_range(&mut self, base: VarId, len: u32, placed: &mut [bool]) {
        (0..len).for_each(|i| self.place_var(VarId(base.0 + i), placed));
    }

    fn place_var(&mut self, var: VarId, placed: &mut [bool]) {
        if std::mem::replace(&mut placed[var.index()], true) || var == VarId::CI {
            return;
        }
        match self.body.vars[var.index()] {
            Ty::Closure => self.closure_vars[var.index()] = self.closure(),
            ty => self.cell_vars[var.index()] = self.fixed([0; 3], ty.cells()),
        }
    }

    /// Gives variables, constants and globals their place.
    fn place(&mut self, id: ExprId, placed: &mut [bool]) {
        let expr = self.body.expr(id);
        match expr.kind {
            ExprKind::Var(var) => self.place_var(var, placed),
            ExprKind::Const(cells) if !self.constants.contains_key(&(expr.ty.cells(), cells)) => {
                let reg = self.fixed(cells, expr.ty.cells());
                self.constants.insert((expr.ty.cells(), cells), reg);
            }
            ExprKind::Global(global) if !self.globals.contains_key(&global) => {
                let reg = self.fixed([0; 3], global.ty().cells());
                self.globals.insert(global, reg);
                self.code.push(Instr::Global { global, dst: reg });
            }
            _ => {}
        }
    }

    fn fixed(&mut self, cells: [u32; 3], n: usize) -> Reg {
        let reg = self.image.len() as u32;
        self.image.extend(&cells[..n]);
        reg
    }

    fn closure(&mut self) -> Reg {
        self.free.closures += 1;
        self.max_closures = self.max_closures.max(self.free.closures);
        self.free.closures - 1
    }

    fn block(&mut self, stmts: &[Stmt]) {
        for stmt in stmts {
            match stmt {
                Stmt::Assign(var, root) => {
                    let ty = self.body.vars[var.index()];
                    let vars = if ty == Ty::Closure { &self.closure_vars } else { &self.cell_vars };
                    let target = vars[var.index()];
                    let value = self.run(*root, Some(target));
                    self.copy(ty, target, value);
                }
                Stmt::Store { base, len, index, value } => {
                    let (len, index) = (*len, self.cell_vars[index.index()]);
                    self.code.push(match self.body.vars[base.index()] {
                        Ty::Closure => {
                            let (base, src) = (self.closure_vars[base.index()], self.closure_vars[value.index()]);
                            Instr::StoreC { base, len, index, src }
                        }
                        ty => {
                            let (base, src) = (self.cell_vars[base.index()], self.cell_vars[value.index()]);
                            Instr::Store { width: ty.cells() as u8, base, len, index, src }
                        }
                    });
                }
                Stmt::Do(deed) => {
                    let reg = |var: &VarId| (self.body.vars[var.index()], self.cell_vars[var.index()]);
                    let (args, outs) = (deed.args.iter().map(reg).collect(), deed.outs.iter().map(reg).collect());
                    self.code.push(Instr::Do { deed: self.deeds.len() as u32 });
                    self.deeds.push(Call { task: deed.task, args, outs });
                }
                Stmt::Loop { before, condition, body, .. } => {
                    let head = self.code.len() as u32;
                    self.code.push(Instr::Round);
                    self.block(before);
                    let condition = self.run(*condition, None);
                    let to_end = self.jump(Instr::JumpIfZero { condition, to: 0 });
                    self.block(body);
                    self.code.push(Instr::Jump { to: head });
                    self.land(to_end);
                }
                Stmt::If { condition, then, other } => {
                    let condition = self.run(*condition, None);
                    let to_other = self.jump(Instr::JumpIfZero { condition, to: 0 });
                    self.block(then);
                    if other.is_empty() {
                        self.land(to_other);
                    } else {
                        let to_end = self.jump(Instr::Jump { to: 0 });
                        self.land(to_other);
                        self.block(other);
                        self.land(to_end);
                    }
                }
            }
        }
    }

    fn run(&mut self, run: Root, target: Option<Reg>) -> Reg {
        let mut work = vec![Work::Eval(run.root, target)];
        let start = self.free;
        while let Some(next) = work.pop() {
            self.step(next, &mut work);
        }
        self.free = start;
        self.values.pop().unwrap_or(0)
    }

    fn step(&mut self, next: Work, work: &mut Vec<Work>) {
        match next {
            Work::Eval(id, target) => self.eval(id, target, work),
            Work::Emit(id, target, mark) => self.emit(id, target, mark),
            Work::Branch(id, target, mark) => {
                let condition = self.values.pop().unwrap_or(0);
                self.free = mark;
                let expr = self.body.expr(id);
                let ExprKind::Op(op, ids) = expr.kind else { return };
                // `&&` and `||` store before their second operand is evaluated, which may read the target.
                let target = target.filter(|_| op == Op::Select);
                let dst = target.unwrap_or_else(|| self.temporary(expr.ty));
                let mark = self.free;
                if op == Op::Select {
                    let jump = self.jump(Instr::JumpIfZero { condition, to: 0 });
                    work.push(Work::Otherwise(id, jump, dst, mark));
                    work.push(Work::Eval(ids[1], Some(dst)));
                } else {
                    self.copy(Ty::Int, dst, condition);
                    let jump = if op == Op::And {
                        Instr::JumpIfZero { condition: dst, to: 0 }
                    } else {
                        Instr::JumpUnlessZero { condition: dst, to: 0 }
                    };
                    let jump = self.jump(jump);
                    work.push(Work::Join(id, jump, dst, mark));
                    work.push(Work::Eval(ids[1], None));
                }
            }
            Work::Otherwise(id, jump, dst, mark) => {
                let value = self.values.pop().unwrap_or(0);
                let expr = self.body.expr(id);
                self.copy(expr.ty, dst, value);
                let to_end = self.jump(Instr::Jump { to: 0 });
                self.land(jump);
                self.free = mark;
                work.push(Work::Join(id, to_end, dst, mark));
                if let ExprKind::Op(_, ids) = expr.kind {
                    work.push(Work::Eval(ids[2], Some(dst)));
                }
            }
            Work::Join(id, jump, dst, mark) => {
                let value = self.values.pop().unwrap_or(0);
                self.copy(self.body.expr(id).ty, dst, value);
                self.land(jump);
                self.free = mark;
                self.values.push(dst);
            }
        }
    }

    fn eval(&mut self, id: ExprId, target: Option<Reg>, work: &mut Vec<Work>) {
        let expr = self.body.expr(id);
        let at_once = match expr.kind {
            ExprKind::Const(cells) => self.constants.get(&(expr.ty.cells(), cells)).copied(),
            ExprKind::Global(global) => self.globals.get(&global).copied(),
            ExprKind::Black => Some(BLACK),
            ExprKind::Var(var) if expr.ty == Ty::Closure => Some(self.closure_vars[var.index()]),
            ExprKind::Var(var) => Some(self.cell_vars[var.index()]),
            _ => None,
        };
        if let Some(reg) = at_once {
            self.values.push(reg);
            return;
        }
        let mark = self.free;
        if let ExprKind::Op(Op::And | Op::Or | Op::Select, ids) = expr.kind {
            work.push(Work::Branch(id, target, mark));
            work.push(Work::Eval(ids[0], None));
            return;
        }
        work.push(Work::Emit(id, target, mark));
        let first = work.len();
        self.body.operands(id, |operand| work.push(Work::Eval(operand, None)));
        work[first..].reverse();
    }

    fn emit(&mut self, id: ExprId, target: Option<Reg>, mark: Mark) {
        let expr = self.body.expr(id);
        let mut count = 0;
        self.body.operands(id, |_| count += 1);
        let operands = self.values.split_off(self.values.len().saturating_sub(count));
        self.free = mark;
        let dst = target.unwrap_or_else(|| self.temporary(expr.ty));
        let at = |i: usize| operands.get(i).copied().unwrap_or(0);
        let instr = match expr.kind {
            ExprKind::Op(Op::AddC, _) => Instr::AddC { dst, a: at(0), b: at(1) },
            ExprKind::Op(Op::MulC, _) => Instr::MulC { dst, weight: at(0), closure: at(1) },
            ExprKind::Op(Op::Layer, _) => Instr::Layer { dst, top: at(0), base: at(1) },
            ExprKind::Op(op, ids) => {
                let cells = |i: usize| self.body.expr(ids[i]).ty.cells();
                let (n, width) = (cells(0), expr.ty.cells());
                let (a, b) = (at(0), at(1));
                match (op, n, width) {
                    (Op::Splat, ..) => Instr::Splat { dst, a },
                    (Op::AddF | Op::SubF | Op::MulF | Op::DivF, 3, 3) => Instr::Componentwise { op, dst, a, b },
                    // Operands of every operation but these have one cell if the first has.
                    _ if n == 1 && width == 1 && op.arity() < 3 => Instr::Scalar { op, dst, a, b },
                    _ => Instr::Op { op, n: n as u8, width: width as u8, dst, args: [a, b, at(2)] },
                }
            }
            ExprKind::Call(function, args) => {
                let ids = self.body.args(args);
                if let Some(instr) = self.noise(function, ids, &operands, expr.ty.cells(), dst) {
                    self.code.push(instr);
                    self.values.push(dst);
                    return;
                }
                let start = self.args.len() as u32;
                for (reg, id) in operands.iter().zip(ids) {
                    self.args.extend([*reg, self.body.expr(*id).ty.cells() as u32]);
                }
                Instr::Call { function, width: expr.ty.cells() as u8, count: ids.len() as u8, dst, args: start }
            }
            ExprKind::Element(base, len, _) if expr.ty == Ty::Closure => {
                Instr::ElementC { dst, base: self.closure_vars[base.index()], len, index: at(0) }
            }
            ExprKind::Element(base, len, _) => {
                let base = self.cell_vars[base.index()];
                Instr::Element { width: expr.ty.cells() as u8, dst, base, len, index: at(0) }
            }
            ExprKind::OptionIndex(options, _) => Instr::OptionIndex { options, dst, name: at(0) },
            ExprKind::Lobe(kind, args) => {
                let site = self.site(id, kind, args, &operands);
                Instr::Lobe { site, dst }
            }
            _ => return,
        };
        self.code.push(instr);
        self.values.push(dst);
    }

    /// A place that makes a lobe, with its parameter block.
    fn site(&mut self, id: ExprId, kind: LobeKind, args: Args, operands: &[Reg]) -> u32 {
        let (mut values, mut open) = (Vec::new(), Vec::new());
        for (reg, id) in operands.iter().zip(self.body.args(args)) {
            let arg = self.body.expr(*id);
            for k in 0..arg.ty.cells() {
                values.push(match arg.kind {
                    ExprKind::Const(cells) => Some(f32::from_bits(cells[k])),
                    _ => {
                        open.push((values.len() as u32, reg + k as u32));
                        None
                    }
                });
            }
        }
        let site = self.sites.len() as u32;
        self.site_of.insert(id.0, site);
        let known = values.iter().map(|value| value.unwrap_or(0.0)).collect();
        self.makers.push(Maker { kind, known, open });
        self.sites.push(Site { kind, values, span: self.body.expr(id).span });
        site
    }

    /// Noise whose kind is known.
    fn noise(&mut self, function: u16, ids: &[ExprId], operands: &[Reg], width: usize, dst: Reg) -> Option<Instr> {
        let Eval::Noise(kind, repeats) = BUILTINS[function as usize].eval else { return None };
        let named = usize::from(kind.is_none());
        let kind = match kind {
            Some(kind) => kind,
            None => match self.body.expr(*ids.first()?).kind {
                ExprKind::Const(cells) => f32::from_bits(cells[0]) as usize,
                _ => return None,
            },
        };
        let args = self.args.len() as u32;
        for (reg, id) in operands.iter().zip(ids).skip(named) {
            self.args.extend((0..self.body.expr(*id).ty.cells() as u32).map(|k| reg + k));
        }
        let numbers = self.args.len() as u32 - args;
        let periodic = repeats == Repeats::Periodic;
        let dimensions = if periodic { numbers / 2 } else { numbers } as u8;
        Some(Instr::Noise { kind: kind as u8, dimensions, periodic, width: width as u8, dst, args })
    }

    fn temporary(&mut self, ty: Ty) -> Reg {
        if ty == Ty::Closure {
            return self.closure();
        }
        let reg = self.free.cells;
        self.free.cells += ty.cells() as u32;
        self.max_cells = self.max_cells.max(self.free.cells);
        reg
    }

    fn copy(&mut self, ty: Ty, dst: Reg, src: Reg) {
        if dst != src {
            self.code.push(match ty {
                Ty::Closure => Instr::CopyC { dst, src },
                ty if ty.cells() == 1 => Instr::Copy1 { dst, src },
                _ => Instr::Copy3 { dst, src },
            });
        }
    }

    fn jump(&mut self, instr: Instr) -> usize {
        self.code.push(instr);
        self.code.len() - 1
    }

    /// Lets a jump go to what comes next.
    fn land(&mut self, jump: usize) {
        let here = self.code.len() as u32;
        if let Instr::Jump { to } | Instr::JumpIfZero { to, .. } | Instr::JumpUnlessZero { to, .. } =
            &mut self.code[jump]
        {
            *to = here;
        }
    }
}
