//! A report as one page for a browser: tables, plots and pictures, the files that it is about, and how to
//! make it again.
//!
//! Invariants: the page asks for nothing outside itself, and runs no program. Text of files is escaped, and
//! drawings are images, in which a browser runs nothing either.

use std::fmt::Write as _;
use std::time::{SystemTime, UNIX_EPOCH};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;

use super::table::Column;
use rfm::Program;
use rfm::codegen::target_description;
use rfm::diagnostic::{Source, SourceId, printable};
use rfm::files::Files;

/// The beginning of the document, up to the title.
const HEAD: &str = r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<link rel="icon" href="data:,">
"#;

const STYLE: &str = "
:root { --back: #ffffff; --text: #20242b; --soft: #5b6472; --line: #d5d9df; --band: #f4f6f8; color-scheme: light dark; }
@media (prefers-color-scheme: dark) {
  :root { --back: #16191f; --text: #e6e9ee; --soft: #a0a9b6; --line: #39414d; --band: #1e232b; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1080px; padding: 28px 20px 60px; background: var(--back); color: var(--text);
  font: 15px/1.5 system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif; }
h1 { font-size: 26px; margin: 0 0 6px; overflow-wrap: anywhere; }
h2 { font-size: 19px; margin: 34px 0 8px; }
h3 { font-size: 15px; margin: 18px 0 6px; overflow-wrap: anywhere; }
p { margin: 4px 0 10px; color: var(--soft); overflow-wrap: anywhere; }
figure { margin: 12px 0 18px; }
figure img { display: block; max-width: 100%; height: auto; background: #ffffff; border: 1px solid var(--line); border-radius: 6px; }
figcaption { color: var(--soft); font-size: 13px; margin-top: 5px; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 440px), 1fr)); gap: 0 20px; align-items: start; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; white-space: nowrap; }
th, td { padding: 3px 10px; border-bottom: 1px solid var(--line); text-align: right; }
th { color: var(--soft); font-weight: 600; }
.word { text-align: left; }
tbody tr:nth-child(odd) { background: var(--band); }
pre { margin: 6px 0 14px; padding: 12px 14px; overflow-x: auto; background: var(--band); border: 1px solid var(--line); border-radius: 6px;
  font: 13px/1.45 ui-monospace, 'DejaVu Sans Mono', Menlo, Consolas, monospace; tab-size: 4; }
dl { display: grid; grid-template-columns: auto 1fr; gap: 4px 18px; margin: 8px 0; }
dt { color: var(--soft); }
dd { margin: 0; overflow-wrap: anywhere; }
a { color: inherit; text-underline-offset: 3px; }
@media print { body { max-width: none; } pre, .wide { overflow: visible; white-space: pre-wrap; } }
";

/// The largest file of data that a page holds, and the most of all of them, in bytes.
const LARGEST_FILE: usize = 1_000_000;
const MOST_DATA: usize = 4_000_000;

/// A page that is being written.
pub(super) struct Page {
    out: String,
}

impl Page {
    /// Begins a page with a heading and a line of facts below it.
    pub fn begin(title: &str, facts: &str) -> Self {
        let (title, facts) = (escaped(title), escaped(facts));
        let out = format!(
            "{HEAD}<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<p>{facts}</p>\n"
        );
        Self { out }
    }

    /// Begins a section, with a sentence about it.
    pub fn section(&mut self, title: &str, about: &str) {
        self.add(format_args!("<h2>{}</h2>\n", escaped(title)));
        if !about.is_empty() {
            self.add(format_args!("<p>{}</p>\n", escaped(about)));
        }
    }

    /// Adds a table.
    pub fn table(&mut self, columns: &[Column], rows: impl Iterator<Item = Vec<String>>) {
        let class = |column: &Column| if column.is_left { " class=\"word\"" } else { "" };
        self.add(format_args!("<div class=\"wide\"><table>\n<thead><tr>"));
        for column in columns {
            self.add(format_args!("<th scope=\"col\"{}>{}</th>", class(column), escaped(column.name)));
        }
        self.add(format_args!("</tr></thead>\n<tbody>\n"));
        for cells in rows {
            self.add(format_args!("<tr>"));
            for (column, cell) in columns.iter().zip(cells) {
                self.add(format_args!("<td{}>{}</td>", class(column), escaped(cell.trim())));
            }
            self.add(format_args!("</tr>\n"));
        }
        self.add(format_args!("</tbody></table></div>\n"));
    }

    /// Adds drawings beside each other.
    pub fn figures(&mut self, figures: &[Figure]) {
        self.add(format_args!("<div class=\"{}\">\n", if figures.len() > 1 { "pair" } else { "one" }));
        for Figure { kind, bytes, about } in figures {
            let (about, data) = (escaped(about), BASE64_STANDARD.encode(bytes));
            self.add(format_args!(
                "<figure><img alt=\"{about}\" src=\"data:{kind};base64,{data}\"><figcaption>{about}</figcaption></figure>\n"
            ));
        }
        self.add(format_args!("</div>\n"));
    }

    /// Ends the page with the files of a program, the command, the machine and the versions.
    pub fn end(mut self, program: &Program) -> Vec<u8> {
        // the standard solids belong to the program
        let own = program.sources().iter().filter(|source| source.id != SourceId::Prelude);
        let sources: Vec<_> = own.collect();
        self.section("Source", if sources.len() > 1 { "The file, and those that it imports." } else { "" });
        for source in &sources {
            let text = escaped(&source.text.replace("\r\n", "\n"));
            let link = link(&source.name, source.text.as_bytes());
            self.add(format_args!("<h3>{link}</h3>\n<pre>{text}</pre>\n"));
        }
        let missing = self.data(program, &sources);
        let files = match missing {
            0 => {
                "With the files above, whose names save them, in the folder in which this command was given:"
                    .to_string()
            }
            n => format!(
                "With the files above, whose names save them, and {n} that this page does not hold, in the folder in which \
                 this command was given:"
            ),
        };
        self.section("How to make it again", &files);
        self.add(format_args!("<pre>{}</pre>\n<dl>\n", escaped(&command(std::env::args_os()))));
        let facts = [
            ("program", format!("rfm {}", env!("CARGO_PKG_VERSION"))),
            ("made", date(SystemTime::now())),
            ("system", format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH)),
            ("processor", processor().unwrap_or_else(|| "unknown".into())),
            ("threads", rayon::current_num_threads().to_string()),
            ("code generated for", target_description()),
        ];
        for (name, fact) in facts {
            self.add(format_args!("<dt>{name}</dt><dd>{}</dd>\n", escaped(&fact)));
        }
        self.add(format_args!("</dl>\n</body>\n</html>\n"));
        self.out.into_bytes()
    }

    /// Adds the data that the files read, and returns how many of them the page does not hold: they are too
    /// large, or cannot be read.
    fn data(&mut self, program: &Program, sources: &[&Source]) -> usize {
        let is_source = |name: &String| sources.iter().any(|source| Files::plain(&source.name) == *name);
        let files = program.files();
        let named = files.asked().into_iter().filter(|name| !is_source(name));
        let data: Vec<_> = named.map(|name| (files.read(&name), name)).collect();
        if data.is_empty() {
            return 0;
        }
        self.section("Data", "What the files read. Their paths go from the folder of the file.");
        self.add(format_args!("<ul>\n"));
        let (mut room, mut missing) = (MOST_DATA, 0);
        for (read, name) in data {
            let Ok(bytes) = read else {
                missing += 1;
                self.add(format_args!("<li>{}: cannot be read</li>\n", escaped(&name)));
                continue;
            };
            let size = size(bytes.len());
            if bytes.len() <= LARGEST_FILE.min(room) {
                room -= bytes.len();
                self.add(format_args!("<li>{}, {size}</li>\n", link(&name, &bytes)));
            } else {
                missing += 1;
                self.add(format_args!(
                    "<li>{}, {size}: too large to be held by this page</li>\n",
                    escaped(&name)
                ));
            }
        }
        self.add(format_args!("</ul>\n"));
        missing
    }

    fn add(&mut self, text: std::fmt::Arguments<'_>) {
        // writing to a String cannot fail
        let _ = self.out.write_fmt(text);
    }
}

/// A drawing with what it shows.
pub(super) struct Figure {
    kind: &'static str,
    bytes: Vec<u8>,
    about: String,
}

impl Figure {
    pub fn svg(bytes: Vec<u8>, about: impl Into<String>) -> Self {
        Self { kind: "image/svg+xml", bytes, about: about.into() }
    }

    pub fn png(bytes: Vec<u8>, about: impl Into<String>) -> Self {
        Self { kind: "image/png", bytes, about: about.into() }
    }
}

/// A link that saves a file under its name.
fn link(name: &str, bytes: &[u8]) -> String {
    let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let (name, last, data) = (escaped(name), escaped(last), BASE64_STANDARD.encode(bytes));
    format!("<a download=\"{last}\" href=\"data:application/octet-stream;base64,{data}\">{name}</a>")
}

/// A number of bytes as a person reads it.
fn size(bytes: usize) -> String {
    match bytes {
        0..1000 => format!("{bytes} bytes"),
        1000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// Text as it stands in the document, with letters that would change how it reads made visible.
fn escaped(text: &str) -> String {
    let text = printable(text);
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            _ => out.push(c),
        }
    }
    out
}

/// A command as a shell takes it.
fn command(words: impl Iterator<Item = std::ffi::OsString>) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%^".contains(c);
    let quoted = |word: String| {
        if !word.is_empty() && word.chars().all(is_plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    let words = words.map(|word| word.to_string_lossy().into_owned()).enumerate().map(|(k, word)| match k {
        // from wherever it was called
        0 => "rfm".into(),
        _ => quoted(word),
    });
    words.collect::<Vec<_>>().join(" ")
}

/// A day and time of the universal clock: `2026-11-23 14:05 UTC`.
fn date(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (mut days, minutes) = (seconds / 86_400, seconds % 86_400 / 60);
    let is_leap =
        |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let mut year = 1970;
    while days >= 365 + u64::from(is_leap(year)) {
        days -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(is_leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= lengths[month] {
        days -= lengths[month];
        month += 1;
    }
    format!("{year}-{:02}-{:02} {:02}:{:02} UTC", month + 1, days + 1, minutes / 60, minutes % 60)
}

/// The name of the processor; `None` where the system does not state it in a file.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("model name"))?;
    Some(line.trim_start_matches([' ', '\t', ':']).to_string())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn days_are_those_of_the_calendar() {
        // from `date -u -d @N`
        for (seconds, expected) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (1_709_251_200, "2024-03-01 00:00 UTC"),
            (1_798_761_599, "2026-12-31 23:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }

    #[test]
    fn commands_can_be_pasted_into_a_shell() {
        let words = ["/opt/rfm", "report", "my pawn.rfm", "-D", "d=8 mm", "--html", "it's.html", "", "$(x)"];
        let expected = r"rfm report 'my pawn.rfm' -D 'd=8 mm' --html 'it'\''s.html' '' '$(x)'";
        assert_eq!(command(words.iter().map(Into::into)), expected);
    }

    #[test]
    fn nothing_of_a_text_becomes_part_of_the_document() {
        let evil = "</pre><script>alert('1')</script>\"&";
        assert_eq!(escaped(evil), "&lt;/pre&gt;&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;&quot;&amp;");
        let mut page = Page::begin(evil, evil);
        page.section(evil, evil);
        page.table(&[Column::words("a", 3)], std::iter::once(vec![evil.to_string()]));
        page.figures(&[Figure::svg(evil.into(), evil)]);
        assert!(!page.out.contains("<script") && !page.out.contains("alert('1')"));
        assert!(!page.out.contains("http:") && !page.out.contains("https:"), "{}", page.out);
    }
}
