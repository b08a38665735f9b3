//! The imports between the files of a crate: takes the folder of its sources, returns the circles among files and among folders, and
//! their sizes.
//!
//! A file imports another if it names something that is defined there, by `use` or by a path in its code. A `pub use` hands
//! names on and imports nothing by itself; who uses the name imports the file that it leads to. `mod` lines, comments and
//! tests do not count. The scanner knows as much of the language as this workspace uses.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A module as its path below the crate: `["sheets", "frame"]`; the root is empty.
pub type Module = Vec<String>;

/// A crate's files.
#[derive(Debug, Default)]
pub struct ImportGraph {
    tokens: BTreeMap<Module, Vec<String>>,
}

impl ImportGraph {
    /// Reads every source file below a folder, test modules aside.
    pub fn read(folder: &Path) -> Self {
        let mut graph = Self::default();
        graph.read_folder(folder, &Module::new());
        graph
    }

    /// The number of files.
    pub fn file_count(&self) -> usize {
        self.tokens.len()
    }

    fn read_folder(&mut self, folder: &Path, module: &Module) {
        let entries = std::fs::read_dir(folder).expect("a folder of sources");
        for entry in entries {
            let path = entry.expect("an entry").path();
            let name = path.file_stem().expect("a name").to_string_lossy();
            if matches!(name.as_ref(), "tests" | "test_files") {
                continue;
            }
            let mut child = module.clone();
            if !matches!(name.as_ref(), "lib" | "main" | "mod") {
                child.push(name.into_owned());
            }
            if path.is_dir() {
                self.read_folder(&path, &child);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).expect("text");
                // A library and its program are one root.
                self.tokens.entry(child).or_default().extend(tokens(&text));
            }
        }
    }

    /// For each file, the files that it imports.
    pub fn imports(&self) -> BTreeMap<&Module, BTreeSet<&Module>> {
        self.tokens
            .iter()
            .map(|(module, tokens)| {
                let targets = paths(tokens, Exports::Leave)
                    .into_iter()
                    .filter_map(|path| self.target(module, &path, 0))
                    .filter(|target| *target != module)
                    .collect();
                (module, targets)
            })
            .collect()
    }

    /// The file in which a path that stands in `module` ends; `None` for paths that leave the crate.
    fn target(&self, module: &Module, path: &[String], depth: usize) -> Option<&Module> {
        let mut rest = path;
        let mut at = match path.first()?.as_str() {
            "crate" => {
                rest = &rest[1..];
                Module::new()
            }
            "self" | "super" => {
                let mut at = module.clone();
                while let Some("self" | "super") = rest.first().map(String::as_str) {
                    if rest[0] == "super" {
                        at.pop();
                    }
                    rest = &rest[1..];
                }
                at
            }
            first => {
                let child = [module.as_slice(), &[first.to_owned()]].concat();
                self.tokens.contains_key(&child).then_some(module.clone())?
            }
        };
        while let Some(next) = rest.first() {
            let child = [at.as_slice(), std::slice::from_ref(next)].concat();
            if !self.tokens.contains_key(&child) {
                break;
            }
            (at, rest) = (child, &rest[1..]);
        }
        let (found, tokens) = self.tokens.get_key_value(&at)?;
        // A name that the file hands on leads to where it is defined.
        let handed_on = rest.first().filter(|_| depth < 8).and_then(|name| {
            let exports = paths(tokens, Exports::Only);
            let export = exports.into_iter().find(|path| path.last() == Some(name))?;
            self.target(found, &export, depth + 1)
        });
        Some(handed_on.unwrap_or(found))
    }

    /// Groups of two files or more that import each other, directly or through others.
    pub fn circles(&self) -> Vec<Vec<String>> {
        circles_of(&self.imports())
    }

    /// Groups of siblings in one folder, each a file or a folder with all that it holds, that import each other.
    pub fn circles_of_folders(&self) -> Vec<Vec<String>> {
        let mut siblings: BTreeMap<&[String], BTreeMap<Module, BTreeSet<Module>>> = BTreeMap::new();
        for (module, targets) in self.imports() {
            for target in targets {
                let shared = module
                    .iter()
                    .zip(target)
                    .take_while(|(a, b)| a == b)
                    .count();
                // `mod.rs` counts as a sibling of the folder's other files.
                let sibling = |of: &Module| of[..of.len().min(shared + 1)].to_vec();
                let [from, to] = [sibling(module), sibling(target)];
                let graph = siblings.entry(&module[..shared]).or_default();
                graph.entry(to.clone()).or_default();
                graph.entry(from).or_default().insert(to);
            }
        }
        let graphs = siblings.values();
        let circles = graphs.flat_map(|graph| {
            let imports = graph.iter().map(|(from, to)| (from, to.iter().collect()));
            circles_of(&imports.collect())
        });
        circles.collect()
    }

    /// How many files and folders lie side by side in each folder; a file and the folder of its parts are one.
    pub fn siblings(&self) -> BTreeMap<String, usize> {
        let mut found: BTreeMap<String, BTreeSet<&String>> = BTreeMap::new();
        for module in self.tokens.keys() {
            for (depth, name) in module.iter().enumerate() {
                found
                    .entry(module[..depth].join("::"))
                    .or_default()
                    .insert(name);
            }
        }
        let counts = found
            .into_iter()
            .map(|(folder, names)| (folder, names.len()));
        counts.collect()
    }

    /// Files that import a file below folders of this name, and do not lie below one themselves.
    pub fn importers_of(&self, folder: &str) -> BTreeSet<String> {
        let inside = |module: &Module| module.iter().any(|name| name == folder);
        let imports = self.imports().into_iter();
        let importers = imports
            .filter(|(module, targets)| !inside(module) && targets.iter().any(|t| inside(t)));
        importers.map(|(module, _)| module.join("::")).collect()
    }
}

/// Groups of two or more that reach each other.
fn circles_of(imports: &BTreeMap<&Module, BTreeSet<&Module>>) -> Vec<Vec<String>> {
    let reached: BTreeMap<&Module, BTreeSet<&Module>> = imports
        .keys()
        .map(|module| (*module, reachable(imports, module)))
        .collect();
    let mut circles = BTreeSet::new();
    for (module, targets) in &reached {
        let circle: Vec<String> = targets
            .iter()
            .filter(|other| reached[*other].contains(module))
            .map(|other| other.join("::"))
            .collect();
        if circle.len() > 1 {
            circles.insert(circle);
        }
    }
    circles.into_iter().collect()
}

fn reachable<'a>(
    imports: &BTreeMap<&'a Module, BTreeSet<&'a Module>>,
    from: &Module,
) -> BTreeSet<&'a Module> {
    let mut seen = BTreeSet::new();
    let mut open: Vec<&Module> = imports[from].iter().copied().collect();
    while let Some(module) = open.pop() {
        if seen.insert(module) {
            open.extend(&imports[module]);
        }
    }
    seen
}

/// The kind of a file's paths.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Exports {
    /// Those of `pub use`.
    Only,
    /// All others.
    Leave,
}

/// Identifiers, `::` and single characters of a file, without comments, texts, and what follows the first test module.
fn tokens(text: &str) -> Vec<String> {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if first == '"' {
            text_length(rest)
        } else if rest.starts_with("::") {
            tokens.push("::".to_owned());
            2
        } else if first.is_alphanumeric() || first == '_' {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_');
            let end = end.unwrap_or(rest.len());
            tokens.push(rest[..end].to_owned());
            end
        } else {
            if !first.is_whitespace() {
                tokens.push(first.to_string());
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

/// Bytes of a text in quotation marks, both included.
fn text_length(rest: &str) -> usize {
    let mut escaped = false;
    for (place, c) in rest.char_indices().skip(1) {
        if c == '"' && !escaped {
            return place + 1;
        }
        escaped = c == '\\' && !escaped;
    }
    rest.len()
}

/// The paths that stand in a file: of `use`, with groups multiplied out, and in its code.
fn paths(tokens: &[String], exports: Exports) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if tokens[at] == "use" {
            let is_export = at > 0 && (tokens[at - 1] == "pub" || tokens[at - 1] == ")");
            let end = at + tokens[at..].iter().position(|t| t == ";").unwrap_or(1);
            if is_export == (exports == Exports::Only) {
                use_tree(&tokens[at + 1..end], &[], &mut found);
            }
            at = end;
        } else if exports == Exports::Leave && tokens.get(at + 1).is_some_and(|t| t == "::") {
            let mut path = vec![tokens[at].clone()];
            while tokens.get(at + 1).is_some_and(|t| t == "::") && at + 2 < tokens.len() {
                path.push(tokens[at + 2].clone());
                at += 2;
            }
            found.push(path);
        }
        at += 1;
    }
    found
}

/// Adds the paths of one tree: `a::{b, c::d as e}`, by the names that things have where they are defined.
fn use_tree(tokens: &[String], before: &[String], found: &mut Vec<Vec<String>>) {
    let mut path = before.to_vec();
    let mut at = 0;
    while at < tokens.len() {
        match tokens[at].as_str() {
            "::" => {}
            "{" => {
                let inside = &tokens[at + 1..tokens.len() - 1];
                for part in split_at_commas(inside) {
                    use_tree(part, &path, found);
                }
                return;
            }
            "as" => break,
            name => path.push(name.to_owned()),
        }
        at += 1;
    }
    if !path.is_empty() {
        found.push(path);
    }
}

fn split_at_commas(tokens: &[String]) -> Vec<&[String]> {
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (at, token) in tokens.iter().enumerate() {
        match token.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            "," if depth == 0 => {
                parts.push(&tokens[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&tokens[start..]);
    parts
}
