//! The functions and constants every script has: a table, one line per overload.
//!
//! A signature is a result and its arguments in letters: `f` float, `i` int, `c` color, `p` point, `v` vector, `n`
//! normal, `s` string, `C` closure, `N` the name of a noise, `S` of a color space; `g` is float or any triple, the same
//! throughout the line, and `t` any triple. Where
//! several lines share a name the one with the fewest conversions is meant, the first among equals. The functions are
//! total: like OSL's they return something sensible where mathematics has no answer.

use super::body::{Cells, GlobalVar};
use super::functions::{color, noise};
use super::ops::divide;
use super::types::Ty;
use std::collections::HashMap;
use std::sync::OnceLock;

/// How an overload computes its result.
#[derive(Clone, Copy)]
pub enum Eval {
    /// On each component of a float or triple.
    F1(fn(f32) -> f32),
    /// The same with two arguments.
    F2(fn(f32, f32) -> f32),
    /// The same with three.
    F3(fn(f32, f32, f32) -> f32),
    /// On ints.
    I2(fn(i32, i32) -> i32),
    /// On three ints.
    I3(fn(i32, i32, i32) -> i32),
    /// On whole values.
    All(fn(&[Cells]) -> Cells),
    /// Noise of the kind with this number, or of the kind that the first argument names. As OSL has it, the result is a
    /// float or a triple as the place asks.
    Noise(Option<usize>, Repeats),
    /// Reads the shading point.
    Global(GlobalVar),
    /// How its argument changes from pixel to pixel; zero unless [`derive`](super::passes::derive) has gone over it.
    Derivative(Slope),
    /// a·(1−x) + b·x of closures.
    MixClosures,
}

/// What is asked about how a value changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slope {
    /// By one pixel to the right (0) or down (1).
    Along(usize),
    /// The root of the sum of both squares.
    Width,
    /// Of a position: the area that a pixel covers.
    Area,
    /// Of a position: the cross product of both.
    Normal,
    /// A step, as wide as its arguments change.
    Step,
}

/// Whether a noise takes periods after its coordinates.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Repeats {
    /// It goes on for ever.
    Never,
    /// One period per coordinate follows.
    Periodic,
}

/// One overload.
pub struct Builtin {
    /// What scripts call.
    pub name: &'static str,
    /// Result and arguments, a letter each.
    pub sig: &'static str,
    /// What it does.
    pub eval: Eval,
}

/// The most arguments an overload takes.
pub const MAX_ARGS: usize = 5;

impl Builtin {
    /// The result and argument types, one list for each reading of `g` or `t`.
    pub fn instances(&self) -> impl Iterator<Item = (Ty, Vec<Ty>)> + '_ {
        const ANY: [Ty; 5] = [Ty::Float, Ty::Color, Ty::Point, Ty::Vector, Ty::Normal];
        let readings = if self.sig.contains('g') {
            &ANY[..]
        } else if self.sig.contains('t') {
            &ANY[1..]
        } else {
            &ANY[..1]
        };
        readings.iter().map(|any| {
            let mut types = self.sig.chars().map(|letter| match letter {
                'f' => Ty::Float,
                'i' => Ty::Int,
                'c' => Ty::Color,
                'p' => Ty::Point,
                'v' => Ty::Vector,
                'n' => Ty::Normal,
                's' | 'N' | 'S' => Ty::String,
                'C' => Ty::Closure,
                _ => *any,
            });
            let result = types.next().unwrap_or(Ty::Poison);
            (result, types.collect())
        })
    }

    /// The words that argument `index` may be, where it is one of a list.
    pub fn options(&self, index: usize) -> Option<&'static [&'static str]> {
        match self.sig.as_bytes().get(index + 1)? {
            b'N' => Some(noise::KINDS),
            b'S' => Some(color::SPACES),
            _ => None,
        }
    }

    /// Whether the result may be a triple in place of a float.
    pub fn result_follows_use(&self) -> bool {
        matches!(self.eval, Eval::Noise(..))
    }

    fn noise(&self, kind: Option<usize>, repeats: Repeats, n: usize, args: &[Cells]) -> Cells {
        let named = usize::from(kind.is_none());
        let kind = kind.unwrap_or_else(|| args.first().map_or(0, |a| f32::from_bits(a[0]) as usize));
        let mut numbers = [[0.0]; 8];
        let mut count = 0;
        for (letter, arg) in self.sig.bytes().skip(1).zip(args).skip(named) {
            for cell in &arg[..if letter == b'p' { 3 } else { 1 }] {
                numbers[count] = [f32::from_bits(*cell)];
                count += 1;
            }
        }
        let dimensions = if repeats == Repeats::Periodic { count / 2 } else { count };
        let mut at = noise::At { x: [[0.0]; 4], n: dimensions, period: [[0.0]; 4] };
        at.x[..dimensions].copy_from_slice(&numbers[..dimensions]);
        if repeats == Repeats::Periodic {
            at.period[..dimensions].copy_from_slice(&numbers[dimensions..count]);
        }
        let mut out = [0; 3];
        for (channel, cell) in out.iter_mut().enumerate().take(n) {
            *cell = noise::noise(kind, &at, channel as u32)[0].to_bits();
        }
        out
    }

    /// As documentation would show it; `g` reads `type`.
    pub fn signature(&self) -> String {
        let word = |letter| match letter {
            'f' => "float",
            'i' => "int",
            'c' => "color",
            'p' => "point",
            'v' => "vector",
            'n' => "normal",
            's' | 'N' | 'S' => "string",
            'C' => "closure color",
            _ => "TYPE",
        };
        let mut words = self.sig.chars().map(word);
        let result = words.next().unwrap_or("");
        format!("{result} {}({})", self.name, words.collect::<Vec<_>>().join(", "))
    }

    /// The value for known arguments; `n` is the number of components of the result.
    pub fn apply(&self, n: usize, args: &[Cells]) -> Cells {
        let arg = |i: usize, k: usize| args.get(i).map_or(0.0, |cells| f32::from_bits(cells[k]));
        let int = |i: usize| args.get(i).map_or(0, |cells| cells[0] as i32);
        let each = |f: &dyn Fn(usize) -> f32| {
            let mut out = [0; 3];
            out.iter_mut().enumerate().take(n).for_each(|(k, cell)| *cell = f(k).to_bits());
            out
        };
        match self.eval {
            Eval::F1(f) => each(&|k| f(arg(0, k))),
            Eval::F2(f) => each(&|k| f(arg(0, k), arg(1, k))),
            Eval::F3(f) => each(&|k| f(arg(0, k), arg(1, k), arg(2, k))),
            Eval::I2(f) => [f(int(0), int(1)) as u32, 0, 0],
            Eval::I3(f) => [f(int(0), int(1), int(2)) as u32, 0, 0],
            Eval::All(f) => f(args),
            Eval::Noise(kind, repeats) => self.noise(kind, repeats, n, args),
            Eval::Derivative(Slope::Step) => scalar(aastep(arg(0, 0), arg(1, 0), 0.0, arg(2, 0))),
            Eval::Global(_) | Eval::MixClosures | Eval::Derivative(_) => [0; 3],
        }
    }
}

const fn line(name: &'static str, sig: &'static str, eval: Eval) -> Builtin {
    Builtin { name, sig, eval }
}

use Eval::{All, Derivative, F1, F2, F3, I2, I3, Noise};
use Repeats::{Never, Periodic};

/// Every overload. The index of a line is its number in the program.
pub static BUILTINS: &[Builtin] = &[
    line("abs", "ii", I2(|a, _| a.wrapping_abs())),
    line("abs", "gg", F1(f32::abs)),
    line("fabs", "ii", I2(|a, _| a.wrapping_abs())),
    line("fabs", "gg", F1(f32::abs)),
    line("min", "iii", I2(i32::min)),
    line("min", "ggg", F2(|a, b| if b < a { b } else { a })),
    line("max", "iii", I2(i32::max)),
    line("max", "ggg", F2(|a, b| if b > a { b } else { a })),
    line("clamp", "iiii", I3(|x, lo, hi| x.max(lo).min(hi))),
    line("clamp", "gggg", F3(clamp)),
    line("mix", "CCCc", Eval::MixClosures),
    line("mix", "gggg", F3(|a, b, x| a * (1.0 - x) + b * x)),
    line("select", "iiii", I3(|a, b, x| if x != 0 { b } else { a })),
    line("select", "gggg", F3(|a, b, x| if x != 0.0 { b } else { a })),
    line("floor", "gg", F1(f32::floor)),
    line("ceil", "gg", F1(f32::ceil)),
    line("round", "gg", F1(f32::round)),
    line("trunc", "gg", F1(f32::trunc)),
    line(
        "sign",
        "gg",
        F1(|x| {
            if x > 0.0 {
                1.0
            } else if x < 0.0 {
                -1.0
            } else {
                0.0
            }
        }),
    ),
    line("mod", "ggg", F2(|a, b| if b == 0.0 { 0.0 } else { a - b * (a / b).floor() })),
    line("fmod", "ggg", F2(|a, b| if b == 0.0 { 0.0 } else { a % b })),
    line("sqrt", "gg", F1(|x| if x > 0.0 { x.sqrt() } else { 0.0 })),
    line("inversesqrt", "gg", F1(|x| if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 })),
    line("cbrt", "gg", F1(f32::cbrt)),
    line("pow", "ggg", F2(power)),
    line("exp", "gg", F1(f32::exp)),
    line("exp2", "gg", F1(f32::exp2)),
    line("expm1", "gg", F1(f32::exp_m1)),
    line("log", "gg", F1(|x| positive(x).ln())),
    line("log", "ggg", F2(|x, base| divide(positive(x).ln(), positive(base).ln()))),
    line("log2", "gg", F1(|x| positive(x).log2())),
    line("log10", "gg", F1(|x| positive(x).log10())),
    line("sin", "gg", F1(f32::sin)),
    line("cos", "gg", F1(f32::cos)),
    line("tan", "gg", F1(f32::tan)),
    line("asin", "gg", F1(|x| clamp(x, -1.0, 1.0).asin())),
    line("acos", "gg", F1(|x| clamp(x, -1.0, 1.0).acos())),
    line("atan", "gg", F1(f32::atan)),
    line("atan2", "ggg", F2(f32::atan2)),
    line("sinh", "gg", F1(f32::sinh)),
    line("cosh", "gg", F1(f32::cosh)),
    line("tanh", "gg", F1(f32::tanh)),
    line("radians", "gg", F1(f32::to_radians)),
    line("degrees", "gg", F1(f32::to_degrees)),
    line("hypot", "fff", F2(f32::hypot)),
    line("hypot", "ffff", F3(|a, b, c| (a * a + b * b + c * c).sqrt())),
    line("step", "ggg", F2(|edge, x| if x < edge { 0.0 } else { 1.0 })),
    line("linearstep", "gggg", F3(linear_step)),
    line("smoothstep", "gggg", F3(smooth_step)),
    line("isnan", "if", All(|a| truth(float(a, 0).is_nan()))),
    line("isinf", "if", All(|a| truth(float(a, 0).is_infinite()))),
    line("isfinite", "if", All(|a| truth(float(a, 0).is_finite()))),
    line("dot", "fvv", All(|a| scalar(dot(triple(a, 0), triple(a, 1))))),
    line("cross", "vvv", All(|a| cells(cross(triple(a, 0), triple(a, 1))))),
    line("length", "fv", All(|a| scalar(length(triple(a, 0))))),
    line("distance", "fpp", All(|a| scalar(length(minus(triple(a, 0), triple(a, 1)))))),
    line("normalize", "nn", All(|a| cells(normalize(triple(a, 0))))),
    line("normalize", "vv", All(|a| cells(normalize(triple(a, 0))))),
    line("reflect", "vvv", All(|a| cells(reflect(triple(a, 0), triple(a, 1))))),
    line("faceforward", "vvvv", All(|a| cells(face_forward(triple(a, 0), triple(a, 1), triple(a, 2))))),
    line("luminance", "fc", All(|a| scalar(dot(triple(a, 0), [0.2126, 0.7152, 0.0722])))),
    line("backfacing", "i", Eval::Global(GlobalVar::Backfacing)),
    line("noise", "ff", Noise(Some(0), Never)),
    line("noise", "fff", Noise(Some(0), Never)),
    line("noise", "fp", Noise(Some(0), Never)),
    line("noise", "fpf", Noise(Some(0), Never)),
    line("noise", "fNf", Noise(None, Never)),
    line("noise", "fNff", Noise(None, Never)),
    line("noise", "fNp", Noise(None, Never)),
    line("noise", "fNpf", Noise(None, Never)),
    line("snoise", "ff", Noise(Some(2), Never)),
    line("snoise", "fff", Noise(Some(2), Never)),
    line("snoise", "fp", Noise(Some(2), Never)),
    line("snoise", "fpf", Noise(Some(2), Never)),
    line("cellnoise", "ff", Noise(Some(4), Never)),
    line("cellnoise", "fff", Noise(Some(4), Never)),
    line("cellnoise", "fp", Noise(Some(4), Never)),
    line("cellnoise", "fpf", Noise(Some(4), Never)),
    line("hashnoise", "ff", Noise(Some(5), Never)),
    line("hashnoise", "fff", Noise(Some(5), Never)),
    line("hashnoise", "fp", Noise(Some(5), Never)),
    line("hashnoise", "fpf", Noise(Some(5), Never)),
    line("pnoise", "fff", Noise(Some(0), Periodic)),
    line("pnoise", "fffff", Noise(Some(0), Periodic)),
    line("pnoise", "fpp", Noise(Some(0), Periodic)),
    line("pnoise", "fpfpf", Noise(Some(0), Periodic)),
    line("pnoise", "fNff", Noise(None, Periodic)),
    line("pnoise", "fNffff", Noise(None, Periodic)),
    line("pnoise", "fNpp", Noise(None, Periodic)),
    line("pnoise", "fNpfpf", Noise(None, Periodic)),
    line("psnoise", "fff", Noise(Some(2), Periodic)),
    line("psnoise", "fffff", Noise(Some(2), Periodic)),
    line("psnoise", "fpp", Noise(Some(2), Periodic)),
    line("psnoise", "fpfpf", Noise(Some(2), Periodic)),
    line("hash", "ii", All(|a| [noise::hash_int([a[0][0], 0, 0, 0], 1), 0, 0])),
    line("hash", "if", All(|a| [noise::hash_int([a[0][0], 0, 0, 0], 1), 0, 0])),
    line("hash", "iff", All(|a| [noise::hash_int([a[0][0], a[1][0], 0, 0], 2), 0, 0])),
    line("hash", "ip", All(|a| [noise::hash_int([a[0][0], a[0][1], a[0][2], 0], 3), 0, 0])),
    line("hash", "ipf", All(|a| [noise::hash_int([a[0][0], a[0][1], a[0][2], a[1][0]], 4), 0, 0])),
    line(
        "transformc",
        "cSSc",
        All(|a| cells(color::transform(float(a, 0) as usize, float(a, 1) as usize, triple(a, 2)))),
    ),
    line("transformc", "cSc", All(|a| cells(color::transform(float(a, 0) as usize, 0, triple(a, 1))))),
    line("logb", "gg", F1(|x| if x == 0.0 { -f32::MAX } else { x.abs().log2().floor() })),
    line("erf", "ff", F1(|x| statrs::function::erf::erf(f64::from(x)) as f32)),
    line("erfc", "ff", F1(|x| statrs::function::erf::erfc(f64::from(x)) as f32)),
    line("refract", "vvvf", All(|a| cells(refract(triple(a, 0), triple(a, 1), float(a, 2))))),
    line("rotate", "ppfv", All(|a| cells(rotate(triple(a, 0), float(a, 1), [0.0; 3], triple(a, 2))))),
    line(
        "rotate",
        "ppfpp",
        All(|a| {
            let (from, to) = (triple(a, 2), triple(a, 3));
            cells(rotate(triple(a, 0), float(a, 1), from, minus(to, from)))
        }),
    ),
    line("Dx", "gg", Derivative(Slope::Along(0))),
    line("Dy", "gg", Derivative(Slope::Along(1))),
    line("Dz", "gg", F1(|_| 0.0)),
    line("filterwidth", "gg", Derivative(Slope::Width)),
    line("area", "fp", Derivative(Slope::Area)),
    line("calculatenormal", "vp", Derivative(Slope::Normal)),
    line("aastep", "fff", Derivative(Slope::Step)),
    line("aastep", "ffff", Derivative(Slope::Step)),
    line("aastep", "fffff", All(|a| scalar(aastep(float(a, 0), float(a, 1), float(a, 2), float(a, 3))))),
    line("blackbody", "cf", All(|a| cells(color::blackbody(float(a, 0))))),
    line("wavelength_color", "cf", All(|a| cells(color::wavelength(float(a, 0))))),
    line("distance", "fppp", All(|a| scalar(to_segment(triple(a, 0), triple(a, 1), triple(a, 2))))),
];

/// Named numbers.
pub const CONSTANTS: &[(&str, f32)] = &[
    ("M_PI", std::f32::consts::PI),
    ("M_PI_2", std::f32::consts::FRAC_PI_2),
    ("M_PI_4", std::f32::consts::FRAC_PI_4),
    ("M_2_PI", std::f32::consts::FRAC_2_PI),
    ("M_2PI", std::f32::consts::TAU),
    ("M_4PI", 4.0 * std::f32::consts::PI),
    ("M_2_SQRTPI", std::f32::consts::FRAC_2_SQRT_PI),
    ("M_E", std::f32::consts::E),
    ("M_LN2", std::f32::consts::LN_2),
    ("M_LN10", std::f32::consts::LN_10),
    ("M_LOG2E", std::f32::consts::LOG2_E),
    ("M_LOG10E", std::f32::consts::LOG10_E),
    ("M_SQRT2", std::f32::consts::SQRT_2),
    ("M_SQRT1_2", std::f32::consts::FRAC_1_SQRT_2),
];

/// Functions of OSL that are not there, and why.
pub const UNSUPPORTED: &[(&str, &str)] = &[
    ("bump", "it moves points; compute a normal and give it to the closures"),
    ("dict_find", "dictionaries are not read"),
    ("dict_next", "dictionaries are not read"),
    ("dict_value", "dictionaries are not read"),
    ("displace", "a material does not move points"),
    ("environment", "materials do not look up the surroundings; the renderer lights them"),
    ("exit", "use `return`"),
    ("fprintf", "scripts write no files; use `printf`"),
    ("getmessage", "messages between shaders need a shading network"),
    ("pointcloud_get", "point clouds are not read"),
    ("pointcloud_search", "point clouds are not read"),
    ("pointcloud_write", "point clouds are not written"),
    ("random", "results would differ from render to render; use `cellnoise` or `hashnoise`"),
    (
        "regex_match",
        "regular expressions are not there, to keep the library lean; use `startswith`, `endswith`, `split`",
    ),
    ("regex_search", "regular expressions are not there; use `startswith`, `endswith`, `split`"),
    ("setmessage", "messages between shaders need a shading network"),
    ("surfacearea", "the area of a light is the renderer's business"),
    ("texture3d", "only `texture` is there"),
    ("trace", "materials send no rays"),
    ("transformu", "units are not known"),
];

/// What is said about a function that is not quite what its name says. `given`: the host gives derivatives.
pub fn warning(name: &str, given: bool) -> Option<&'static str> {
    match name {
        "Dz" => Some("derivatives along the view are zero here: surfaces have no depth"),
        "Dx" | "Dy" | "filterwidth" | "area" | "calculatenormal" if !given => {
            Some("derivatives are zero here: the host gives none")
        }
        "aastep" if !given => Some("derivatives are zero here: `aastep` is a plain step"),
        _ => None,
    }
}

/// The overloads of a name, as indices into [`BUILTINS`].
pub fn overloads(name: &str) -> &'static [u16] {
    static INDEX: OnceLock<HashMap<&'static str, Vec<u16>>> = OnceLock::new();
    let index = INDEX.get_or_init(|| {
        let mut index: HashMap<_, Vec<u16>> = HashMap::new();
        for (i, builtin) in BUILTINS.iter().enumerate() {
            index.entry(builtin.name).or_default().push(i as u16);
        }
        index
    });
    index.get(name).map_or(&[], Vec::as_slice)
}

fn clamp(x: f32, lo: f32, hi: f32) -> f32 {
    let above = if x < lo { lo } else { x };
    if above > hi { hi } else { above }
}

/// Keeps logarithms finite.
fn positive(x: f32) -> f32 {
    if x > f32::MIN_POSITIVE { x } else { f32::MIN_POSITIVE }
}

/// Powers without a real value are 0, infinite ones the largest float; 0 to anything but 0 is 0.
fn power(x: f32, y: f32) -> f32 {
    if y == 0.0 {
        1.0
    } else if x == 0.0 {
        0.0
    } else {
        let p = x.powf(y);
        if p.is_nan() && !x.is_nan() && !y.is_nan() { 0.0 } else { p.clamp(-f32::MAX, f32::MAX) }
    }
}

/// A step filtered over as far as its arguments change (stdosl.h).
fn aastep(edge: f32, x: f32, change_of_edge: f32, change_of_x: f32) -> f32 {
    let width = change_of_edge.abs() + change_of_x.abs();
    let start = edge - 0.5 * width;
    if x <= start {
        0.0
    } else if x >= edge + 0.5 * width {
        1.0
    } else {
        (x - start) / width
    }
}

fn linear_step(lo: f32, hi: f32, x: f32) -> f32 {
    if x < lo {
        0.0
    } else if x >= hi {
        1.0
    } else {
        (x - lo) / (hi - lo)
    }
}

fn smooth_step(lo: f32, hi: f32, x: f32) -> f32 {
    let t = linear_step(lo, hi, x);
    t * t * (3.0 - 2.0 * t)
}

fn float(args: &[Cells], i: usize) -> f32 {
    f32::from_bits(args[i][0])
}

fn triple(args: &[Cells], i: usize) -> [f32; 3] {
    args[i].map(f32::from_bits)
}

fn cells(v: [f32; 3]) -> Cells {
    v.map(f32::to_bits)
}

fn scalar(x: f32) -> Cells {
    [x.to_bits(), 0, 0]
}

fn truth(t: bool) -> Cells {
    [u32::from(t), 0, 0]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn length(v: [f32; 3]) -> f32 {
    dot(v, v).sqrt()
}

fn normalize(v: [f32; 3]) -> [f32; 3] {
    let length = length(v);
    v.map(|x| divide(x, length))
}

/// The incident direction mirrored at a plane with unit normal n.
fn reflect(i: [f32; 3], n: [f32; 3]) -> [f32; 3] {
    let d = 2.0 * dot(n, i);
    minus(i, n.map(|x| d * x))
}

fn face_forward(n: [f32; 3], i: [f32; 3], reference: [f32; 3]) -> [f32; 3] {
    if dot(i, reference) < 0.0 { n } else { n.map(|x| -x) }
}

/// The direction refracted at a plane with unit normal n; 0 where it is reflected totally.
fn refract(i: [f32; 3], n: [f32; 3], eta: f32) -> [f32; 3] {
    let cos = dot(i, n);
    let rest = 1.0 - eta * eta * (1.0 - cos * cos);
    if rest < 0.0 {
        return [0.0; 3];
    }
    let along = eta * cos + rest.sqrt();
    std::array::from_fn(|k| eta * i[k] - along * n[k])
}

/// A point turned by an angle about the axis through `from` along `axis` (Rodrigues).
fn rotate(p: [f32; 3], angle: f32, from: [f32; 3], axis: [f32; 3]) -> [f32; 3] {
    let k = normalize(axis);
    let v = minus(p, from);
    let (sin, cos) = angle.sin_cos();
    let (side, along) = (cross(k, v), dot(k, v) * (1.0 - cos));
    std::array::from_fn(|c| from[c] + v[c] * cos + side[c] * sin + k[c] * along)
}

/// The distance from the segment ab to q.
fn to_segment(a: [f32; 3], b: [f32; 3], q: [f32; 3]) -> f32 {
    let (line, to) = (minus(b, a), minus(q, a));
    let t = clamp(divide(dot(line, to), dot(line, line)), 0.0, 1.0);
    length(minus(to, line.map(|x| x * t)))
}
