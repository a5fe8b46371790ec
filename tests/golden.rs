//! Golden tables, written by `golden/reference.py`.

use std::collections::HashMap;

/// A golden CSV as columns of f64, by name.
///
/// # Panics
/// With file and line when the table is not what `golden/reference.py` writes.
pub fn golden(name: &str) -> HashMap<String, Vec<f64>> {
    let path = crate::root().join("tests/golden").join(name);
    let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let header = reader.headers().cloned().unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut columns: HashMap<String, Vec<f64>> = header.iter().map(|h| (h.to_owned(), Vec::new())).collect();
    for (line, row) in reader.records().enumerate() {
        let row = row.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for (cell, name) in row.iter().zip(&header) {
            let value = cell.parse().unwrap_or_else(|e| panic!("{}:{}: {name}: {e}", path.display(), line + 2));
            columns.entry(name.to_owned()).or_default().push(value);
        }
    }
    columns
}
