//! Every row of docs/fault-table.md names a test that exists.

use system_tests::root;

#[test]
fn every_row_is_a_test() {
    let text = std::fs::read_to_string(root().join("docs/fault-table.md")).expect("the table");
    let rows: Vec<&str> = text.lines().filter(|l| l.starts_with("| ") && !l.starts_with("| fault |")).collect();
    assert!(rows.len() >= 30, "{} rows", rows.len());
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [_, _, _, _, test] = cells[..] else { panic!("five cells: {row}") };
        assert!(cells.iter().all(|cell| !cell.is_empty()), "{row}");
        let (file, name) = test.trim_matches('`').split_once(": ").unwrap_or_else(|| panic!("file and test: {row}"));
        let source = std::fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        let function = format!("fn {name}()");
        let at = source.find(&function).unwrap_or_else(|| panic!("{file} has no {name}"));
        let before = source[..at].trim_end();
        assert!(before.ends_with("#[test]"), "{name} of {file} is no test");
    }
}
