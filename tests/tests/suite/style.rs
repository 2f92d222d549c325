//! The style of the sources: openings of doc comments, names of constants, lengths.

use crate::sources::{self, Source};

/// First words of a summary that is a clause or hangs in the air. Others say what a thing is or
/// does: "Returns …", "The …", "Bakes …".
const CLAUSE_OPENERS: [&str; 14] = [
    "What", "How", "Where", "Why", "Whoever", "When", "Of", "By", "In", "From", "With", "Without",
    "Upon", "As",
];

/// The share of summaries that may open so: some sentences are best that way.
const MAX_CLAUSES: f64 = 0.03;

/// Lines of a file, and of a function.
const MAX_FILE: usize = 400;
const MAX_FUNCTION: usize = 60;

/// Functions that are tables of data.
const TABLES: [&str; 0] = [];

/// Returns the first words of all `///` blocks.
fn openers(source: &Source) -> Vec<&str> {
    let mut openers = Vec::new();
    let mut is_inside = false;
    for line in source.text.lines().map(str::trim_start) {
        let doc = line.strip_prefix("///");
        if let (Some(doc), false) = (doc, is_inside) {
            openers.extend(doc.split_whitespace().next());
        }
        is_inside = doc.is_some();
    }
    openers
}

#[test]
fn summaries_are_sentences_about_things() {
    let sources = sources::all();
    let (mut all, mut n_clauses, mut files) = (0, 0, Vec::new());
    for source in &sources {
        let openers = openers(source);
        all += openers.len();
        let is_clause = |word: &&&str| CLAUSE_OPENERS.contains(*word);
        let n = openers.iter().filter(is_clause).count();
        if n > 0 {
            n_clauses += n;
            files.push((n, source.path.display()));
        }
    }
    assert!(all > 2000, "{all} summaries");
    let share = n_clauses as f64 / all as f64;
    println!("{n_clauses} of {all} summaries open with a clause: {share:.3}");
    assert!(share <= MAX_CLAUSES, "{share}: {files:?}");
}

#[test]
fn bounds_are_called_max_and_min() {
    for source in sources::all() {
        for line in source.text.lines() {
            let name = line.split_once("const ").map_or("", |(_, name)| name);
            let dialect = ["MOST_", "FEW_", "LEAST_", "ENOUGH_"];
            let found = dialect.iter().any(|prefix| name.starts_with(prefix));
            assert!(!found, "{}: {line}", source.path.display());
        }
    }
}

/// Returns each function's name and number of lines. The code is formatted: a body ends with a
/// brace at the indentation of its `fn`.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut functions = Vec::new();
    for (start, line) in lines.iter().enumerate() {
        let code = line.trim_start();
        let Some(name) = function_name(code) else {
            continue;
        };
        // A method of a trait without a body has neither brace.
        let opens = lines[start..]
            .iter()
            .position(|line| line.ends_with(['{', '}', ';']));
        let signature = opens.map_or("", |idx| lines[start + idx]);
        if signature.ends_with('{') {
            let end = format!("{}}}", &line[..line.len() - code.len()]);
            let body = lines[start..].iter().position(|line| *line == end);
            functions.push((name, body.expect("the body ends") + 1));
        }
    }
    functions
}

/// The name of the function that a line begins.
fn function_name(code: &str) -> Option<&str> {
    let (before, rest) = code.split_once("fn ")?;
    let is_qualifier = |word: &str| {
        word.starts_with("pub") || ["const", "unsafe", "extern", "\"C\"", "async"].contains(&word)
    };
    let name = rest.split(['(', '<']).next()?;
    before.split_whitespace().all(is_qualifier).then_some(name)
}

#[test]
fn functions_are_found() {
    let text = "impl X {\n    pub(crate) fn a<T>(\n        x: T,\n    ) -> T {\n        x\n    }\n    \
                fn b();\n}\nfn c() {}\nunsafe fn d() {\n}\n";
    assert_eq!(functions(text), [("a", 5), ("d", 2)]);
}

#[test]
fn files_and_functions_are_small() {
    let mut large = Vec::new();
    for source in sources::all() {
        let path = source.path.display();
        let lines = source.text.lines().count();
        if lines > MAX_FILE {
            large.push(format!("{path}: {lines} lines"));
        }
        for (name, lines) in functions(&source.text) {
            if lines > MAX_FUNCTION && !TABLES.contains(&name) {
                large.push(format!("{path}: fn {name} has {lines} lines"));
            }
        }
    }
    assert!(large.is_empty(), "{}", large.join("\n"));
}
