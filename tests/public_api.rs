//! The public interface is what `docs/api.txt` lists: a change to it is seen in review.
//!
//! The list is read off the pages of `cargo doc`. That sees what users see – re-exports, what macros make, no private
//! module – on a stable toolchain; rustdoc's JSON needs nightly and another parser for every version of it, and reading
//! the source finds neither macros nor re-exports. Of the pages only text is compared, without its spaces, so that their
//! layout may change. Run by `.ci/run`; `OVERCOAT_BLESS=1 cargo test --test public_api -- --ignored` writes the list anew.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The pages of all items, written by the stable toolchain.
fn pages() -> PathBuf {
    let test = std::env::current_exe().expect("a path");
    let target = test.ancestors().find(|p| p.join("CACHEDIR.TAG").exists()).expect("a target directory");
    let status = Command::new(env!("CARGO"))
        .args(["doc", "--quiet", "--no-deps", "--all-features", "--lib", "--target-dir"])
        .arg(target)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .status()
        .expect("cargo starts");
    assert!(status.success());
    target.join("doc/overcoat")
}

/// What stands between `open` and `close`, wherever it does.
fn between<'a>(text: &'a str, open: &'a str, close: char) -> impl Iterator<Item = &'a str> {
    text.split(open).skip(1).filter_map(move |rest| rest.split_once(close).map(|(inside, _)| inside))
}

/// What a reader sees of a piece of a page, without spaces but between words.
fn text(html: &str) -> String {
    let mut seen = String::new();
    for (index, piece) in html.split('<').enumerate() {
        seen += if index == 0 { piece } else { piece.split_once('>').map_or("", |(_, text)| text) };
    }
    let seen = seen.replace("&lt;", "<").replace("&gt;", ">").replace("&#39;", "'").replace("&nbsp;", " ");
    let seen = seen.replace("&amp;", "&").replace('§', "");
    let word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '\'' || c == ')');
    let mut short = String::new();
    for piece in seen.split_whitespace() {
        if word(short.chars().last()) && piece.starts_with(|c: char| c.is_alphanumeric() || c == '_') {
            short.push(' ');
        }
        short += piece;
    }
    short.replace(",)", ")").trim_start_matches("Source").to_owned()
}

/// The members of an item that are its own – fields, variants, methods, constants – with their types.
fn members(page: &str) -> BTreeSet<String> {
    let own = page.split("id=\"trait-implementations\"").next().unwrap_or("");
    let own = own.split("id=\"implementors\"").next().unwrap_or("");
    let kinds = ["method", "tymethod", "variant", "structfield", "associatedconstant", "associatedtype"];
    let mut found = BTreeSet::new();
    for piece in own.split(" id=\"").skip(1) {
        let Some((id, rest)) = piece.split_once('"') else { continue };
        if kinds.iter().any(|k| id.split('.').next() == Some(k)) && !id.ends_with(".fields") {
            let end = ["</h3>", "</h4>", "</code>"].iter().filter_map(|e| rest.find(e)).min().unwrap_or(0);
            let (_, shown) = rest[..end].split_once('>').unwrap_or(("", ""));
            found.insert(text(shown));
        }
    }
    found
}

/// The declaration of a function, constant or type alias; of others the members tell.
fn declaration(kind: &str, page: &str) -> String {
    let shown = page.split_once("item-decl\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    match (kind, shown) {
        ("fn" | "constant" | "type", Some((declaration, _))) => format!(": {}", text(declaration)),
        _ => String::new(),
    }
}

fn listing(pages: &Path) -> String {
    let all = std::fs::read_to_string(pages.join("all.html")).expect("all.html");
    let mut lines = BTreeSet::new();
    // Links within the page, and the program, which is nobody's library.
    let items = between(&all, "<li><a href=\"", '"').filter(|l| l.contains(".html") && !l.starts_with("cli/"));
    for link in items {
        let page = std::fs::read_to_string(pages.join(link)).expect("a page");
        let (folder, file) = link.rsplit_once('/').unwrap_or(("", link));
        let mut parts = file.split('.');
        let (kind, name) = (parts.next().unwrap_or(""), parts.next().unwrap_or(""));
        let path = format!("{folder}/{name}").trim_start_matches('/').replace('/', "::");
        lines.insert(format!("{kind} {path}{}", declaration(kind, &page)));
        lines.extend(members(&page).into_iter().map(|member| format!("{kind} {path}: {member}")));
    }
    lines.into_iter().collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
#[ignore = "builds the documentation"]
fn the_public_interface_is_the_listed_one() {
    let found = listing(&pages());
    assert!(found.contains("struct closure::bsdf::Bsdf: pub fn eval("), "{found}");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/api.txt");
    if std::env::var_os("OVERCOAT_BLESS").is_some() {
        std::fs::write(&path, &found).expect("written");
    }
    let listed = std::fs::read_to_string(&path).unwrap_or_default();
    let set = |text: &str| text.lines().map(str::to_owned).collect::<BTreeSet<_>>();
    let (found, listed) = (set(&found), set(&listed));
    let gone: Vec<_> = listed.difference(&found).collect();
    let new: Vec<_> = found.difference(&listed).collect();
    assert!(gone.is_empty() && new.is_empty(), "gone: {gone:#?}\nnew: {new:#?}\nblessed by OVERCOAT_BLESS=1");
}
