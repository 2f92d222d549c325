//! Names of parameters and variables. naga numbers equal names of all functions, so that a new function would
//! rename the parameters of all behind it; here they are numbered within each function alone.

use std::collections::{HashMap, HashSet};

use crate::text::Block;

/// Returns the names that naga has given an underscore, because the language means something by them.
pub fn reserved(blocks: &[Block]) -> HashSet<String> {
    let words = blocks.iter().flat_map(|block| words(&block.text));
    let names = words.filter_map(|(_, word)| word.strip_suffix('_'));
    names.map(str::to_owned).collect()
}

/// Returns a function with its own numbers: the first of equal names has none.
pub fn without_numbers(function: &str, reserved: &HashSet<String>) -> String {
    let mut names: HashMap<&str, String> = HashMap::new();
    let mut counts: HashMap<&str, usize> = HashMap::new();
    let mut out = String::new();
    let mut done = 0;
    for (at, word) in words(function) {
        let is_member = function[..at].ends_with('.');
        let Some(base) = base(word, reserved).filter(|_| !is_member) else {
            continue;
        };
        let name = names.entry(word).or_insert_with(|| {
            let count = counts.entry(base).or_insert(0);
            *count += 1;
            match *count {
                // Results of expressions always have a number.
                n if base == "_e" => format!("_e{n}"),
                1 if reserved.contains(base) => format!("{base}_"),
                1 => base.to_owned(),
                n => format!("{base}_{}", n - 1),
            }
        });
        out += &function[done..at];
        out += name;
        done = at + word.len();
    }
    out + &function[done..]
}

/// Returns a variable's name without the number or underscore that naga gave it; `None` for what is not a
/// variable or may not be renamed.
fn base<'a>(word: &'a str, reserved: &HashSet<String>) -> Option<&'a str> {
    if let Some(number) = word.strip_prefix("_e") {
        let is_number = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
        return is_number.then_some("_e");
    }
    let is_variable = word.starts_with(|c: char| c.is_ascii_lowercase());
    if !is_variable || word.starts_with("aogrid_") {
        return None;
    }
    if let Some(base) = word.strip_suffix('_') {
        return Some(base);
    }
    match word.rsplit_once('_') {
        Some((base, number)) if number.bytes().all(|b| b.is_ascii_digit()) => Some(base),
        // A reserved word without its underscore is the language's own.
        _ => Some(word).filter(|word| !reserved.contains(*word)),
    }
}

/// Returns the words of a text with their places.
fn words(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + text[at..].find(is_word)?;
        let rest = &text[start..];
        let end = start + rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        at = end;
        Some((start, &text[start..end]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_anew_in_each_function() {
        let reserved = HashSet::from(["distance".to_owned()]);
        let text = "float f(float a_7, float distance_3) {\n    float _e20 = g(a_7.x_1, a_9);\n    \
                    return distance(_e20, distance_3) + a_9;\n}\n";
        let expected = "float f(float a, float distance_) {\n    float _e1 = g(a.x_1, a_1);\n    \
                        return distance(_e1, distance_) + a_1;\n}\n";
        assert_eq!(without_numbers(text, &reserved), expected);
    }
}
