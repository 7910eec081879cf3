//! `include/overcoat.h` is what `src/capi` says. `OVERCOAT_BLESS=1` writes it anew.
#![cfg(feature = "capi")]

use std::path::Path;

#[test]
fn the_header_is_fresh() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut builder = cbindgen::Builder::new().with_config(cbindgen::Config::from_root_or_default(root));
    let mut files: Vec<_> = std::fs::read_dir(root.join("src/capi")).expect("sources").flatten().collect();
    files.sort_by_key(|f| f.file_name());
    for file in files {
        builder = builder.with_src(file.path());
    }
    let mut text = Vec::new();
    builder.generate().expect("bindings").write(&mut text);
    let text = String::from_utf8(text).expect("text");
    let path = root.join("include/overcoat.h");
    if std::env::var_os("OVERCOAT_BLESS").is_some() {
        std::fs::write(&path, &text).expect("written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(committed == text, "stale: OVERCOAT_BLESS=1 cargo test --features capi --test hosts capi_header");
    for name in [
        "oc_abi_version",
        "oc_last_error",
        "oc_engine_new",
        "oc_engine_free",
        "oc_material_compile",
        "oc_material_set_float",
        "oc_material_set_color",
        "oc_material_set_string",
        "oc_material_free",
        "oc_shade",
        "oc_bsdf_eval",
        "oc_bsdf_sample",
        "oc_bsdf_albedo",
        "oc_bsdf_free",
        "oc_register_closure",
    ] {
        assert!(text.contains(&format!(" {name}(")), "no `{name}`");
    }
}
