//! `overcoat lobes --markdown` and `--gallery`: docs/lobes.md and its pictures, made from the registry.

use super::lobes::{paragraph, range};
use super::render::{self, RenderArgs};
use super::{Failure, Global, Outcome, output};
use crate::lobes::registry::{Build, Form};
use crate::lobes::{LobeKind, forms};
use std::fmt::Write;
use std::path::Path;

/// Chapters, in order.
const FAMILIES: [(&str, &str); 7] = [
    ("Diffuse", "Light leaves in all directions, nearly evenly."),
    ("Through the surface", "Light leaves on the other side, or elsewhere."),
    ("Cloth", "Fibres and threads; [cloth.md](cloth.md) compares them."),
    ("Rough surfaces", "Facets that mirror or refract, and highlights that stand for them."),
    ("Smooth surfaces", "One direction in, one or two out."),
    ("Light and signals", "What adds no scattering: light of its own, and what the renderer is told."),
    (
        "Composition",
        "Closures of closures. `+`, `*` and `mix(a, b, x)` are there too; the literal 0 is a black closure.",
    ),
];

/// The chapter of a lobe.
fn family(kind: LobeKind) -> usize {
    match kind {
        LobeKind::Diffuse | LobeKind::OrenNayar | LobeKind::OrenNayarDiffuse | LobeKind::Eon | LobeKind::Burley => 0,
        LobeKind::Translucent | LobeKind::Transparent | LobeKind::Subsurface => 1,
        LobeKind::Sheen
        | LobeKind::Velvet
        | LobeKind::Fabric
        | LobeKind::Thread
        | LobeKind::Microcylinder
        | LobeKind::MicrocylinderThreads => 2,
        LobeKind::Microfacet
        | LobeKind::Dielectric
        | LobeKind::Conductor
        | LobeKind::Metal
        | LobeKind::GeneralizedSchlick
        | LobeKind::Phong
        | LobeKind::Ward => 3,
        LobeKind::Reflection | LobeKind::Refraction => 4,
        LobeKind::Emission | LobeKind::Holdout | LobeKind::Background | LobeKind::Debug | LobeKind::Host(_) => 5,
    }
}

fn chapter(form: &Form) -> usize {
    match form.build {
        Build::Lobe { kind, .. } | Build::Tinted { kind, .. } => family(kind),
        Build::Wrap { .. } | Build::Layer => 6,
    }
}

/// Prints the reference.
pub fn markdown() -> Outcome {
    let mut text = String::from(
        "# Closures\n\n<!-- Made by `overcoat lobes --markdown > docs/lobes.md`; do not edit. -->\n\n\
         Every closure a script can call. Arguments in order, then keywords as pairs of a name in quotes and a value; the \
         types tell forms of one name apart. Values are clamped to their range; a normal or vector that is zero becomes the \
         shading point's. Pictures show the lobe with the values of the script beside them, under one light \
         (`overcoat lobes --gallery docs/lobes` makes them).\n\n",
    );
    for (i, (title, _)) in FAMILIES.iter().enumerate() {
        let names: Vec<String> = forms().filter(|f| chapter(f) == i).map(|f| format!("`{}`", f.name)).collect();
        let mut seen = std::collections::BTreeSet::new();
        let names: Vec<&str> = names.iter().map(String::as_str).filter(|n| seen.insert(*n)).collect();
        let _ = writeln!(text, "- **{title}**: {}", names.join(", "));
    }
    for (i, (title, what)) in FAMILIES.iter().enumerate() {
        let _ = write!(text, "\n## {title}\n\n{what}\n");
        for form in forms().filter(|f| chapter(f) == i) {
            section(&form, &mut text);
        }
    }
    output::write(&text)
}

fn section(form: &Form, text: &mut String) {
    let _ = write!(text, "\n### {}\n\n```\n{}\n```\n\n{}\n", form.name, form.signature(), paragraph(form.doc));
    if !form.note.is_empty() {
        let _ = write!(text, "\n**Note:** {}.\n", form.note);
    }
    // Other names show what they stand for; their parameters are those of the lobe.
    let own = matches!(form.build, Build::Lobe { kind, args: [] } if kind.spec().name == form.name);
    if own && let Build::Lobe { kind, .. } = form.build {
        if pictured(kind) {
            let name = form.name;
            let _ = write!(text, "\n![{name}](lobes/{name}.png)\n\n[lobes/{name}.osl](lobes/{name}.osl)\n");
        }
        if !form.params.is_empty() {
            text.push_str("\n| parameter | |\n|---|---|\n");
        }
        for p in form.params {
            let doc = paragraph(p.doc).replace('|', "\\|");
            let _ = writeln!(text, "| `{} {}`{} | {doc} |", p.ty.name(), p.name, range(p));
        }
        let reciprocal = if form.reciprocal { "Reciprocal" } else { "Not reciprocal" };
        let _ = write!(text, "\n{reciprocal} at its defaults. Source: {}.\n", form.source);
    }
}

/// Whether there is something to see.
fn pictured(kind: LobeKind) -> bool {
    family(kind) != 5 || kind == LobeKind::Emission
}

/// Renders `NAME.png` beside each `NAME.osl` of a folder; the script's first line says what is swept.
pub fn gallery(global: &Global, folder: &Path) -> Outcome {
    let unreadable = |e: std::io::Error| Failure::usage(format!("{}: {e}", folder.display()));
    let mut scripts: Vec<_> = std::fs::read_dir(folder).map_err(unreadable)?.flatten().map(|f| f.path()).collect();
    scripts.retain(|path| path.extension().is_some_and(|e| e == "osl"));
    scripts.sort();
    for script in scripts {
        let text = std::fs::read_to_string(&script).map_err(unreadable)?;
        let sweep = text.lines().next().and_then(|line| line.strip_prefix("// sweep ")).map(str::to_owned);
        render::run(global, &RenderArgs::small(&script, &script.with_extension("png"), sweep))?;
    }
    Ok(())
}
