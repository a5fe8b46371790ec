//! A report as one self-contained page: headings, plain words, tables, pictures. Reads on light and dark screens and
//! in print; needs nothing from the net.

use std::fmt::Write;

const STYLE: &str = "\
:root{color-scheme:light dark}\
body{font:16px/1.5 system-ui,'Segoe UI','DejaVu Sans',sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;background:#fff;color:#1b1f23}\
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em}svg{width:100%;height:auto;margin:.6em 0}\
table{border-collapse:collapse;margin:.6em 0}th,td{text-align:left;padding:.2em 1.2em .2em 0;border-bottom:1px solid #d8dee4;vertical-align:top}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}\
p.lead{font-size:1.1em}p.warn{border-left:4px solid #d55e00;padding-left:.8em}footer{margin-top:3em;font-size:.85em}\
.scroll{overflow-x:auto}\
@media screen and (prefers-color-scheme:dark){body{background:#0d1117;color:#e6edf3}th,td{border-color:#30363d}}\
@media print{body{margin:0;max-width:none}h2{break-after:avoid}svg,table{break-inside:avoid}}";

/// A page under construction.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    body: String,
}

impl Page {
    /// A page with its title.
    pub fn new(title: &str) -> Self {
        Page { title: title.to_owned(), body: String::new() }
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) -> &mut Self {
        self.put(format_args!("<h2>{}</h2>", escape(text)))
    }

    /// The answer in a sentence, above everything else.
    pub fn lead(&mut self, text: &str) -> &mut Self {
        self.put(format_args!("<p class=\"lead\">{}</p>", escape(text)))
    }

    /// Plain words.
    pub fn prose(&mut self, text: &str) -> &mut Self {
        self.put(format_args!("<p>{}</p>", escape(text)))
    }

    /// Words that must not be overlooked.
    pub fn warning(&mut self, text: &str) -> &mut Self {
        self.put(format_args!("<p class=\"warn\">{}</p>", escape(text)))
    }

    /// A list.
    pub fn list<T: AsRef<str>>(&mut self, items: impl IntoIterator<Item = T>) -> &mut Self {
        let items: String = items.into_iter().map(|item| format!("<li>{}</li>", escape(item.as_ref()))).collect();
        self.put(format_args!("<ul>{items}</ul>"))
    }

    /// A table. Cells that begin like a number are set to the right.
    pub fn table(&mut self, header: &[&str], rows: &[Vec<String>]) -> &mut Self {
        let is_number =
            |cell: &str| cell.trim_start_matches(['-', '+', '−', '±']).starts_with(|c: char| c.is_ascii_digit());
        let right: Vec<bool> = (0..header.len())
            .map(|c| {
                rows.iter().filter_map(|row| row.get(c)).any(|cell| is_number(cell))
                    && rows.iter().filter_map(|row| row.get(c)).all(|cell| is_number(cell) || cell.chars().count() < 3)
            })
            .collect();
        let class = |c: usize| if right.get(c) == Some(&true) { " class=\"n\"" } else { "" };
        let head: String =
            header.iter().enumerate().map(|(c, name)| format!("<th{}>{}</th>", class(c), escape(name))).collect();
        self.put(format_args!("<div class=\"scroll\"><table>\n<tr>{head}</tr>"));
        for row in rows {
            let cells: String =
                row.iter().enumerate().map(|(c, cell)| format!("<td{}>{}</td>", class(c), escape(cell))).collect();
            self.put(format_args!("<tr>{cells}</tr>"));
        }
        self.put(format_args!("</table></div>"))
    }

    /// A picture as made by [`chart`](super::chart).
    pub fn picture(&mut self, svg: &str) -> &mut Self {
        self.put(format_args!("{svg}"))
    }

    /// The whole page.
    pub fn finish(&self) -> String {
        let title = escape(&self.title);
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n\
             <body>\n<h1>{title}</h1>\n{}<footer>guideblock {}. A condition monitor, not a safety component.</footer>\n</body>\n</html>\n",
            self.body,
            env!("CARGO_PKG_VERSION")
        )
    }

    fn put(&mut self, element: std::fmt::Arguments<'_>) -> &mut Self {
        // writing into a String cannot fail
        let _ = writeln!(self.body, "{element}");
        self
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_numbers_stand_right() {
        let mut page = Page::new("a & b");
        page.lead("x < y")
            .table(&["name", "value"], &[vec!["<k>".into(), "-1.5".into()], vec!["l".into(), "2".into()]]);
        let html = page.finish();
        assert!(html.contains("<title>a &amp; b</title>") && html.contains("x &lt; y"));
        assert!(html.contains("<td>&lt;k&gt;</td><td class=\"n\">-1.5</td>"));
        assert!(!html.contains("http:") && !html.contains("https:"));
    }
}
