//! A self-contained HTML page: no script, no other file.

use std::fmt::Write as _;

/// A part of a page.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// The main result, in one sentence.
    Answer(String),
    /// A heading.
    Heading(String),
    /// A smaller heading.
    Subheading(String),
    /// A paragraph.
    Text(String),
    /// A table of numbers with titles in its first row and column. In a wide table, columns that
    /// are equal in all rows are stated once below it.
    Table(Vec<Vec<String>>),
    /// A table of words, with left-aligned columns.
    Words(Vec<Vec<String>>),
    /// A table whose rows are coloured by their verdict.
    Verdicts {
        /// Titles of the columns.
        titles: Vec<String>,
        /// Tone and cells of each row; as many cells as titles.
        rows: Vec<(Tone, Vec<String>)>,
    },
    /// A grid of pictures: column titles, then rows with a title and one picture address per
    /// column.
    Pictures {
        /// Titles of the columns.
        columns: Vec<String>,
        /// Title of each row and the addresses of its pictures.
        rows: Vec<(String, Vec<String>)>,
    },
    /// SVG documents, inserted as they are; a single one takes the width of the page.
    Curves(Vec<String>),
    /// Code as typed in a terminal or a file.
    Code(String),
    /// A collapsible section: its title and its content.
    Folded(String, Vec<Part>),
}

/// Colour of a table row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// No colour.
    Plain,
    /// As expected.
    Good,
    /// Not as expected.
    Bad,
    /// Not as expected, but a known limitation.
    Known,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Good => "good",
            Self::Bad => "bad",
            Self::Known => "known",
        }
    }
}

/// Number of columns from which on a table is wide.
const WIDE: usize = 9;

/// Nothing is wider than the window: text and code break where necessary, and curves shrink. Cells
/// break within a number only in narrow windows.
const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1300px;margin:2em auto;\
padding:0 1em;color:#222;overflow-wrap:anywhere}\
h1,h2{font-weight:600}h3{margin:1.4em 0 .3em;font-weight:600}\
.answer{font-size:1.25em;margin:.5em 0 1em}summary{cursor:pointer;font-weight:600;margin:.8em 0}\
table{border-collapse:collapse;max-width:100%;font-variant-numeric:tabular-nums}\
th,td{padding:.25em .8em;border-bottom:1px solid #ddd;text-align:right;vertical-align:top}\
th:first-child,td:first-child,.words td,.words th{text-align:left}\
th,td{overflow-wrap:break-word}@media(max-width:1100px){th,td{overflow-wrap:anywhere}}\
.wide{font-size:12px}.wide th,.wide td{padding:.2em .35em}\
.good td:last-child,.bad td:last-child,.known td:last-child{border-left:6px solid}\
.good td:last-child{border-left-color:#009e73}\
.bad td:last-child{border-left-color:#d55e00;font-weight:600}\
.known td:last-child{border-left-color:#e69f00}\
.pictures{display:grid;gap:.4em;align-items:center}.pictures img{width:100%;display:block}\
.curves{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(420px,100%),1fr));gap:1em}\
.curve{max-width:900px}svg{display:block;width:100%;height:auto}\
pre{background:#f4f4f4;padding:.8em;white-space:pre-wrap}";

/// Renders the page.
pub fn html(title: &str, parts: &[Part]) -> String {
    let title = escaped(title);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
    );
    write_parts(&mut out, parts);
    out + "</body>\n</html>\n"
}

fn write_parts(out: &mut String, parts: &[Part]) {
    for part in parts {
        // Writing to a String cannot fail.
        let _ = write_part(out, part);
    }
}

fn write_part(out: &mut String, part: &Part) -> std::fmt::Result {
    match part {
        Part::Answer(text) => writeln!(out, "<p class=\"answer\">{}</p>", escaped(text)),
        Part::Heading(text) => writeln!(out, "<h2>{}</h2>", escaped(text)),
        Part::Subheading(text) => writeln!(out, "<h3>{}</h3>", escaped(text)),
        Part::Text(text) => writeln!(out, "<p>{}</p>", escaped(text)),
        Part::Code(text) => writeln!(out, "<pre>{}</pre>", escaped(text)),
        Part::Curves(curves) => {
            let class = if curves.len() == 1 { "curve" } else { "curves" };
            writeln!(out, "<div class=\"{class}\">\n{}</div>", curves.concat())
        }
        Part::Folded(title, parts) => {
            writeln!(out, "<details>\n<summary>{}</summary>", escaped(title))?;
            write_parts(out, parts);
            writeln!(out, "</details>")
        }
        Part::Table(rows) => {
            let (told, rows) = told_once(rows);
            let plain = rows.iter().skip(1).map(|row| (Tone::Plain, row));
            let is_wide = rows[0].len() >= WIDE;
            write_table(out, if is_wide { "wide" } else { "" }, &rows[0], plain)?;
            match told.is_empty() {
                true => Ok(()),
                false => writeln!(out, "<p>In every row: {}.</p>", escaped(&told)),
            }
        }
        Part::Words(rows) => {
            let plain = rows.iter().skip(1).map(|row| (Tone::Plain, row));
            write_table(out, "words", &rows[0], plain)
        }
        Part::Verdicts { titles, rows } => {
            let rows = rows.iter().map(|(tone, row)| (*tone, row));
            write_table(out, "words", titles, rows)
        }
        Part::Pictures { columns, rows } => {
            writeln!(
                out,
                "<div class=\"pictures\" style=\"grid-template-columns:5em \
                 repeat({},minmax(0,1fr))\">",
                columns.len()
            )?;
            let titles = columns.iter().map(|c| format!("<b>{}</b>", escaped(c)));
            writeln!(out, "<span></span>{}", titles.collect::<String>())?;
            for (title, addresses) in rows {
                writeln!(out, "<span>{}</span>", escaped(title))?;
                for (column, address) in columns.iter().zip(addresses) {
                    let alt = escaped(&format!("{title}, {column}"));
                    writeln!(out, "<img alt=\"{alt}\" src=\"{}\">", escaped(address))?;
                }
            }
            writeln!(out, "</div>")
        }
    }
}

fn write_table<'a>(
    out: &mut String,
    class: &str,
    titles: &[String],
    rows: impl Iterator<Item = (Tone, &'a Vec<String>)>,
) -> std::fmt::Result {
    let cells = |tag: &str, cells: &[String]| {
        let cell = |text: &String| format!("<{tag}>{}</{tag}>", escaped(text));
        cells.iter().map(cell).collect::<String>()
    };
    // Column names may break between their words.
    let head = cells("th", titles).replace('_', "_<wbr>");
    writeln!(out, "<table class=\"{class}\">\n<tr>{head}</tr>")?;
    for (tone, row) in rows {
        let (class, row) = (tone.class(), cells("td", row));
        writeln!(out, "<tr class=\"{class}\">{row}</tr>")?;
    }
    writeln!(out, "</table>")
}

/// Removes from a wide table the columns, except the first, that are equal in all rows, and states
/// their values in a sentence.
fn told_once(rows: &[Vec<String>]) -> (String, Vec<Vec<String>>) {
    let [titles, body @ ..] = rows else {
        return (String::new(), vec![Vec::new()]);
    };
    let is_same = |k: usize| {
        let is_wide = titles.len() >= WIDE && body.len() > 1;
        is_wide && k > 0 && body.iter().all(|row| row[k] == body[0][k])
    };
    let (same, other): (Vec<usize>, Vec<usize>) = (0..titles.len()).partition(|&k| is_same(k));
    let told = same.iter().filter(|&&k| !body[0][k].is_empty());
    let told: Vec<_> = told
        .map(|&k| format!("{} {}", titles[k], body[0][k]))
        .collect();
    let kept = |row: &Vec<String>| other.iter().map(|&k| row[k].clone()).collect();
    (told.join(", "), rows.iter().map(kept).collect())
}

/// Escapes text for HTML and SVG, also inside quotes.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_stands_on_the_page_and_nothing_breaks_out() {
        let evil = "<script>\"&".to_owned();
        let parts = [
            Part::Heading(evil.clone()),
            Part::Subheading(evil.clone()),
            Part::Verdicts {
                titles: vec![evil.clone()],
                rows: vec![(Tone::Bad, vec![evil.clone()])],
            },
            Part::Text(evil.clone()),
            Part::Code(evil.clone()),
            Part::Answer(evil.clone()),
            Part::Table(vec![vec![evil.clone()], vec![evil.clone()]]),
            Part::Folded(evil.clone(), vec![Part::Text(evil.clone())]),
            Part::Pictures {
                columns: vec![evil.clone(), "b".into()],
                rows: vec![(evil.clone(), vec!["data:a".into(), "data:b".into()])],
            },
            Part::Curves(vec!["<svg></svg>".into()]),
        ];
        let page = html(&evil, &parts);
        assert!(!page.contains("<script>"));
        assert!(page.matches("&lt;script&gt;&quot;&amp;").count() >= 12);
        for piece in [
            "<th>",
            "<td>",
            "<summary>",
            "src=\"data:b\"",
            "<svg>",
            "<pre>",
        ] {
            assert!(page.contains(piece), "{piece}");
        }
        for address in ["http://", "https://", "src=\"/", "href="] {
            assert!(!page.contains(address), "{address}");
        }
    }
    #[test]
    fn a_wide_table_tells_once_what_is_the_same_in_all_rows() {
        let row = |first: &str, last: &str| {
            let cells = [first, "same", "", "3", "4", "5", "6", "7", last];
            cells.map(str::to_owned).to_vec()
        };
        let titles = ["a", "b", "c", "d", "e", "f", "g", "h", "last_one"];
        let rows = vec![
            titles.map(str::to_owned).to_vec(),
            row("x", "1"),
            row("x", "2"),
        ];
        let page = html("t", &[Part::Table(rows.clone())]);
        assert!(
            page.contains("<tr><th>a</th><th>last_<wbr>one</th></tr>"),
            "{page}"
        );
        assert!(page.contains("<td>x</td><td>2</td>"), "{page}");
        assert!(page.contains("In every row: b same, d 3, e 4"), "{page}");
        // Negative controls: a single row and a narrow table keep all columns.
        let narrow: Vec<Vec<String>> = rows.iter().map(|row| row[..3].to_vec()).collect();
        for rows in [rows[..2].to_vec(), narrow] {
            let page = html("t", &[Part::Table(rows)]);
            assert!(page.contains("<td>same</td>") && !page.contains("In every row"));
        }
    }
}
