//! What statements do that has several results, works on strings or matrices, or asks the host.
//!
//! Folding and running both call [`Task::run`], so that a result known early and one known late are the same.

use super::body::Cells;
use super::functions::matrix::{self, Kind, Matrix};
use super::functions::text;
use super::host::{Answers, Host, Lookup, Speech, Subject};
use super::ops::divide;
use super::shader::Value;
use super::types::Ty;
use crate::globals::Globals;
use crate::optics::fresnel;

/// One of them. The arguments and results stand in the order of the comment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Two matrices: their product.
    Multiply,
    /// A matrix: its inverse.
    Inverse,
    /// A matrix: its transpose.
    Transpose,
    /// A matrix: a float.
    Determinant,
    /// A matrix and a triple: the triple.
    Transform(Kind),
    /// Two names of spaces and a triple: the triple.
    Between(Kind),
    /// Two names of spaces: whether they are known, and a matrix.
    Spaces,
    /// Strings: one.
    Concat,
    /// A string: an int.
    Length,
    /// Two strings: an int.
    StartsWith,
    /// Two strings: an int.
    EndsWith,
    /// A string, start and length: a string.
    Part,
    /// A string: an int.
    ToInt,
    /// A string: a float.
    ToFloat,
    /// A string and an index: an int.
    Char,
    /// A string: an int.
    Hash,
    /// A pattern and values: a string.
    Format,
    /// A string, a separator and a limit: how many, and that many strings.
    Split,
    /// A pattern and values.
    Say(Speech),
    /// Reflectance and edge tint, colors: n and k of a metal, colors.
    ArtisticIor,
    /// A value: whether it is known before shading.
    IsConstant,
    /// A basis, a place, and knots, as many as cells of the result each: the value there.
    Spline,
    /// The same with a value of the spline: the place where it is taken.
    SplineInverse,
    /// Incident direction, normal and ratio of indices: reflectance, transmittance, and both directions.
    Fresnel,
    /// Object, name, index – −1 for none –, what the results hold: whether it is known, and the values.
    Attribute,
    /// File, what is asked, what the results hold: whether it is known, and the values.
    TextureInfo,
    /// A name: an int.
    RayType,
    /// A name: an int.
    IsConnected,
    /// Name, s, t, two wraps, first channel, interpolation, color space, missing color and alpha, whether they are
    /// given: color and alpha. What s and t change by to the right and down may follow.
    Texture,
}

/// The strings of a program and those made while it runs.
pub struct Strings<'a> {
    known: &'a [String],
    made: Vec<String>,
}

impl<'a> Strings<'a> {
    /// No more than those known.
    pub fn new(known: &'a [String]) -> Self {
        Strings { known, made: Vec::new() }
    }

    /// The string with a number.
    pub fn get(&self, id: u32) -> &str {
        let id = id as usize;
        self.known.get(id).or_else(|| self.made.get(id.wrapping_sub(self.known.len()))).map_or("", String::as_str)
    }

    /// The number of a string.
    pub fn number(&mut self, text: String) -> u32 {
        let position = self.known.iter().chain(&self.made).position(|s| *s == text);
        position.unwrap_or_else(|| {
            self.made.push(text);
            self.known.len() + self.made.len() - 1
        }) as u32
    }

    /// Those that were made.
    pub fn into_made(self) -> Vec<String> {
        self.made
    }
}

/// What a task is given besides its arguments.
pub struct Surroundings<'a, 's> {
    /// Strings by their number.
    pub strings: &'a mut Strings<'s>,
    /// Who answers questions.
    pub host: Option<&'a dyn Host>,
    /// The shading point.
    pub globals: &'a Globals,
}

/// The longest string a script may make, in bytes.
const MAX_STRING: usize = 1 << 16;

impl Task {
    /// The arguments of a texture lookup up to the derivatives.
    pub const TEXTURE_ARGS: usize = 11;

    /// What it asks the host about, if anything.
    fn subject(self) -> Option<Subject> {
        match self {
            Task::Between(_) | Task::Spaces => Some(Subject::Spaces),
            Task::Attribute | Task::RayType | Task::IsConnected => Some(Subject::Attributes),
            Task::Texture | Task::TextureInfo => Some(Subject::Textures),
            Task::Say(_) => Some(Subject::Speech),
            _ => None,
        }
    }

    /// Whether the result depends on a host that answers so.
    pub fn asks(self, answers: Answers) -> bool {
        self.subject().is_some_and(|subject| answers.on(subject))
    }

    /// Whether it does something that its results do not show.
    pub fn is_heard(self) -> bool {
        matches!(self, Task::Say(_))
    }

    /// Carries it out; `out` holds what the results held before.
    pub fn run(self, args: &[(Ty, Cells)], around: &mut Surroundings, out: &mut [(Ty, Cells)]) {
        let float = |i: usize, k: usize| args.get(i).map_or(0.0, |(_, cells)| f32::from_bits(cells[k]));
        let int = |i: usize| args.get(i).map_or(0, |(_, cells)| cells[0] as i32);
        let triple = |i: usize| args.get(i).map_or([0.0; 3], |(_, cells)| cells.map(f32::from_bits));
        let matrix = |i: usize| -> Matrix { std::array::from_fn(|k| float(i + k, 0)) };
        match self {
            Task::Multiply => put(out, matrix::multiply(&matrix(0), &matrix(16))),
            Task::Inverse => put(out, matrix::inverse(&matrix(0))),
            Task::Transpose => put(out, matrix::transpose(&matrix(0))),
            Task::Determinant => put(out, [matrix::determinant(&matrix(0))]),
            Task::Transform(kind) => put_triple(out, matrix::transform(kind, &matrix(0), triple(16))),
            Task::Between(kind) => {
                let m = between(int(0), int(1), around);
                put_triple(out, m.map_or(triple(2), |m| matrix::transform(kind, &m, triple(2))));
            }
            Task::Spaces => {
                let m = between(int(0), int(1), around);
                put_int(out, 1);
                put(&mut out[1..], m.unwrap_or(matrix::IDENTITY));
            }
            Task::Spline => spline(args, around, out),
            Task::SplineInverse => spline_inverse(args, around, out),
            Task::Fresnel => fresnel(triple(0), triple(1), float(2, 0), out),
            Task::ArtisticIor => {
                let (n, k) = fresnel::artistic_ior(triple(0), triple(1));
                put_triple(out, n);
                put_triple(&mut out[1..], k);
            }
            Task::IsConstant => put_int(out, 0),
            Task::RayType | Task::IsConnected => {
                let Surroundings { strings, host, globals } = around;
                let name = strings.get(int(0) as u32);
                let answer = host.is_some_and(|host| match self {
                    Task::RayType => host.is_ray(name, globals),
                    _ => host.is_connected(name),
                });
                put_int(out, i32::from(answer));
            }
            Task::Attribute => attribute(args, around, out),
            Task::TextureInfo => {
                let name = |i: usize| around.strings.get(args.get(i).map_or(0, |(_, cells)| cells[0]));
                let (file, what) = (name(0), name(1));
                let answers = answers(&out[1..], |ty, k| around.host?.texture_info(file, what, k, ty));
                found(&args[2..], answers, around, out);
            }
            Task::Texture => texture(args, around, out),
            _ => self.on_strings(args, around, out),
        }
    }

    fn on_strings(self, args: &[(Ty, Cells)], around: &mut Surroundings, out: &mut [(Ty, Cells)]) {
        let strings = &mut *around.strings;
        let int = |i: usize| args.get(i).map_or(0, |(_, cells)| cells[0] as i32);
        let words: Vec<&str> = args.iter().map(|(_, cells)| strings.get(cells[0])).collect();
        let word = |i: usize| words.get(i).copied().unwrap_or("");
        match self {
            Task::Length => put_int(out, word(0).len() as i32),
            Task::StartsWith => put_int(out, i32::from(word(0).starts_with(word(1)))),
            Task::EndsWith => put_int(out, i32::from(word(0).ends_with(word(1)))),
            Task::ToInt => put_int(out, text::to_int(word(0))),
            Task::ToFloat => put(out, [text::to_float(word(0))]),
            Task::Char => {
                let byte = usize::try_from(int(1)).ok().and_then(|i| word(0).as_bytes().get(i).copied());
                put_int(out, byte.map_or(0, i32::from));
            }
            Task::Hash => put_int(out, text::hash(word(0))),
            Task::Concat | Task::Part | Task::Format => {
                let mut made = match self {
                    Task::Concat => words.concat(),
                    Task::Part => text::part(word(0), int(1), int(2)),
                    _ => formatted(args, &words),
                };
                shorten(&mut made);
                let id = strings.number(made);
                put_int(out, id as i32);
            }
            Task::Split => {
                let most = usize::try_from(int(2)).unwrap_or(0).min(out.len().saturating_sub(1));
                let pieces = text::split(word(0), word(1), most);
                put_int(out, pieces.len() as i32);
                for (piece, (_, cells)) in pieces.into_iter().zip(&mut out[1..]) {
                    *cells = [strings.number(piece), 0, 0];
                }
            }
            Task::Say(speech) => {
                if let Some(host) = around.host {
                    host.say(speech, &formatted(args, &words));
                }
            }
            _ => {}
        }
    }
}

fn formatted(args: &[(Ty, Cells)], words: &[&str]) -> String {
    let values: Vec<_> = args.iter().zip(words).skip(1).map(|((ty, cells), word)| (*ty, *cells, *word)).collect();
    text::format(words.first().unwrap_or(&""), &values)
}

fn shorten(text: &mut String) {
    let mut end = text.len().min(MAX_STRING);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text.truncate(end);
}

fn put<const K: usize>(out: &mut [(Ty, Cells)], values: [f32; K]) {
    for ((_, cells), value) in out.iter_mut().zip(values) {
        *cells = [value.to_bits(), 0, 0];
    }
}

fn put_int(out: &mut [(Ty, Cells)], value: i32) {
    if let Some((_, cells)) = out.first_mut() {
        *cells = [value as u32, 0, 0];
    }
}

fn put_triple(out: &mut [(Ty, Cells)], value: [f32; 3]) {
    if let Some((_, cells)) = out.first_mut() {
        *cells = value.map(f32::to_bits);
    }
}

/// The matrix from one space to another; `None` where they are the same or the host knows neither.
fn between(from: i32, to: i32, around: &Surroundings) -> Option<Matrix> {
    let (from, to) = (around.strings.get(from as u32), around.strings.get(to as u32));
    let host = around.host.filter(|_| from != to)?;
    let space = |name: &str| if name == "common" { None } else { host.matrix(name, around.globals) };
    match (space(from), space(to)) {
        (None, None) => None,
        (Some(from), None) => Some(from),
        (None, Some(to)) => Some(matrix::inverse(&to)),
        (Some(from), Some(to)) => Some(matrix::multiply(&from, &matrix::inverse(&to))),
    }
}

fn attribute(args: &[(Ty, Cells)], around: &mut Surroundings, out: &mut [(Ty, Cells)]) {
    let cell = |i: usize| args.get(i).map_or(0, |(_, cells)| cells[0]);
    let (object, name) = (around.strings.get(cell(0)), around.strings.get(cell(1)));
    let globals = around.globals;
    let answers = match usize::try_from(cell(2) as i32) {
        Err(_) => answers(&out[1..], |ty, _| around.host?.attribute(object, name, ty, globals)),
        Ok(first) => answers(&out[1..], |ty, k| around.host?.attribute_element(object, name, first + k, ty, globals)),
    };
    found(&args[3..], answers, around, out);
}

/// What is answered for each result; `None` if anything is missing.
fn answers(wanted: &[(Ty, Cells)], ask: impl Fn(Ty, usize) -> Option<Value>) -> Option<Vec<Value>> {
    wanted.iter().enumerate().map(|(k, (ty, _))| ask(*ty, k)).collect()
}

/// Whether there are answers, and these; what the variables hold stays if not.
fn found(old: &[(Ty, Cells)], answers: Option<Vec<Value>>, around: &mut Surroundings, out: &mut [(Ty, Cells)]) {
    let types: Vec<Ty> = out[1..].iter().map(|(ty, _)| *ty).collect();
    let mut cells = |answer: Value, ty: Ty| match answer {
        Value::String(text) if ty == Ty::String => Some([around.strings.number(text), 0, 0]),
        other => other.to_cells(ty, &mut Vec::new()),
    };
    let values: Option<Vec<Cells>> =
        answers.and_then(|answers| answers.into_iter().zip(types).map(|(answer, ty)| cells(answer, ty)).collect());
    put_int(out, i32::from(values.is_some()));
    let values = values.unwrap_or_else(|| old.iter().map(|(_, cells)| *cells).collect());
    out[1..].iter_mut().zip(values).for_each(|((_, cells), value)| *cells = value);
}

/// As stdosl.h has it: unpolarised, T in flux.
fn fresnel(i: [f32; 3], n: [f32; 3], eta: f32, out: &mut [(Ty, Cells)]) {
    let along: f32 = (0..3).map(|k| i[k] * n[k]).sum();
    let c = along.abs();
    let inverse = divide(1.0, eta * eta);
    let square = inverse - 1.0 + c * c;
    let reflected = [0, 1, 2].map(|k| i[k] - 2.0 * along * n[k]);
    let (mut kr, mut kt, mut refracted) = (1.0, 0.0, [0.0; 3]);
    if square >= 0.0 {
        let g = square.sqrt();
        let beta = g - c;
        let parallel = divide(c * (g + c) - 1.0, c * beta + 1.0);
        let ratio = divide(beta, g + c);
        kr = 0.5 * (1.0 + parallel * parallel) * ratio * ratio;
        kt = (1.0 - kr) * eta * eta;
        let rest = 1.0 - eta * eta * (1.0 - along * along);
        if rest >= 0.0 {
            let by = eta * along + rest.sqrt();
            refracted = [0, 1, 2].map(|k| eta * i[k] - by * n[k]);
        }
    }
    put(out, [kr, kt]);
    put_triple(&mut out[2..], reflected);
    put_triple(&mut out[3..], refracted);
}

/// Where a spline that rises or falls throughout takes a value: 0 or 1 beyond its ends.
fn spline_inverse(args: &[(Ty, Cells)], around: &Surroundings, out: &mut [(Ty, Cells)]) {
    let Some((_, wanted)) = args.get(1) else { return };
    let wanted = f32::from_bits(wanted[0]);
    let at = |x: f32| {
        let mut args = args.to_vec();
        args[1].1 = [x.to_bits(), 0, 0];
        let mut value = [(Ty::Float, [0; 3])];
        spline(&args, around, &mut value);
        f32::from_bits(value[0].1[0])
    };
    let rises = at(1.0) >= at(0.0);
    let short = |x: f32| if rises { at(x) < wanted } else { at(x) > wanted };
    let (mut lo, mut hi) = (0.0, 1.0);
    let place = if !short(lo) {
        lo
    } else if short(hi) {
        hi
    } else {
        // As many halvings as there are digits.
        for _ in 0..24 {
            let middle = 0.5 * (lo + hi);
            if short(middle) { lo = middle } else { hi = middle }
        }
        0.5 * (lo + hi)
    };
    put(out, [place]);
}

fn texture(args: &[(Ty, Cells)], around: &Surroundings, out: &mut [(Ty, Cells)]) {
    let [(_, color), (_, alpha), ..] = out else { return };
    let cells = |i: usize| args.get(i).map_or([0; 3], |(_, cells)| *cells);
    let float = |i: usize| f32::from_bits(cells(i)[0]);
    let word = |i: usize| around.strings.get(cells(i)[0]);
    let [r, g, b] = cells(8).map(f32::from_bits);
    let given = cells(10)[0] != 0;
    let missing = [r, g, b, float(9)];
    let lookup = Lookup {
        name: word(0),
        s: float(1),
        t: float(2),
        wrap: [word(3), word(4)],
        first_channel: cells(5)[0] as i32,
        missing: given.then_some(missing),
        interpolation: word(6),
        colorspace: word(7),
        changes: [
            [float(Task::TEXTURE_ARGS), float(Task::TEXTURE_ARGS + 1)],
            [float(Task::TEXTURE_ARGS + 2), float(Task::TEXTURE_ARGS + 3)],
        ],
    };
    let found = around.host.and_then(|host| host.texture(&lookup, around.globals));
    let [r, g, b, a] = found.unwrap_or(missing).map(|x| if x.is_finite() { x } else { 0.0 });
    (*color, *alpha) = ([r, g, b].map(f32::to_bits), [a.to_bits(), 0, 0]);
}

/// Knots from the third argument on; as in OSL the outermost ones steer the ends.
fn spline(args: &[(Ty, Cells)], around: &Surroundings, out: &mut [(Ty, Cells)]) {
    let (Some((_, basis)), Some((_, x)), Some((ty, value))) = (args.first(), args.get(1), out.first_mut()) else {
        return;
    };
    let knots = &args[2..];
    let (matrix, step): ([[f32; 4]; 4], usize) = match around.strings.get(basis[0]) {
        "bezier" => ([[-1., 3., -3., 1.], [3., -6., 3., 0.], [-3., 3., 0., 0.], [1., 0., 0., 0.]], 3),
        "bspline" => {
            let m = [[-1., 3., -3., 1.], [3., -6., 3., 0.], [-3., 0., 3., 0.], [1., 4., 1., 0.]];
            (m.map(|row| row.map(|x: f32| x / 6.0)), 1)
        }
        "hermite" => ([[2., 1., -2., 1.], [-3., -2., 3., -1.], [0., 1., 0., 0.], [1., 0., 0., 0.]], 2),
        "linear" => ([[0., 0., 0., 0.], [0., 0., 0., 0.], [0., -1., 1., 0.], [0., 1., 0., 0.]], 1),
        "constant" => ([[0., 0., 0., 0.], [0., 0., 0., 0.], [0., 0., 0., 0.], [0., 1., 0., 0.]], 1),
        _ => ([[-0.5, 1.5, -1.5, 0.5], [1., -2.5, 2., -0.5], [-0.5, 0., 0.5, 0.], [0., 1., 0., 0.]], 1),
    };
    if knots.len() < 4 {
        return;
    }
    let segments = (knots.len() - 4) / step + 1;
    let x = f32::from_bits(x[0]);
    let x = if x > 0.0 { x.min(1.0) } else { 0.0 } * segments as f32;
    let segment = (x as usize).min(segments - 1);
    let t = x - segment as f32;
    for k in 0..ty.cells() {
        let knot = |i: usize| f32::from_bits(knots[segment * step + i].1[k]);
        let row = |row: &[f32; 4]| (0..4).map(|i| row[i] * knot(i)).sum::<f32>();
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| row(&matrix[i]));
        value[k] = (((a * t + b) * t + c) * t + d).to_bits();
    }
}
