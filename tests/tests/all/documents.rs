//! The pages: every link leads to a file and a heading that are there, and the book has every page of `docs/`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the workspace")
        .to_owned()
}

/// All pages of the project, without what is built.
fn pages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            if path.is_dir() {
                if !name.starts_with('.') && !["target", "demo"].contains(&name.as_str()) {
                    folders.push(path);
                }
            } else if name.ends_with(".md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The text of a page without its blocks of code.
fn prose(page: &Path) -> String {
    let text = fs::read_to_string(page).expect("a page");
    let parts = text.split("\n```");
    parts.step_by(2).collect::<Vec<_>>().join("\n")
}

/// Where the links of a page lead, as written.
fn links(page: &Path) -> Vec<String> {
    let text = prose(page);
    let after = text.split("](").skip(1);
    let found = after.filter_map(|rest| rest.split_once(')').map(|(link, _)| link.to_owned()));
    found
        .filter(|link| !link.contains("://") && !link.contains(char::is_whitespace))
        .collect()
}

/// The names that headings have in links.
fn anchors(page: &Path) -> BTreeSet<String> {
    let text = prose(page);
    let heads = text.lines().filter(|line| line.starts_with('#'));
    let plain = |head: &str| {
        let words = head.trim_start_matches('#').trim().to_lowercase();
        let kept = words
            .chars()
            .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    heads.map(plain).collect()
}

/// `a/b/../c` as `a/c`.
fn straight(path: &Path) -> PathBuf {
    let mut made = PathBuf::new();
    for part in path.components() {
        if part == Component::ParentDir {
            made.pop();
        } else {
            made.push(part);
        }
    }
    made
}

#[test]
fn every_link_leads_somewhere() {
    let docs = root().join("docs");
    let mut count = 0;
    for page in pages() {
        for link in links(&page) {
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => page.clone(),
                file => straight(&page.parent().expect("a folder").join(file)),
            };
            let page = page.display();
            assert!(target.exists(), "{page}: {link} leads nowhere");
            let is_heading = heading.is_empty() || anchors(&target).contains(heading);
            assert!(is_heading, "{page}: {link} names no heading");
            // The book holds `docs/` alone.
            let is_inside = !page.to_string().starts_with(&*docs.to_string_lossy())
                || target.starts_with(&docs);
            assert!(is_inside, "{page}: {link} leads out of the book");
            count += 1;
        }
    }
    assert!(count > 100, "only {count} links found");
}

#[test]
fn the_book_has_every_page() {
    let docs = root().join("docs");
    let listed: BTreeSet<PathBuf> = links(&docs.join("SUMMARY.md"))
        .iter()
        .map(|link| docs.join(link))
        .collect();
    let written = pages()
        .into_iter()
        .filter(|page| page.starts_with(&docs) && !page.ends_with("SUMMARY.md"));
    let missing: Vec<PathBuf> = written.filter(|page| !listed.contains(page)).collect();
    assert!(missing.is_empty(), "not in docs/SUMMARY.md: {missing:?}");
}
