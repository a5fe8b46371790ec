use simulation::run::Break;

use super::*;

const HEADER: &str = "time_s,position_m,drag_force_n,preload_n,temperature_block_degc\n";

/// 300 rows at 100 Hz, the row with an index of `changed` replaced.
fn rows(changed: &[(usize, &str)]) -> String {
    let mut text = HEADER.to_owned();
    for n in 0..300 {
        match changed.iter().find(|(row, _)| *row == n) {
            Some((_, line)) => text += line,
            None => text += &format!("{:.2},{:.4},{:.1},3000,24", n as f64 / 100.0, n as f64 * 1e-4, n as f64 / 10.0),
        }
        text.push('\n');
    }
    text
}

fn messages(text: &str) -> (Run, Losses, Vec<String>) {
    let (run, losses) = read("a.csv", text.as_bytes()).expect("usable");
    let messages = losses.problems.iter().map(ToString::to_string).collect();
    assert_eq!(losses.rejected.values().sum::<u64>(), losses.lost);
    assert_eq!(losses.rows - losses.lost, run.len() as u64);
    let covered: Vec<_> = run.parts.iter().flat_map(|part| part.rows.clone()).collect();
    assert_eq!(covered, (0..run.len()).collect::<Vec<_>>(), "parts cover every row once");
    for part in &run.parts {
        assert!(run.time_s[part.rows.clone()].windows(2).all(|w| w[0] < w[1]), "time rises within {part:?}");
    }
    (run, losses, messages)
}

fn refused(text: &str) -> String {
    read("a.csv", text.as_bytes()).expect_err("unusable").to_string()
}

fn breaks(run: &Run) -> Vec<(usize, Break)> {
    run.parts.iter().map(|part| (part.rows.start, part.starts)).collect()
}

#[test]
fn a_sound_file_is_one_part() {
    let (run, losses, messages) = messages(&rows(&[]));
    assert_eq!(messages, Vec::<String>::new());
    assert_eq!(losses, Losses { rows: 300, ..Losses::default() });
    assert_eq!(run.parts, [Part { rows: 0..300, segment: None, starts: Break::Start }]);
    assert_eq!((run.time_s[2], run.drag_force_n[2]), (0.02, 0.2));
    assert_eq!(run.position_m.expect("there")[2], 2e-4);
    assert_eq!(run.preload_n, Some(vec![3000.0; 300]));
    assert_eq!(run.temperature_block_degc, Some(vec![24.0; 300]));
    assert_eq!((run.velocity_m_s, run.external_load_n), (None, None));
}

#[test]
fn spoilt_cells_cost_their_row_and_are_named() {
    for (line, message) in [
        (
            "0.10,0.0010,1.x,3000,24",
            "line 12: column drag_force_n: \"1.x\" is not a number (decimal mark is the point); the row is left out",
        ),
        ("0.10,0.0010,inf,3000,24", "line 12: column drag_force_n: \"inf\" is not finite; the row is left out"),
        ("0.10,0.0010,1e999,3000,24", "line 12: column drag_force_n: \"1e999\" is not finite; the row is left out"),
        ("nan,0.0010,1,3000,24", "line 12: column time_s: \"nan\" is not finite; the row is left out"),
        (
            "-1e308,0.0010,1,3000,24",
            "line 12: column time_s: \"-1e308\" is larger than anything that is measured, in any unit; the row is left out",
        ),
        (
            "0.10,0.0010,,3000,24",
            "line 12: column drag_force_n: not measured here, but every row needs it; the row is left out",
        ),
        (
            "0.10,,1.0,3000,24",
            "line 12: column position_m: not measured here, but every row needs it; the row is left out",
        ),
        ("0.10,0.0010", "line 12: 2 cells instead of 5; the row is left out"),
        (
            "0,10,0,0010,1,0,3000,24",
            "line 12: 8 cells instead of 5 (a decimal comma? then separate the columns with `;`); the row is left out",
        ),
        ("0.09,0.0010,1.0,3000,24", "line 12: column time_s: time 0.09 s again; the row is left out"),
        (
            "0.03,0.0010,1.0,3000,24",
            "line 12: column time_s: time 0.03 s stands between 0.09 s and 0.11 s; the row is left out",
        ),
        (
            "7.5,0.0010,1.0,3000,24",
            "line 12: column time_s: time 7.5 s stands between 0.09 s and 0.11 s; the row is left out",
        ),
        (
            "\0\0\0\0\0",
            "line 12: zero bytes instead of a number: the recorder lost power while writing; the row is left out",
        ),
        (
            "0.1\0,0.001,1,1,1",
            "line 12: column time_s: zero bytes instead of a number: the recorder lost power while writing; \
             the row is left out",
        ),
        ("0.10,\"0.0010,1.0,3000,24", "line 12: 2 cells instead of 5; the row is left out"),
    ] {
        let (run, losses, got) = messages(&rows(&[(10, line)]));
        assert_eq!(got[0], message);
        // the row left out leaves a gap
        assert_eq!(got.len(), 2, "{got:?}");
        assert!(got[1].ends_with("what follows is a part of its own"));
        assert_eq!((losses.lost, losses.gaps, run.len()), (1, 1, 299));
        assert_eq!(breaks(&run), [(0, Break::Start), (10, Break::Gap)]);
    }
}

#[test]
fn what_is_not_needed_costs_only_its_cell() {
    let (run, losses, got) = messages(&rows(&[
        (10, "0.10,0.0010,1.0,,"),
        (11, "0.11,0.0011,1.1,nan,24"),
        (12, "0.12,0.0012,1.2,3000,warm"),
        (13, "0.13,\"0.0013\", 1.3 ,3000,24,,"),
    ]));
    assert_eq!(
        got,
        [
            "line 13: column preload_n: \"nan\" is not finite; it counts as not measured",
            "line 14: column temperature_block_degc: \"warm\" is not a number (decimal mark is the point); \
             it counts as not measured"
        ]
    );
    assert_eq!((losses.lost, run.len(), run.parts.len()), (0, 300, 1));
    let preload = run.preload_n.expect("there");
    let temperature = run.temperature_block_degc.expect("there");
    assert!(preload[10].is_nan() && preload[11].is_nan() && preload[12] == 3000.0);
    assert!(temperature[10].is_nan() && temperature[11] == 24.0 && temperature[12].is_nan());
    assert_eq!((run.position_m.expect("there")[13], run.drag_force_n[13]), (0.0013, 1.3));
}

#[test]
fn line_ends_marks_blanks_and_comments_change_nothing() {
    let plain = messages(&rows(&[]));
    for text in [
        rows(&[]).replace('\n', "\r\n"),
        format!("\u{feff}{}", rows(&[])),
        rows(&[]).replace(',', " , "),
        format!("# made by hand\n\n{}\n\n", rows(&[]).trim_end()).replace("\n1.00,", "\n# a break\n\n1.00,"),
        rows(&[]).trim_end().to_owned(),
        // whatever stands in a column that nobody asked for
        rows(&[]).replace(",24\n", ",24,Stra\u{df}e;\"\n").replace("degc\n", "degc,note\n"),
        rows(&[]).replace(",24\n", ",24,\"a, b\"\n").replace("degc\n", "degc,note\n"),
    ] {
        assert_eq!(messages(&text), plain, "{}", &text[..200]);
    }
    let mut latin = rows(&[]).replace(",24\n", ",24,#\n").replace("degc\n", "degc,note\n").into_bytes();
    latin.iter_mut().filter(|byte| **byte == b'#').for_each(|byte| *byte = 0xdf);
    assert_eq!(read("a.csv", &*latin).expect("usable").0, plain.0);
    let mut latin = rows(&[(10, "0.10,0.0010,1.0#,3000,24")]).into_bytes();
    latin.iter_mut().filter(|byte| **byte == b'#').for_each(|byte| *byte = 0xb0);
    assert_eq!(
        read("a.csv", &*latin).expect("usable").1.problems[0].to_string(),
        "line 12: column drag_force_n: \"1.0\u{fffd}\" is not a number (decimal mark is the point); the row is left out"
    );
}

#[test]
fn other_separators_and_decimal_commas_are_read_and_said() {
    let (plain, _, _) = messages(&rows(&[]));
    for (text, message) in [
        (
            rows(&[]).replace(',', ";").replace('.', ","),
            "line 1: columns are separated by ';' and the decimal mark is ',': read like that",
        ),
        (
            rows(&[]).replace(',', ";"),
            "line 1: columns are separated by ';' and the decimal mark is '.': read like that",
        ),
        (
            rows(&[]).replace(',', "\t").replace('.', ","),
            "line 1: columns are separated by '\\t' and the decimal mark is ',': read like that",
        ),
    ] {
        let (run, losses, got) = messages(&text);
        assert_eq!(got, [message]);
        assert_eq!((run, losses.lost), (plain.clone(), 0));
    }
    let (_, _, got) = messages(&rows(&[(10, "0.10,0.001,1.x,3000,24")]).replace(',', ";").replace('.', ","));
    assert_eq!(
        got[1],
        "line 12: column drag_force_n: \"1,x\" is not a number (decimal mark is the point); the row is left out"
    );
}

#[test]
fn a_recorder_that_was_cut_off_loses_its_last_row() {
    let text = rows(&[]);
    for (cut, message) in [
        (",24\n", Some("line 301: the file ends after 4 of 5 cells: the recorder was cut off; the row is left out")),
        (
            "4\n",
            Some(
                "line 301: column temperature_block_degc: the file ends within \"2\", which is shorter than the cell \
                 above and has no line end: the recorder was cut off; the row is left out",
            ),
        ),
        ("\n", None),
        ("", None),
    ] {
        let (run, _, got) = messages(text.strip_suffix(cut).expect("that end"));
        assert_eq!(got.first().map(|m| &**m), message);
        assert_eq!(run.len(), 300 - usize::from(message.is_some()));
    }
}

#[test]
fn gaps_and_clock_jumps_start_parts() {
    let (run, losses, got) = messages(&rows(&[
        (100, "1.02,0.01,1.0,,"),
        (101, "1.03,0.01,1.0,,"),
        (102, "1.04,0.01,1.0,,"),
        (103, "1.05,0.01,1.0,,"),
    ]));
    assert_eq!(
        got,
        [
            "line 102: column time_s: 2 rows missing: 0.03 s since the last one, steps are 0.01 s; what follows is a part of its \
             own",
            "line 106: column time_s: clock jumps back from 1.05 s to 1.04 s; what follows is a part of its own"
        ]
    );
    assert_eq!((losses.lost, losses.gaps), (0, 1));
    assert_eq!(breaks(&run), [(0, Break::Start), (100, Break::Gap), (104, Break::ClockJump)]);
    assert_eq!(run.longest_part(), 104..300);
    // rows of a second jump are lost until time goes on
    let twice = rows(&[]) + &rows(&[]).replace(HEADER, "") + &rows(&[]).replace(HEADER, "") + "2.995,1,1,1,1\n";
    let (run, losses, got) = messages(&twice);
    assert_eq!(
        got[1],
        "line 602: column time_s: time 0 s lies before 2.99 s and the clock jumped back before (several runs in one \
         file? give each a number in a column segment); the row is left out"
    );
    // at the same time as the last one of the second
    assert_eq!((losses.lost, losses.rejected["time-backward"], losses.rejected["time-repeated"]), (300, 299, 1));
    assert_eq!(breaks(&run), [(0, Break::Start), (300, Break::ClockJump)]);
    assert_eq!(losses.found, 301);
    assert_eq!(losses.problems.len(), Losses::KEPT);
    assert_eq!(
        losses.describe("a.csv")[5..],
        ["a.csv: 296 more problems of these kinds", "a.csv: 300 of 901 rows lost"]
    );
}

#[test]
fn a_new_segment_is_a_part_without_a_word() {
    let mut text = "segment,drag_force_n,velocity_m_s,time_s\n".to_owned();
    for n in 0..300 {
        let segment = n / 100;
        // warmed up, then the clock was set to zero
        let start_s = [0.0, 60.0, 0.0][segment as usize];
        text += &format!("{segment},{n},0.1,{}\n", f64::from(n % 100) / 100.0 + start_s);
    }
    let (run, _, got) = messages(&text);
    assert_eq!(got, Vec::<String>::new());
    assert_eq!(breaks(&run), [(0, Break::Start), (100, Break::Segment), (200, Break::Segment)]);
    assert_eq!(run.parts[2].segment, Some(2));
    // every segment may have a rate of its own
    let slower: String = (0..300).map(|n| format!("{},{n},0.1,{}\n", n / 250, n * (1 + 9 * (n / 250)))).collect();
    let (run, losses, got) = messages(&format!("segment,drag_force_n,velocity_m_s,time_s\n{slower}"));
    assert_eq!((losses.gaps, got), (0, Vec::new()));
    assert_eq!(breaks(&run), [(0, Break::Start), (250, Break::Segment)]);
    let (_, _, got) = messages(&text.replace("\n1,150,", "\n1.5,150,"));
    assert_eq!(got[0], "line 152: column segment: \"1.5\" is not a whole number; the row is left out");
}

/// Rows with a cell more, in a column `name`.
fn with_column(name: &str, cell: &dyn Fn(usize) -> &'static str) -> String {
    let mut text = format!("time_s,position_m,velocity_m_s,drag_force_n,{name}\n");
    for n in 0..300 {
        text += &format!("{},{},0.1,{n},{}\n", n as f64 / 100.0, n as f64 / 1000.0, cell(n));
    }
    text
}

#[test]
fn a_column_that_is_spelt_otherwise_and_a_clock_that_falls_are_told() {
    let why = refused("TIME_S,position_m,drag_force_n\n0,0,1\n");
    assert!(why.ends_with("; did you mean TIME_S? --column time_s=TIME_S"), "{why}");
    let falling: String = (0..300).map(|n| format!("{},0.1,{n}\n", f64::from(300 - n) / 100.0)).collect();
    assert_eq!(
        refused(&format!("time_s,velocity_m_s,drag_force_n\n{falling}")),
        "a.csv: column time_s: time runs backwards in 299 of 300 rows: sort the file by time"
    );
}

#[test]
fn a_unit_that_cannot_be_meant_has_its_option() {
    let rows: String = (0..300).map(|n| format!("{},{},{n}\n", f64::from(n) / 100.0, f64::from(n) * 1.5)).collect();
    let why = refused(&format!("time_s,position_m,drag_force_n\n{rows}"));
    let options = "If mm: --column position_m=position_m:0.001; if min: --column time_s=time_s:60";
    assert!(why.ends_with(&format!("position in mm, or time in min? {options}")), "{why}");
    let mapping = ["position_m=x:2".parse().expect("sound")];
    let bytes = format!("time_s,x,drag_force_n\n{rows}").into_bytes();
    let why = from_bytes("a.csv", bytes, &mapping, &[], &silent).expect_err("units").to_string();
    assert!(why.contains("If mm: --column position_m=COLUMN:0.001;"), "{why}");
}

#[test]
fn names_of_parts_are_parts() {
    let text = with_column("segment", &|n| ["up", "down", "up"][n / 100]);
    let (run, losses, got) = messages(&text);
    assert_eq!(breaks(&run), [(0, Break::Start), (100, Break::Segment), (200, Break::Segment)]);
    assert_eq!(run.parts.iter().map(|part| part.segment).collect::<Vec<_>>(), [Some(1), Some(2), Some(1)]);
    let told = "column segment: names of parts instead of numbers, read like that: up is 1, down is 2";
    assert_eq!((losses.lost, got), (0, vec![format!("line 2: {told}")]));
    // and in the other kind of file
    let numbers: Vec<f64> = (0..300).map(f64::from).collect();
    let names: Vec<String> = (0..300).map(|n| ["up", "down", "up"][n / 100].to_owned()).collect();
    let texts = |name| super::super::Column { name, cells: super::super::Cells::Texts(&names) };
    let [time, force, place] =
        ["time_s", "drag_force_n", "position_m"].map(|name| super::super::Column::numbers(name, &numbers));
    let mut bytes = Vec::new();
    let columns = [time, force, place, texts("segment"), texts("preload_n")];
    super::super::parquet::write(&mut bytes, &columns).expect("memory");
    let (parquet, losses) = read("a.parquet", &*bytes).expect("usable");
    assert_eq!(breaks(&parquet), breaks(&run));
    let got: Vec<_> = losses.problems.iter().map(ToString::to_string).collect();
    let left_out = "row 1: column preload_n: text instead of numbers in every row; the column is left out";
    assert_eq!(got, [format!("row 1: {told}"), left_out.to_owned()]);
}

#[test]
fn an_optional_column_of_no_use_costs_itself_alone() {
    let (run, losses, got) = messages(&with_column("preload_n", &|_| "off"));
    assert_eq!((run.preload_n, losses.found), (None, 1));
    assert_eq!(got, ["line 2: column preload_n: \"off\" instead of numbers in every row; the column is left out"]);
    let (run, _, got) = messages(&with_column("velocity_m_s", &|_| "n/a").replace("velocity_m_s,drag", "other,drag"));
    assert_eq!((run.velocity_m_s, run.parts.len()), (None, 1));
    assert_eq!(got, ["line 2: column velocity_m_s: \"n/a\" instead of numbers in every row; the column is left out"]);
    let text = with_column("segment", &|_| "x");
    let stamps: String =
        text.lines().enumerate().map(|(n, line)| line.replace(",x", &format!(",at{n}")) + "\n").collect();
    let (run, _, got) = messages(&stamps);
    assert_eq!(run.parts.len(), 1);
    let why = "more than 15 different texts in 300 rows are no parts of a test; the column is left out";
    assert_eq!(got, [format!("line 2: column segment: {why}")]);
}

#[test]
fn a_column_of_motion_is_complete_or_not_there() {
    let file = |position: fn(usize) -> bool, velocity: fn(usize) -> bool| {
        let mut text = "time_s,position_m,velocity_m_s,drag_force_n\n".to_owned();
        for n in 0..300 {
            let x = if position(n) { format!("{}", n as f64 / 1000.0) } else { String::new() };
            let v = if velocity(n) { "0.1" } else { "" };
            text += &format!("{},{x},{v},{n}\n", n as f64 / 100.0);
        }
        text
    };
    let (run, _, got) = messages(&file(|_| true, |n| n % 10 == 0));
    assert_eq!(
        got,
        ["line 3: column velocity_m_s: not measured in 270 rows; the column is left out, position_m is there"]
    );
    assert_eq!((run.len(), run.velocity_m_s), (300, None));
    let (run, losses, got) = messages(&file(|_| true, |n| n != 7));
    assert_eq!(got[0], "line 9: column velocity_m_s: not measured here, but every row needs it; the row is left out");
    assert_eq!((run.len(), losses.gaps), (299, 1));
    assert_eq!(run.velocity_m_s, Some(vec![0.1; 299]));
}

#[test]
fn what_cannot_be_used_is_refused() {
    for (text, message) in [
        ("", "a.csv: the file is empty"),
        ("\u{feff}\n\n", "a.csv: the file is empty"),
        (HEADER, "a.csv: 0 usable rows of 0 rows, at least 200 are needed"),
        (
            "time_s,drag_force_n\n0,1\n",
            "a.csv: line 1: no column position_m or velocity_m_s; the header row has: time_s, drag_force_n; \
             --column position_m=COLUMN:SCALE reads it from another one",
        ),
        (
            "time_s,position_m,force\n",
            "a.csv: line 1: no column drag_force_n; the header row has: time_s, position_m, force; \
             --column drag_force_n=COLUMN:SCALE reads it from another one",
        ),
        (
            "time_s,position_m,position_m,drag_force_n\n",
            "a.csv: line 1: column position_m is there twice (columns 2 and 3); name the one that is not meant \
             differently",
        ),
        (
            "0.0,0.0,1.0\n0.1,0.0,1.0\n",
            "a.csv: line 1: numbers where the names of the columns should stand; put a line above it, as \
             `time_s,position_m,drag_force_n`",
        ),
        (
            "PK\u{3}\u{4}...",
            "a.csv: this is a spreadsheet or zip archive, not a recording; save the sheet as CSV, or unpack the archive",
        ),
        (
            "\0\0\0\u{1}",
            "a.csv: this is no text (zero bytes where the header row should stand), not a recording; save the \
             recording as CSV or Parquet",
        ),
        (
            "time_s,drag_force_n\r0,1\r",
            "a.csv: this is text with bare carriage returns as line ends, not a recording; save it with line feeds",
        ),
        (
            "# schema: guideblock.raw/1\ntick,sample\n",
            "a.csv: this is a raw recording of a block, not a recording; `guideblock replay` sends it through the \
             block's pipeline",
        ),
    ] {
        assert_eq!(refused(text), message);
    }
    assert_eq!(
        refused(&format!("{HEADER}0,0,1,,\n0.1,0,x,,\n")),
        "a.csv: 1 usable rows of 2 rows, at least 200 are needed; first problem: line 3: column drag_force_n: \
         \"x\" is not a number (decimal mark is the point); the row is left out"
    );
    let flat: String = (0..250).map(|n| format!("{n},0,7.5,,\n")).collect();
    assert_eq!(
        refused(&format!("{HEADER}{flat}")),
        "a.csv: column drag_force_n is 7.5 N in every row: sensor not connected, or the wrong column"
    );
    let utf16: Vec<u8> = [0xff, 0xfe].into_iter().chain(HEADER.bytes().flat_map(|byte| [byte, 0])).collect();
    assert_eq!(
        read("a.csv", &*utf16).expect_err("unusable").to_string(),
        "a.csv: this is UTF-16 text, not a recording; save it as UTF-8"
    );
}

#[test]
fn mappings_and_selections_read_foreign_tables() {
    let mut text = "t,x_mm,T_k,gtau,drive,kind\n".to_owned();
    for n in 0..600 {
        text += &format!("{},{},{},{},{}.0,{}\n", n / 2, n / 2, 300, n, n % 2 + 1, ["a", "b"][n % 2]);
    }
    let mappings: Vec<Mapping> =
        ["time_s=t:0.01", "position_m=x_mm:0.001", "temperature_block_degc=T_k:1:-273.15", "drag_force_n=gtau:-2"]
            .map(|text| text.parse().expect("sound"))
            .to_vec();
    let with = |mappings: &[Mapping], selections: &[&str]| {
        let selections: Vec<Selection> = selections.iter().map(|text| text.parse().expect("sound")).collect();
        from_bytes("a.csv", text.clone().into_bytes(), mappings, &selections, &silent)
    };
    for selection in [&["drive=2"][..], &["kind=b"], &["drive=2", "kind=b"]] {
        let (run, losses) = with(&mappings, selection).expect("usable");
        assert_eq!(losses, Losses { rows: 300, ..Losses::default() });
        assert_eq!((run.len(), run.time_s[100], run.drag_force_n[1]), (300, 1.0, -6.0));
        assert_eq!(run.position_m.expect("there")[299], 0.299);
        assert_eq!(run.temperature_block_degc.expect("there")[0], 300.0 - 273.15);
    }
    let error = |mappings: &[&str], selections: &[&str]| {
        let all: Vec<Mapping> = mappings.iter().map(|text| text.parse().expect("sound")).collect();
        with(&all, selections).expect_err("refused").to_string()
    };
    assert_eq!(
        with(&mappings, &["drive=3", "kind=a"]).expect_err("refused").to_string(),
        "a.csv: no row has drive = 3 and kind = a; column drive has: 1.0, 2.0; column kind has: a, b"
    );
    assert_eq!(
        with(&mappings, &["axis=1"]).expect_err("refused").to_string(),
        "a.csv: line 1: no column axis; the header row has: t, x_mm, T_k, gtau, drive, kind (asked for by --where axis=1)"
    );
    assert_eq!(
        error(&["time_s=time:0.01"], &[]),
        "a.csv: line 1: no column time; the header row has: t, x_mm, T_k, gtau, drive, kind (asked for by --column \
         time_s=time:...)"
    );
    assert!(
        error(&["drag=gtau:2"], &[])
            .starts_with("--column drag=...: nothing reads a column drag; there are: time_s, drag_force_n, position_m")
    );
    assert_eq!(error(&["time_s=t", "time_s=t:2"], &[]), "--column time_s=... is given twice");
}
