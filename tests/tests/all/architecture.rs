//! Holds the dependency rule: cli -> {applications} -> resample-io -> resample-core, and no application knows another; and within a crate,
//! no files that import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use resample_tests::import_graph::ImportGraph;
use serde_json::Value;

const CORE: &str = "resample-core";
const IO: &str = "resample-io";
const APPLICATIONS: [&str; 3] = ["texmap", "warp3d", "volsplat"];

/// The workspace's crates and, of their dependencies (development ones aside), those that are in the workspace.
fn workspace_dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--no-deps",
            "--format-version",
            "1",
            "--offline",
            "--manifest-path",
        ])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"))
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo writes JSON");
    let packages = metadata["packages"].as_array().expect("a list of packages");
    let name = |value: &Value| value["name"].as_str().expect("a name").to_owned();
    let members: BTreeSet<String> = packages.iter().map(name).collect();
    let used = |package: &Value| {
        let all = package["dependencies"].as_array().expect("a list").iter();
        all.filter(|d| d["kind"].as_str() != Some("dev"))
            .map(name)
            .filter(|d| members.contains(d))
            .collect()
    };
    packages
        .iter()
        .map(|package| (name(package), used(package)))
        .collect()
}

#[test]
fn dependencies_flow_one_way() {
    let uses = workspace_dependencies();
    assert!(uses.contains_key(CORE), "the core is a member: {uses:?}");
    assert!(
        uses[CORE].is_empty(),
        "{CORE} depends on nothing of ours, but uses {:?}",
        uses[CORE]
    );
    for application in APPLICATIONS.iter().filter(|a| uses.contains_key(**a)) {
        let allowed = BTreeSet::from([CORE.to_owned(), IO.to_owned()]);
        assert!(
            uses[*application].contains(CORE) && uses[*application].is_subset(&allowed),
            "{application} may know the core and {IO}, but uses {:?}",
            uses[*application]
        );
    }
    assert_eq!(
        uses[IO],
        BTreeSet::from([CORE.to_owned()]),
        "{IO} may know the core alone"
    );
}

#[test]
fn the_core_touches_no_files() {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/../resample-core/src");
    let mut folders = vec![std::path::PathBuf::from(source)];
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("the source is there") {
            let path = entry.expect("readable").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("text");
            for word in ["std::fs", "std::io", "std::path", "std::net"] {
                assert!(!text.contains(word), "{} uses {word}", path.display());
            }
            files += 1;
        }
    }
    assert!(files > 15, "only {files} files were looked at");
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    for name in [
        "resample-core",
        "resample-core/io",
        "texmap",
        "warp3d",
        "volsplat",
        "cli",
    ] {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
            .join(name)
            .join("src");
        let graph = ImportGraph::read(&folder);
        assert!(graph.file_count() > 1, "{name}: no sources were read");
        let circles = graph.circles();
        assert!(circles.is_empty(), "{name}: {circles:#?}");
    }
}

#[test]
fn a_circle_is_found_through_groups_and_names_that_are_handed_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write("lib.rs", "mod a; mod b; mod c; pub use a::First;");
    write(
        "a.rs",
        "use crate::{b::{Other, Second}, c}; pub struct First;",
    );
    write("b.rs", "pub struct Second; fn f() { crate::c::third() }");
    write(
        "c.rs",
        "// use crate::b;\npub fn third() -> &'static str { \"crate::b\" }",
    );
    let circles = ImportGraph::read(folder.path()).circles();
    assert!(
        circles.is_empty(),
        "comments and texts import nothing: {circles:?}"
    );
    write("c.rs", "pub fn third(_: crate::First) {}");
    let circles = ImportGraph::read(folder.path()).circles();
    assert_eq!(circles, [["a", "b", "c"]], "through the root's own name");
}
