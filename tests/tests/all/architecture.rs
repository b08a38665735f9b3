//! Holds the dependency rule: cli -> {applications} -> resample-core, and no application knows another.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

const CORE: &str = "resample-core";
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
        let only_core = BTreeSet::from([CORE.to_owned()]);
        assert_eq!(
            uses[*application], only_core,
            "{application} may know the core alone"
        );
    }
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
