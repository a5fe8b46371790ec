//! Where the keys of a text of TOML stand, for messages about what a file says as a whole.

use toml::de::{DeTable, DeValue};

/// A key with a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// The key after those of the tables it stands in.
    pub path: Vec<String>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// The keys of a text in the order of the file; none where it is no TOML.
pub fn keys(text: &str) -> Vec<Key> {
    let Ok(table) = DeTable::parse(text) else { return Vec::new() };
    let mut found = Vec::new();
    collect(table.get_ref(), &[], &mut found);
    found.sort_by_key(|(offset, _)| *offset);
    let place = |(offset, path): (usize, Vec<String>)| {
        let before = text.get(..offset).unwrap_or(text);
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        Key { path, line: before.matches('\n').count() + 1, column }
    };
    found.into_iter().map(place).collect()
}

/// The first key at a path or in the table there, as `["seals", "coulomb_n"]`.
pub fn find(text: &str, path: &[&str]) -> Option<Key> {
    let is_there = |key: &Key| key.path.len() >= path.len() && key.path.iter().zip(path).all(|(a, b)| a == b);
    keys(text).into_iter().find(is_there)
}

fn collect(table: &DeTable<'_>, within: &[String], found: &mut Vec<(usize, Vec<String>)>) {
    for (key, value) in table {
        let path = [within, &[key.get_ref().to_string()]].concat();
        match value.get_ref() {
            DeValue::Table(inner) => collect(inner, &path, found),
            _ => found.push((key.span().start, path)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_where_they_stand() {
        let text = "# µm\nschema = \"x\"\nb.c = 1\n[t.u]\n  \"v w\" = 2\n";
        let at = |path: &[&str]| find(text, path).map(|key| (key.line, key.column));
        assert_eq!(at(&["b", "c"]), Some((3, 3)));
        assert_eq!((at(&["t"]), at(&["t", "u", "v w"]), at(&["u"])), (Some((5, 3)), Some((5, 3)), None));
        assert_eq!(keys("a = "), Vec::new());
    }
}
