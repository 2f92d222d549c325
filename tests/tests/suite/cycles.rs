//! Which modules use which, by their `use` paths: no circles, but for those named here.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::sources::{self, Source};

/// Circles that are a single algorithm in several files, by their modules, each with its reason.
const ALLOWED: [(&[&str], &str); 0] = [];

/// A module's path within its crate; the crate's root is empty.
type Module = Vec<String>;

/// The modules of a crate and the names that each re-exports from one of its children.
struct Crate {
    modules: BTreeSet<Module>,
    exports: BTreeMap<(Module, String), Module>,
}

/// The module of a file below `src`.
fn module_of(path: &Path) -> Module {
    let mut parts: Module = path
        .with_extension("")
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if parts
        .last()
        .is_some_and(|last| ["mod", "lib", "main"].contains(&last.as_str()))
    {
        parts.pop();
    }
    parts
}

/// The paths that `use` declarations of a text name, groups in braces taken apart.
fn used_paths(text: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find("use ") {
        let before = rest[..start].rsplit('\n').next().unwrap_or("");
        let is_declaration = before.trim().is_empty() || before.trim_start().starts_with("pub");
        rest = &rest[start + 4..];
        if is_declaration && let Some(end) = rest.find(';') {
            expand(&mut Vec::new(), &rest[..end], &mut paths);
        }
    }
    paths
}

/// Adds the paths of `tree` behind `prefix`: `a::{b, c::d}` has two.
fn expand(prefix: &mut Vec<String>, tree: &str, paths: &mut Vec<Vec<String>>) {
    let tree = tree.trim();
    let Some(open) = tree.find('{') else {
        let own = tree.split(" as ").next().unwrap_or(tree);
        let own = own.split("::").map(|part| part.trim().to_owned());
        let path = prefix
            .iter()
            .cloned()
            .chain(own)
            .filter(|part| !part.is_empty());
        paths.push(path.collect());
        return;
    };
    let before = prefix.len();
    let parts = tree[..open]
        .split("::")
        .map(str::trim)
        .filter(|part| !part.is_empty());
    prefix.extend(parts.map(str::to_owned));
    let (mut depth, mut start) = (0, open + 1);
    for (idx, letter) in tree.char_indices().skip(open) {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 1 && letter == ',' || depth == 0 {
            expand(prefix, &tree[start..idx], paths);
            start = idx + 1;
        }
        if depth == 0 {
            break;
        }
    }
    prefix.truncate(before);
}

impl Crate {
    fn new(files: &[(Module, &Source)]) -> Self {
        let modules = files.iter().map(|(module, _)| module.clone()).collect();
        let mut exports = BTreeMap::new();
        for (module, source) in files {
            for path in used_paths(source.without_tests()) {
                // A private import of a child's item is seen by its siblings, too.
                let child: Module = module.iter().chain(path.first()).cloned().collect();
                if let (Some(name), true) = (path.last(), path.len() > 1) {
                    exports.insert((module.clone(), name.clone()), child);
                }
            }
        }
        Self { modules, exports }
    }

    /// The module that a path in `from` leads to, if it is one of this crate's.
    fn resolve(&self, from: &Module, path: &[String]) -> Option<Module> {
        let mut at = match path.first()?.as_str() {
            "crate" => Module::new(),
            "self" | "super" => from.clone(),
            child => {
                let module: Module = from.iter().cloned().chain([child.to_owned()]).collect();
                return self
                    .modules
                    .contains(&module)
                    .then_some(())
                    .and_then(|()| self.walk(module, &path[1..]));
            }
        };
        let mut rest = &path[1..];
        if path[0] == "super" {
            at.pop();
            while rest.first().is_some_and(|part| part == "super") {
                at.pop();
                rest = &rest[1..];
            }
        }
        self.walk(at, rest)
    }

    fn walk(&self, mut at: Module, path: &[String]) -> Option<Module> {
        for part in path {
            let child: Module = at.iter().cloned().chain([part.clone()]).collect();
            if self.modules.contains(&child) {
                at = child;
            } else {
                let exported = self.exports.get(&(at.clone(), part.clone()));
                return exported
                    .filter(|m| self.modules.contains(*m))
                    .cloned()
                    .or(Some(at));
            }
        }
        Some(at)
    }
}

/// Whether one module is in the other: a parent uses its children, and they what it shares.
fn is_family(a: &Module, b: &Module) -> bool {
    let shared = a.len().min(b.len());
    a[..shared] == b[..shared]
}

/// The modules that can be reached from each other, more than one at a time.
fn circles(uses: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<Vec<String>> {
    let reachable = |from: &Module| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(module) = open.pop() {
            for used in uses.get(module).into_iter().flatten() {
                if seen.insert(used) {
                    open.push(used);
                }
            }
        }
        seen
    };
    let reached: BTreeMap<_, _> = uses
        .keys()
        .map(|module| (module, reachable(module)))
        .collect();
    let mut circles = BTreeSet::new();
    for (module, all) in &reached {
        let circle = all
            .iter()
            .filter(|other| reached.get(**other).is_some_and(|r| r.contains(module)));
        let circle: Vec<String> = circle.map(|other| other.join("::")).collect();
        if circle.len() > 1 {
            circles.insert(circle);
        }
    }
    circles.into_iter().collect()
}

#[test]
fn use_declarations_are_taken_apart() {
    let text = "use a::{b, c::{d, e as f}};\npub(crate) use g;\n// no use at all;\n";
    let paths: Vec<String> = used_paths(text)
        .iter()
        .map(|path| path.join("::"))
        .collect();
    assert_eq!(paths, ["a::b", "a::c::d", "a::c::e", "g"]);
}

#[test]
fn circles_are_found() {
    let module = |name: &str| vec![name.to_owned()];
    let uses = [("a", "b"), ("b", "c"), ("c", "b"), ("d", "a")];
    let mut arrows: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (from, to) in uses {
        arrows.entry(module(from)).or_default().insert(module(to));
    }
    assert_eq!(circles(&arrows), [["b", "c"]]);
}

#[test]
fn modules_form_no_circles() {
    let mut found = Vec::new();
    let mut n_arrows = 0;
    for (name, folder) in sources::packages() {
        let src = folder.join("src");
        let files = sources::below(&src);
        let modules: Vec<_> = files
            .iter()
            .map(|source| {
                let mut parts = source.path.iter();
                parts
                    .by_ref()
                    .find(|part| *part == "src")
                    .expect("it lies below src");
                (module_of(parts.as_path()), source)
            })
            .collect();
        let of_crate = Crate::new(&modules);
        let mut uses: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
        for (module, source) in &modules {
            let paths = used_paths(source.without_tests());
            let used = paths
                .iter()
                .filter_map(|path| of_crate.resolve(module, path));
            let used = used.filter(|used| !is_family(module, used));
            uses.entry(module.clone()).or_default().extend(used);
        }
        n_arrows += uses.values().map(BTreeSet::len).sum::<usize>();
        found.extend(
            circles(&uses)
                .into_iter()
                .map(|circle| (name.clone(), circle)),
        );
    }
    assert!(n_arrows > 200, "{n_arrows} arrows");
    let is_allowed = |circle: &[String]| ALLOWED.iter().any(|(allowed, _)| circle == *allowed);
    found.retain(|(_, circle)| !is_allowed(circle));
    assert!(found.is_empty(), "{found:#?}");
}
