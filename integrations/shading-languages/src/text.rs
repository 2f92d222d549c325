//! Generated text in blocks, and the comments of the WGSL for them.

use std::collections::HashMap;

/// A constant, type or function.
pub struct Block {
    pub name: String,
    pub text: String,
    pub is_function: bool,
    pub is_constant: bool,
}

/// Splits generated text into its outermost items.
pub fn blocks(text: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut current = String::new();
    for line in text.lines() {
        if current.is_empty() && line.trim().is_empty() {
            continue;
        }
        current += line;
        current += "\n";
        let is_end = line == "}" || line == "};";
        let is_one_line = !line.starts_with([' ', '}', '{']) && line.ends_with(';');
        if is_end || is_one_line {
            blocks.push(block(std::mem::take(&mut current)));
        }
    }
    blocks
}

fn block(text: String) -> Block {
    let first = text.lines().next().unwrap_or_default();
    let is_function = first.contains('(') && !first.ends_with(';');
    // The last word before the parameters, the value or the members.
    let end = first.find(['(', '=', '{', '[', ';']).unwrap_or(first.len());
    let name = first[..end].split_whitespace().next_back();
    Block {
        name: name.unwrap_or_default().to_owned(),
        is_constant: first.ends_with(';') && first.contains('='),
        is_function,
        text,
    }
}

/// The documentation of the WGSL's functions and types.
pub struct Docs<'a>(HashMap<&'a str, Vec<&'a str>>);

impl<'a> Docs<'a> {
    pub fn of(wgsl: &'a str) -> Self {
        let mut docs = HashMap::new();
        let mut lines = Vec::new();
        for line in wgsl.lines() {
            if let Some(doc) = line.strip_prefix("///") {
                lines.push(doc);
                continue;
            }
            let item = line.strip_prefix("fn ").or(line.strip_prefix("struct "));
            if let Some(item) = item {
                let end = item.find(['(', ' ', '{']).unwrap_or(item.len());
                docs.insert(&item[..end], std::mem::take(&mut lines));
            }
            lines.clear();
        }
        Self(docs)
    }

    /// Returns the documentation of an item as comments.
    pub fn comment(&self, name: &str) -> String {
        let lines = self.0.get(name).into_iter().flatten();
        lines.map(|line| format!("//{line}\n")).collect()
    }
}
