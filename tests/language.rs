//! Scripts in, closure trees or messages out.

use overcoat::Globals;
use overcoat::closure::{ClosureTree, Node, NodeId};
use overcoat::diag::{self, Diagnostic};
use overcoat::ir::{self, Program};
use overcoat::span::Source;
use std::path::{Path, PathBuf};

/// A tree as compact text. Recursive: for small trees.
fn print(tree: &ClosureTree, id: NodeId) -> String {
    let triple = |v: &[f32]| v.iter().map(|x| format!("{x}")).collect::<Vec<_>>().join(" ");
    match tree.node(id) {
        Node::Zero => "zero".to_owned(),
        Node::Add(a, b) => format!("add({}, {})", print(tree, a), print(tree, b)),
        Node::Mul(w, c) => format!("mul({}, {})", triple(&w), print(tree, c)),
        Node::Layer { top, base } => format!("layer({}, {})", print(tree, top), print(tree, base)),
        Node::Lobe { kind, slots, .. } => {
            let values = tree.values(kind, slots);
            let mut at = 0;
            let params = kind.spec().params.iter().map(|p| {
                let slots = &values[at..at + p.ty.slots()];
                at += p.ty.slots();
                format!("{}={}", p.name, triple(slots))
            });
            format!("{}({})", kind.spec().name, params.collect::<Vec<_>>().join(", "))
        }
    }
}

fn program(source: &str) -> Program {
    let (shader, _) = ir::compile("test.osl", source).unwrap_or_else(|e| panic!("{}", rendered(source, &e)));
    shader.specialise(&[]).unwrap_or_else(|e| panic!("{}", rendered(source, &e)))
}

fn shade(program: &Program) -> String {
    let mut tree = ClosureTree::new();
    program.shade(&Globals::default(), &mut tree).unwrap();
    print(&tree, tree.root())
}

fn rendered(source: &str, diagnostics: &[Diagnostic]) -> String {
    diag::render_all(diagnostics, &Source::new("test.osl", source), false)
}

fn corpus(directory: &str) -> Vec<(PathBuf, String)> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(directory);
    let mut files: Vec<_> = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

#[test]
fn good_scripts_give_their_trees() {
    let mut failures = Vec::new();
    for (path, text) in corpus("ok") {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let want = text.lines().find_map(|l| l.strip_prefix("// tree: ")).expect("a `// tree:` line");
        let constant = text.lines().any(|l| l == "// constant");
        match ir::compile(&name, &text).map_err(|e| rendered(&text, &e)) {
            Err(messages) => failures.push(format!("{name}:\n{messages}")),
            Ok((shader, _)) => {
                let program = shader.specialise(&[]).unwrap();
                let found = shade(&program);
                if found != want.trim() {
                    failures.push(format!("{name}:\n  want {want}\n found {found}"));
                }
                if program.is_constant() != constant {
                    failures.push(format!("{name}: constant is {}", program.is_constant()));
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

/// Each line of a bad script names the codes expected on it, in a comment.
#[test]
fn bad_scripts_give_their_messages() {
    let mut failures = Vec::new();
    for (path, text) in corpus("err") {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let mut want = Vec::new();
        for (i, line) in text.lines().enumerate() {
            let comment = line.split_once("//").map_or("", |(_, c)| c);
            let words = comment.split_whitespace().filter(|w| w.len() == 5 && w.starts_with(['E', 'W']));
            want.extend(words.filter(|w| w[1..].bytes().all(|b| b.is_ascii_digit())).map(|w| format!("{}:{w}", i + 1)));
        }
        let source = Source::new(name.as_str(), text.as_str());
        let diagnostics = match ir::compile(&name, &text) {
            Ok((shader, warnings)) => {
                warnings.into_iter().chain(shader.specialise(&[]).err().unwrap_or_default()).collect()
            }
            Err(diagnostics) => diagnostics,
        };
        let line = |d: &Diagnostic| format!("{}:{}", source.line_column(d.span.start as usize).line, d.code);
        let mut found: Vec<_> = diagnostics.iter().map(line).collect();
        found.sort();
        want.sort();
        if want != found {
            failures.push(format!("{name}: want {want:?}, found {found:?}\n{}", rendered(&text, &diagnostics)));
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}
