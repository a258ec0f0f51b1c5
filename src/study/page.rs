//! One HTML page that stands alone: no script, no other file.

use std::fmt::Write as _;

/// A part of a page.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// A heading.
    Heading(String),
    /// A smaller one.
    Subheading(String),
    /// A paragraph.
    Text(String),
    /// Question and answer, one after another.
    Answers(Vec<(String, String)>),
    /// The first row are titles, the first column too.
    Table(Vec<Vec<String>>),
    /// A table whose rows are coloured.
    Verdicts {
        /// Of the columns.
        titles: Vec<String>,
        /// As many cells as titles.
        rows: Vec<(Tone, Vec<String>)>,
    },
    /// Pictures: titles of the columns, then rows of a title and one address a column.
    Pictures {
        /// One a column.
        columns: Vec<String>,
        /// Title and addresses.
        rows: Vec<(String, Vec<String>)>,
    },
    /// SVG, put in as it is.
    Curves(Vec<String>),
    /// As typed in a terminal or a file.
    Code(String),
}

/// How a row looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Like any other.
    Plain,
    /// As it should be.
    Good,
    /// Not as it should be.
    Bad,
    /// Not as it should be, and known.
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

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1300px;margin:2em auto;padding:0 1em;color:#222}\
h1,h2{font-weight:600}table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
th,td{padding:.25em .8em;border-bottom:1px solid #ddd;text-align:right}\
th:first-child,td:first-child{text-align:left}dt{font-weight:600;margin-top:.6em}dd{margin:0}\
.pictures{display:grid;gap:.4em;align-items:center}.pictures img{width:100%;display:block}\
.curves{display:grid;grid-template-columns:repeat(auto-fill,minmax(420px,1fr));gap:1em}\
.verdicts td,.verdicts th{text-align:left;vertical-align:top}.verdicts td:last-child{border-left:6px solid #ddd;min-width:18em}.verdicts td:nth-child(2){min-width:12em}\
.good td:last-child{border-left-color:#009e73}.bad td:last-child{border-left-color:#d55e00;font-weight:600}\
.known td:last-child{border-left-color:#e69f00}h3{margin:1.4em 0 .3em;font-weight:600}\
pre{background:#f4f4f4;padding:.8em;overflow-x:auto}";

/// The page.
pub fn html(title: &str, parts: &[Part]) -> String {
    let title = escaped(title);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
    );
    for part in parts {
        // Writing to a String cannot fail.
        let _ = write_part(&mut out, part);
    }
    out + "</body>\n</html>\n"
}

fn write_part(out: &mut String, part: &Part) -> std::fmt::Result {
    match part {
        Part::Heading(text) => writeln!(out, "<h2>{}</h2>", escaped(text)),
        Part::Subheading(text) => writeln!(out, "<h3>{}</h3>", escaped(text)),
        Part::Text(text) => writeln!(out, "<p>{}</p>", escaped(text)),
        Part::Code(text) => writeln!(out, "<pre>{}</pre>", escaped(text)),
        Part::Curves(curves) => writeln!(out, "<div class=\"curves\">\n{}</div>", curves.concat()),
        Part::Answers(answers) => {
            writeln!(out, "<dl>")?;
            for (question, answer) in answers {
                writeln!(
                    out,
                    "<dt>{}</dt><dd>{}</dd>",
                    escaped(question),
                    escaped(answer)
                )?;
            }
            writeln!(out, "</dl>")
        }
        Part::Table(rows) => {
            writeln!(out, "<table>")?;
            for (index, row) in rows.iter().enumerate() {
                let tag = if index == 0 { "th" } else { "td" };
                let cells = row.iter().map(|c| format!("<{tag}>{}</{tag}>", escaped(c)));
                writeln!(out, "<tr>{}</tr>", cells.collect::<String>())?;
            }
            writeln!(out, "</table>")
        }
        Part::Verdicts { titles, rows } => {
            let cells = |tag: &str, cells: &[String]| {
                let cells = cells.iter();
                let cells = cells.map(|c| format!("<{tag}>{}</{tag}>", escaped(c)));
                cells.collect::<String>()
            };
            let head = cells("th", titles);
            writeln!(out, "<table class=\"verdicts\">\n<tr>{head}</tr>")?;
            for (tone, row) in rows {
                let (class, row) = (tone.class(), cells("td", row));
                writeln!(out, "<tr class=\"{class}\">{row}</tr>")?;
            }
            writeln!(out, "</table>")
        }
        Part::Pictures { columns, rows } => {
            writeln!(
                out,
                "<div class=\"pictures\" style=\"grid-template-columns:5em repeat({},1fr)\">",
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

/// Text as HTML and SVG take it, also within quotes.
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
            Part::Answers(vec![(evil.clone(), evil.clone())]),
            Part::Table(vec![vec![evil.clone()], vec![evil.clone()]]),
            Part::Pictures {
                columns: vec![evil.clone(), "b".into()],
                rows: vec![(evil.clone(), vec!["data:a".into(), "data:b".into()])],
            },
            Part::Curves(vec!["<svg></svg>".into()]),
        ];
        let page = html(&evil, &parts);
        assert!(!page.contains("<script>"));
        assert!(page.matches("&lt;script&gt;&quot;&amp;").count() >= 12);
        for piece in ["<th>", "<td>", "<dt>", "src=\"data:b\"", "<svg>", "<pre>"] {
            assert!(page.contains(piece), "{piece}");
        }
        for address in ["http://", "https://", "src=\"/", "href="] {
            assert!(!page.contains(address), "{address}");
        }
    }
}
