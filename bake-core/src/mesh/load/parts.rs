//! The names of parts.

use std::collections::{HashMap, HashSet};

use crate::mesh::Part;

/// Makes the names different: the second part of one name becomes `name~2`, and so on.
pub(super) fn unique_names(parts: &mut [Part]) {
    let mut taken: HashSet<String> = parts.iter().map(|part| part.name.clone()).collect();
    // The last number of each name, so that thousands of equal names do not take quadratic time.
    let mut last: HashMap<String, usize> = HashMap::new();
    for part in parts {
        let Some(number) = last.get_mut(&part.name) else {
            last.insert(part.name.clone(), 1);
            continue;
        };
        loop {
            *number += 1;
            let name = format!("{}~{number}", part.name);
            if taken.insert(name.clone()) {
                part.name = name;
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_names_are_numbered() {
        let part = |name: &str| Part {
            name: name.into(),
            triangles: 0..0,
        };
        let mut parts = ["a", "a", "a~2", "b", "a", "a~2"].map(part);
        unique_names(&mut parts);
        let names: Vec<_> = parts.iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names, ["a", "a~3", "a~2", "b", "a~4", "a~2~2"]);
    }
}
