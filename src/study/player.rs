//! A page that plays pictures: one file with its script and its curves, which asks the network for nothing.

use serde::Serialize;

use super::{chart::Chart, page::escaped};

/// Pictures of one render or cache.
#[derive(Clone, Debug, Serialize)]
pub struct Set {
    /// Above them where there are two.
    pub name: String,
    /// Columns and rows of each picture.
    pub size: [usize; 2],
    /// Address of each frame's picture: `data:`, or a name beside the page.
    pub pictures: Vec<String>,
}

/// What a page plays.
#[derive(Clone, Debug)]
pub struct Player {
    /// Above it.
    pub title: String,
    /// Below that, one sentence each.
    pub notes: Vec<String>,
    /// One, or two of the same shape that are held against each other.
    pub sets: Vec<Set>,
    /// Of each frame: its number, or its name.
    pub labels: Vec<String>,
    /// When each frame ends, seconds; `None` where that is not known.
    pub times: Vec<Option<f64>>,
    /// So many a second, to begin with.
    pub frames_per_second: f64,
    /// What probes saw over time, with linear axes.
    pub curves: Vec<Chart>,
}

/// What the script reads.
#[derive(Serialize)]
struct Data<'a> {
    labels: &'a [String],
    times: &'a [Option<f64>],
    rate: f64,
    sets: &'a [Set],
}

/// In every page, and in none that is not ours.
pub const MARK: &str = "<meta name=\"generator\" content=\"swell view\">";

const SCRIPT: &str = include_str!("player/player.js");
const STYLE: &str = include_str!("player/player.css");

/// Nothing is loaded but the page's own pictures, whatever stands in it.
const POLICY: &str = "default-src 'none'; img-src data: file: 'self'; script-src 'unsafe-inline'; style-src 'unsafe-inline'";

const KEYS: [(&str, &str); 6] = [
    ("Space", "play, pause"),
    ("← →", "a frame back, a frame on"),
    ("Page up, Page down", "ten frames back, on"),
    ("Home, End", "first frame, last frame"),
    ("L", "repeat"),
    ("Z", "a pixel of the picture is one of the screen"),
];
const KEYS_OF_TWO: [(&str, &str); 4] = [
    ("1, 2", "one of both alone"),
    ("S", "side by side"),
    ("W", "wipe: pull it across the picture"),
    ("D", "difference"),
];
const MODES: [(&str, &str); 5] = [
    ("a", "1"),
    ("b", "2"),
    ("side", "Side by side"),
    ("wipe", "Wipe"),
    ("difference", "Difference"),
];

impl Player {
    /// The page.
    pub fn to_html(&self) -> String {
        let title = escaped(&self.title);
        let notes = self
            .notes
            .iter()
            .map(|note| format!("<p>{}</p>\n", escaped(note)));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n{MARK}\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
             <h1>{title}</h1>\n{}<div id=\"names\"></div>\n<div id=\"stage\"><canvas id=\"picture\" role=\"img\" aria-label=\"the frame\"></canvas></div>\n{}{}{}\
             <script type=\"application/json\" id=\"data\">{}</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            notes.collect::<String>(),
            self.bar(),
            self.curves(),
            self.keys(),
            self.data(),
        )
    }

    fn bar(&self) -> String {
        let mode = |(mode, text): &(&str, &str)| {
            let set = ["a", "b"].iter().position(|name| name == mode);
            let name = set.map_or("", |set| &*self.sets[set].name);
            format!(
                "<button type=\"button\" data-mode=\"{mode}\" title=\"{}\">{text}</button>\n",
                escaped(name)
            )
        };
        let modes: String = match self.sets.len() {
            1 => String::new(),
            _ => MODES.iter().map(mode).collect(),
        };
        format!(
            "<div class=\"bar\">\n<input type=\"range\" id=\"scrub\" min=\"0\" value=\"0\" step=\"1\" aria-label=\"frame\">\n\
             <button type=\"button\" id=\"back\" aria-label=\"a frame back\">−1</button>\n\
             <button type=\"button\" id=\"play\">Play</button>\n\
             <button type=\"button\" id=\"on\" aria-label=\"a frame on\">+1</button>\n\
             <label><input type=\"number\" id=\"rate\" min=\"0.1\" max=\"240\" step=\"any\" value=\"{}\"> frames/s</label>\n\
             <label><input type=\"checkbox\" id=\"loop\" checked> repeat</label>\n\
             <button type=\"button\" id=\"fit\" aria-pressed=\"false\">1:1</button>\n{modes}\
             <label id=\"gains\" hidden>times <select id=\"gain\"><option>1<option>4<option>16<option>64</select></label>\n\
             <output id=\"told\"></output>\n</div>\n<p id=\"fault\" role=\"alert\"></p>\n",
            self.frames_per_second
        )
    }

    fn curves(&self) -> String {
        if self.curves.is_empty() {
            return String::new();
        }
        let figure = |chart: &Chart| {
            let [values, places] = chart.across();
            format!(
                "<figure data-across=\"[[{},{}],[{},{}]]\">{}<i hidden></i></figure>\n",
                values[0],
                values[1],
                places[0],
                places[1],
                chart.to_svg()
            )
        };
        let figures: String = self.curves.iter().map(figure).collect();
        format!("<div id=\"curves\">\n{figures}</div>\n")
    }

    fn keys(&self) -> String {
        let more = match self.sets.len() {
            1 => &[][..],
            _ => &KEYS_OF_TWO,
        };
        let row = |(key, what): &(&str, &str)| format!("<kbd>{key}</kbd><span>{what}</span>\n");
        let rows: String = KEYS.iter().chain(more).map(row).collect();
        format!("<details><summary>Keys</summary>\n<div id=\"keys\">\n{rows}</div></details>\n")
    }

    /// JSON within HTML: nothing in it ends the script.
    fn data(&self) -> String {
        let data = Data {
            labels: &self.labels,
            times: &self.times,
            rate: self.frames_per_second,
            sets: &self.sets,
        };
        // Strings and numbers alone: there is nothing that JSON cannot hold.
        let json = serde_json::to_string(&data).unwrap_or_default();
        json.replace('<', "\\u003c")
    }
}

#[cfg(test)]
mod tests {
    use super::{super::chart::Series, *};

    fn player(sets: usize) -> Player {
        let evil = "</script><script>\"&".to_owned();
        let set = |k: usize| Set {
            name: format!("{evil}{k}"),
            size: [4, 3],
            pictures: vec![format!("data:{k}"), evil.clone()],
        };
        Player {
            title: evil.clone(),
            notes: vec![evil.clone()],
            sets: (0..sets).map(set).collect(),
            labels: vec!["1".into(), evil.clone()],
            times: vec![Some(0.5), None],
            frames_per_second: 24.0,
            curves: vec![Chart {
                title: evil.clone(),
                series: vec![Series::curve(&evil, [(0.0, Some(1.0)), (2.0, Some(3.0))])],
                ..Chart::default()
            }],
        }
    }

    #[test]
    fn nothing_breaks_out_and_nothing_is_asked_for() {
        for sets in [1, 2] {
            let page = player(sets).to_html();
            assert_eq!(page.matches("</script>").count(), 2);
            assert_eq!(page.matches("<script").count(), 2);
            for address in ["http://", "https://", "src=", "href="] {
                // The namespace of SVG is a name, and nobody asks for it.
                let page = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
                assert!(!page.contains(address), "{address}");
            }
            assert!(page.contains(MARK) && page.contains("default-src 'none'"));
            assert_eq!(page.contains("data-mode=\"wipe\""), sets == 2);
        }
    }

    #[test]
    fn the_script_reads_what_was_given() {
        let page = player(2).to_html();
        let begin = page.find("id=\"data\">").unwrap() + 10;
        let json = page[begin..].split("</script>").next().unwrap();
        let data: serde_json::Value = serde_json::from_str(json).unwrap();
        assert_eq!(data["labels"][1], "</script><script>\"&");
        assert_eq!(data["times"], serde_json::json!([0.5, null]));
        assert_eq!(data["sets"][1]["size"], serde_json::json!([4, 3]));
        assert!(page.contains("data-across=\"[[0,2],[0.125,0.957"), "{page}");
    }

    /// Each element that the script asks for by name is on the page.
    #[test]
    fn the_script_finds_its_elements() {
        let page = player(2).to_html();
        let mut asked = 0;
        for name in SCRIPT.split("$(\"").skip(1) {
            let name = name.split('"').next().unwrap();
            assert!(page.contains(&format!("id=\"{name}\"")), "{name}");
            asked += 1;
        }
        assert!(asked > 20, "{asked}");
    }
}
