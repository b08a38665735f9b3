//! Plain English: doc comments begin with the field's noun or a verb, and neither comments nor messages use the patterns that
//! `docs/glossary.md` refuses.

use std::fs;
use std::path::{Path, PathBuf};

/// Words that no doc comment begins with: a relative clause in place of a noun, or of a verb.
const REFUSED_HEADS: [&str; 4] = ["What", "Whether", "Which", "Who"];

/// Phrases that no comment and no message has, each with its cure.
const REFUSED_PHRASES: [(&str, &str); 5] = [
    (
        "is told",
        "name the source: 'from the header', 'by the caller'",
    ),
    (
        "are told",
        "name the source: 'from the header', 'by the caller'",
    ),
    ("none is", "'no X', or a positive sentence"),
    ("but for", "'except'"),
    ("what it says", "name the content"),
];

/// All source files of the product, without their test modules.
fn sources() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the workspace");
    let crates = [
        "resample-core/src",
        "resample-core/io/src",
        "texmap/src",
        "texmap/mesh/src",
        "warp3d/src",
        "warp3d/cloud/src",
        "volsplat/src",
        "volsplat/volume/src",
        "cli/src",
        "python/src",
    ];
    let mut folders: Vec<PathBuf> = crates.iter().map(|name| root.join(name)).collect();
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.file_stem().is_some_and(|name| name == "tests") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The text of a comment's line, and whether it is a doc comment; `None` for lines of code.
fn comment(line: &str) -> Option<(&str, bool)> {
    let line = line.trim_start();
    let doc = line
        .strip_prefix("///")
        .or_else(|| line.strip_prefix("//!"));
    match doc {
        Some(text) => Some((text.trim_start(), true)),
        None => Some((line.strip_prefix("//")?.trim_start(), false)),
    }
}

/// The faults of one file, a line each.
fn faults(text: &str) -> Vec<(usize, String)> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    let mut found = Vec::new();
    let mut was_doc = false;
    for (number, line) in code.lines().enumerate() {
        let comment = comment(line);
        let (text, is_doc) = comment.unwrap_or((line, false));
        if is_doc && !was_doc {
            let first = text.split_whitespace().next().unwrap_or("");
            if REFUSED_HEADS.contains(&first) {
                found.push((number + 1, format!("begins with '{first}': {text}")));
            }
        }
        was_doc = is_doc;
        // Of code, only its texts count.
        if comment.is_none() && !line.contains('"') {
            continue;
        }
        let lower = text.to_lowercase();
        for (phrase, cure) in REFUSED_PHRASES {
            if lower.contains(phrase) {
                found.push((number + 1, format!("'{phrase}' ({cure}): {}", text.trim())));
            }
        }
    }
    found
}

#[test]
fn comments_help_and_errors_are_plain() {
    let files = sources();
    assert!(files.len() > 300, "only {} files were read", files.len());
    let mut faulty = Vec::new();
    for path in files {
        let text = fs::read_to_string(&path).expect("text");
        let found = faults(&text).into_iter();
        faulty.extend(found.map(|(line, what)| format!("{}:{line}: {what}", path.display())));
    }
    assert!(
        faulty.is_empty(),
        "{} faults:\n{}",
        faulty.len(),
        faulty.join("\n")
    );
}

#[test]
fn faults_are_found_where_they_stand() {
    let text = "/// What a row has.\n/// What follows a head may begin so.\nfn f() {\n    // None is left.\n    g(\"its size is told\");\n}\n";
    let lines: Vec<usize> = faults(text).into_iter().map(|(line, _)| line).collect();
    assert_eq!(lines, [1, 4, 5]);
    assert!(faults("/// Returns the row.\nfn f() { is_told() }\n").is_empty());
}
