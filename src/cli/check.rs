//! `overcoat check`: the static proof of energy conservation over whole parameter ranges.

use super::input::{self, name_and_value};
use super::{Failure, Global, Outcome, output};
use crate::audit::Side;
use crate::closure::ClosureTree;
use crate::diag::{Diagnostic, Severity};
use crate::engine::Shader;
use crate::ir;
use crate::prove::{self, Options, Report, Verdict, Witness, prove};
use crate::span::Source;
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Args, Debug)]
pub struct CheckArgs {
    /// Scripts and folders of scripts (`*.osl`, at any depth); `-` reads stdin.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The range of a parameter, or of u, v or time, in place of the declared one. Repeatable.
    #[arg(long, value_name = "NAME=LO,HI", allow_hyphen_values = true)]
    range: Vec<String>,
    /// Exit with 0 where nothing gains and something is undecided.
    #[arg(long)]
    allow_undecided: bool,
    /// How results are written.
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    /// Hold every verdict against this many random parameters and angles, measured.
    #[arg(long, value_name = "N", default_value_t = 0)]
    probe: usize,
    /// Same seed, same probes.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For people; diagnostics on stderr.
    Text,
    /// Annotations of a GitHub workflow.
    Github,
}

/// What became of one file.
struct Checked {
    source: Source,
    shader: String,
    /// `None`: it does not compile.
    report: Option<Report>,
    diagnostics: Vec<Diagnostic>,
    /// Probes that contradict the verdict.
    contradictions: Vec<String>,
}

pub fn run(global: &Global, args: &CheckArgs) -> Outcome {
    let mut files = Vec::new();
    for file in &args.files {
        collect(file, &mut files)?;
    }
    if files.is_empty() {
        return Err(Failure::usage("there is no `*.osl` file to check"));
    }
    let results = files.par_iter().map(|file| check(global, args, file)).collect::<Result<Vec<Checked>, Failure>>()?;
    if global.json {
        let results: Vec<Value> = results.iter().map(to_json).collect();
        output::json(&json!({ "results": results }))?;
    } else {
        let line = |c: &Checked| if args.format == Format::Github { annotations(c) } else { summary(c) };
        output::write(&results.iter().map(line).collect::<String>())?;
    }
    if !global.quiet && args.format == Format::Text {
        for checked in &results {
            tell(global, checked);
        }
    }
    verdict(args, &results)
}

/// Files as given, folders by name.
pub(super) fn collect(path: &Path, files: &mut Vec<PathBuf>) -> Result<(), Failure> {
    if path == Path::new("-") || !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    let unreadable = |e: std::io::Error| Failure::usage(format!("cannot read `{}`: {e}", path.display()));
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(path).map_err(unreadable)? {
        entries.push(entry.map_err(unreadable)?.path());
    }
    entries.sort();
    for entry in entries {
        let link = entry.symlink_metadata().is_ok_and(|m| m.is_symlink());
        if entry.is_dir() && !link {
            collect(&entry, files)?;
        } else if entry.extension().is_some_and(|e| e == "osl") {
            files.push(entry);
        }
    }
    Ok(())
}

fn check(global: &Global, args: &CheckArgs, file: &Path) -> Result<Checked, Failure> {
    let (name, text) = match input::read(file) {
        Ok(read) => read,
        // A file that is no text has errors, like one that does not parse.
        Err(Failure::Script(message)) => {
            let span = crate::span::Span::default();
            let source = Source::new(file.display().to_string(), "");
            let diagnostics = vec![Diagnostic::error("E0106", span, message)];
            return Ok(Checked { source, shader: String::new(), report: None, diagnostics, contradictions: vec![] });
        }
        Err(other) => return Err(other),
    };
    let shader = match global.engine_for(file).compile(&name, &text) {
        Ok(shader) => shader,
        Err(e) => return Ok(failed((*e.source).clone(), "", e.diagnostics)),
    };
    let options = options(global, args, &shader)?;
    let report = match judge(&shader, &options) {
        Ok(report) => report,
        Err(diagnostics) if diagnostics.iter().all(|d| d.code.starts_with("E04")) => {
            return Err(global.setting_failed(&diagnostics, shader.source()));
        }
        Err(diagnostics) => return Ok(failed(shader.source().clone(), shader.name(), diagnostics)),
    };
    let contradictions = match args.probe {
        0 => vec![],
        count => prove::probe(&shader, &options, &report, count, args.seed),
    };
    let diagnostics = shader.warnings().iter().chain(&report.diagnostics).cloned().collect();
    let (source, name) = (shader.source().clone(), shader.name().to_owned());
    Ok(Checked { source, shader: name, report: Some(report), diagnostics, contradictions })
}

/// The proof, for a script whose tree stays within its budget at all.
pub(super) fn judge(shader: &Shader, options: &Options) -> Result<Report, Vec<Diagnostic>> {
    // A tree beyond its budget has no BSDF to prove anything about.
    let mut tree = ClosureTree::new();
    let shaded = shader.checked().specialise(&[]).map(|program| program.shade(&crate::Globals::default(), &mut tree));
    if let Ok(Err(e)) = shaded {
        return Err(vec![Diagnostic::error("E0110", crate::span::Span::default(), e.to_string())]);
    }
    prove(shader, options)
}

fn failed(source: Source, shader: &str, diagnostics: Vec<Diagnostic>) -> Checked {
    Checked { source, shader: shader.to_owned(), report: None, diagnostics, contradictions: vec![] }
}

fn options(global: &Global, args: &CheckArgs, shader: &Shader) -> Result<Options, Failure> {
    let mut ranges = Vec::new();
    for given in &args.range {
        let (name, text) = name_and_value(given)?;
        let ends: Result<Vec<f32>, _> = text.split(',').map(|t| t.trim().parse()).collect();
        match ends.as_deref() {
            Ok([lo, hi]) if lo <= hi => ranges.push((name, *lo, *hi)),
            _ => {
                return Err(Failure::usage(format!(
                    "--range {given}: expected NAME=LO,HI, for example `roughness=0,1`"
                )));
            }
        }
    }
    Ok(Options { set: global.values(shader, &[])?, ranges })
}

fn verdict(args: &CheckArgs, results: &[Checked]) -> Outcome {
    let any = |is: &dyn Fn(&Report) -> bool| results.iter().any(|c| c.report.as_ref().is_some_and(is));
    if results.iter().any(|c| c.report.is_none()) {
        return Err(Failure::Status(1));
    }
    let undecided = !args.allow_undecided && any(&|r| r.verdict == Verdict::Undecided);
    let contradicted = results.iter().any(|c| !c.contradictions.is_empty());
    if any(&|r| r.verdict == Verdict::Gains) || undecided || contradicted {
        return Err(Failure::Status(3));
    }
    Ok(())
}

fn name_of(checked: &Checked) -> &'static str {
    checked.report.as_ref().map_or("error", |r| r.verdict.name())
}

/// `velvet.osl: conserves, albedo at most 0.999`
fn summary(checked: &Checked) -> String {
    let mut text = format!("{}: {}", checked.source.name, name_of(checked));
    if let Some(report) = &checked.report {
        match (report.verdict, report.bound, &report.witness) {
            (_, _, Some(w)) => drop(write!(text, ", albedo {:.4}", w.albedo.max())),
            (_, Some(bound), _) => drop(write!(text, ", albedo at most {bound:.4}")),
            _ => {}
        }
    }
    for line in &checked.contradictions {
        let _ = write!(text, "\n  contradicted: {line}");
    }
    text.push('\n');
    text
}

/// Diagnostics and notes, on stderr.
fn tell(global: &Global, checked: &Checked) {
    if !checked.diagnostics.is_empty() {
        let color = input::stderr_has_color();
        eprintln!("{}", crate::diag::render_all(&checked.diagnostics, &checked.source, color).trim_end());
    }
    let notes = checked.report.iter().flat_map(|r| &r.notes);
    for note in notes.filter(|_| !global.json) {
        eprintln!("note: {}: {note}", checked.source.name);
    }
}

fn to_json(checked: &Checked) -> Value {
    let mut messages: Vec<String> = Vec::new();
    for d in &checked.diagnostics {
        messages.push(d.line(&checked.source));
        messages.extend(d.help.iter().cloned());
    }
    messages.extend(checked.report.iter().flat_map(|r| r.notes.clone()));
    messages.extend(checked.contradictions.iter().map(|c| format!("contradicted: {c}")));
    let report = checked.report.as_ref();
    json!({
        "file": checked.source.name,
        "shader": checked.shader,
        "verdict": name_of(checked),
        "bound": report.and_then(|r| r.bound),
        "witness": report.and_then(|r| r.witness.as_ref()).map(witness),
        "messages": messages,
    })
}

pub(super) fn witness(w: &Witness) -> Value {
    let value = |v: &ir::Value| match (v, v.numbers().as_slice()) {
        (ir::Value::String(text), _) => json!(text),
        (ir::Value::Int(i), _) => json!(i),
        (_, [x]) => output::number(*x),
        (_, numbers) => output::numbers(numbers),
    };
    let params: Map<String, Value> = w.params.iter().map(|(n, v)| (n.clone(), value(v))).collect();
    let globals: Map<String, Value> = w
        .globals
        .iter()
        .map(|(n, v)| (n.clone(), if let [x] = v.as_slice() { output::number(*x) } else { output::numbers(v) }))
        .collect();
    let side = match w.side {
        Side::View => "view",
        Side::Light => "light",
    };
    json!({
        "params": params, "globals": globals, "side": side, "cos": w.cos, "dir": w.dir, "albedo": w.albedo.value,
    })
}

/// `::error file=…,line=…::…`, one per diagnostic.
fn annotations(checked: &Checked) -> String {
    let mut text = String::new();
    for d in &checked.diagnostics {
        let at = checked.source.line_column(d.span.start as usize);
        let level = match d.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let message = std::iter::once(&d.message).chain(&d.help).cloned().collect::<Vec<_>>().join("\n");
        let file = property(&checked.source.name);
        let _ = writeln!(
            text,
            "::{level} file={file},line={},col={},title={}::{}",
            at.line,
            at.column,
            property(&format!("overcoat check: {}", name_of(checked))),
            data(&message)
        );
    }
    text
}

/// As workflow commands escape what follows the second `::`.
fn data(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}
