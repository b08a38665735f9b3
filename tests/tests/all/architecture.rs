//! Holds the plan of the house: cli -> {applications, cloud} -> {volume, mesh} -> resample-io -> resample-core, and no application knows another;
//! within a crate no circle of files or of folders, few siblings in a folder, and no file or crate too large to read.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use resample_tests::import_graph::ImportGraph;
use serde_json::Value;

const CORE: &str = "resample-core";
const IO: &str = "resample-io";
/// The crates that draw.
const APPLICATIONS: [&str; 4] = ["texmap", "warp3d", "resample-cloud", "volsplat"];

/// The crates that read what an application draws, each used by that application alone.
const READERS: [(&str, &str); 2] = [("resample-mesh", "texmap"), ("resample-volume", "volsplat")];

/// The folders of all crates.
const FOLDERS: [&str; 9] = [
    "resample-core",
    "resample-core/io",
    "texmap",
    "texmap/mesh",
    "warp3d",
    "warp3d/cloud",
    "volsplat",
    "volsplat/volume",
    "cli",
];

/// Entries of a folder that a reader takes in at a glance. A guess.
const MOST_SIBLINGS: usize = 15;

/// Lines of a file that is still one idea. A guess.
const MOST_LINES_OF_FILE: usize = 700;

/// Lines of code of a crate, without comments, blanks and tests.
const MOST_LINES_OF_CRATE: usize = 20_000;

/// The only files that may name the paper's methods: each driver chooses a pipeline.
const DRIVERS: [&str; 3] = ["render", "warper", "commands::bench"];

fn source(folder: &str) -> PathBuf {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    root.join(folder).join("src")
}

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
        let readers = READERS.iter().filter(|(_, user)| user == application);
        let allowed: BTreeSet<String> = readers
            .map(|(reader, _)| *reader)
            .chain([CORE, IO])
            .map(str::to_owned)
            .collect();
        assert!(
            uses[*application].contains(CORE) && uses[*application].is_subset(&allowed),
            "{application} may know {allowed:?}, but uses {:?}",
            uses[*application]
        );
    }
    assert_eq!(
        uses[IO],
        BTreeSet::from([CORE.to_owned()]),
        "{IO} may know the core alone"
    );
    for (reader, _) in READERS {
        let expected = BTreeSet::from([CORE.to_owned(), IO.to_owned()]);
        assert_eq!(uses[reader], expected, "{reader} draws nothing");
    }
}

#[test]
fn the_core_touches_no_files() {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/../resample-core/src");
    let mut folders = vec![PathBuf::from(source)];
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
fn neither_files_nor_folders_import_each_other_in_a_circle() {
    for name in FOLDERS {
        let graph = ImportGraph::read(&source(name));
        assert!(graph.file_count() > 1, "{name}: no sources were read");
        let circles = [graph.circles(), graph.circles_of_folders()].concat();
        assert!(circles.is_empty(), "{name}: {circles:#?}");
    }
}

#[test]
fn folders_files_and_crates_are_small_enough_to_read() {
    for name in FOLDERS.into_iter().chain(["tests"]) {
        let siblings = ImportGraph::read(&source(name)).siblings();
        for (folder, count) in siblings {
            assert!(count <= MOST_SIBLINGS, "{name} {folder}: {count} siblings");
        }
        let mut in_crate = 0;
        for path in sources(&source(name)) {
            let text = std::fs::read_to_string(&path).expect("text");
            let lines = text.lines().count();
            let path = path.display();
            assert!(lines <= MOST_LINES_OF_FILE, "{path}: {lines} lines");
            in_crate += lines_of_code(&text);
        }
        assert!(in_crate > 500, "{name}: only {in_crate} lines were read");
        assert!(in_crate <= MOST_LINES_OF_CRATE, "{name}: {in_crate} lines");
    }
}

/// All source files below a folder, test modules aside.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let own = paths.filter(|path| path.file_stem().is_none_or(|name| name != "tests"));
    own.flat_map(|path| match path.is_dir() {
        true => sources(&path),
        false => vec![path],
    })
    .filter(|path| path.extension().is_some_and(|end| end == "rs"))
    .collect()
}

/// Lines that are neither blank nor a comment, up to the first test module.
fn lines_of_code(text: &str) -> usize {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    let lines = code.lines().map(str::trim_start);
    lines
        .filter(|line| !line.is_empty() && !line.starts_with("//"))
        .count()
}

#[test]
fn the_default_path_imports_nothing_of_the_papers_methods() {
    let mut found = BTreeSet::new();
    for name in FOLDERS {
        found.extend(ImportGraph::read(&source(name)).importers_of("paper"));
    }
    assert!(found.len() > 1, "no driver was found: {found:?}");
    for file in found {
        assert!(DRIVERS.contains(&file.as_str()), "{file} imports the paper");
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

#[test]
fn a_circle_of_folders_is_found_where_no_files_are_in_one() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["one", "other"] {
        std::fs::create_dir(folder.path().join(name)).expect("a folder");
    }
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write("lib.rs", "mod one; mod other;");
    write("one/mod.rs", "mod a; mod b;");
    write("other/mod.rs", "mod c; mod d;");
    write("one/a.rs", "use crate::other::c::Third;");
    write("one/b.rs", "pub struct Second;");
    write("other/c.rs", "pub struct Third;");
    write("other/d.rs", "use super::c::Third;");
    let read = || ImportGraph::read(folder.path());
    assert!(read().circles_of_folders().is_empty());
    write("other/d.rs", "use crate::one::b::Second;");
    assert!(read().circles().is_empty(), "no files are in a circle");
    assert_eq!(read().circles_of_folders(), [["one", "other"]]);
}
