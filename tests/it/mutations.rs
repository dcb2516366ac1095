//! Files with random damage: whatever a file holds, reading it, laying it out and asking a language server
//! about it neither panics nor takes long or much memory.
//!
//! `RFM_MUTATIONS=3600 cargo test --test it mutations` goes on for that number of seconds, with other
//! mutations each time. A case that fails is printed as it stands.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rfm::diagnostic::Source;
use rfm::lower::Options;
use rfm::syntax::{Spelling, format};
use rfm::{Engine, Experiment, Program};

use crate::lsp::Editor;
use crate::tool::root;

/// Longest time for one file, and the most memory, bytes, that the process may use.
const LONGEST: Duration = Duration::from_secs(2);
const MOST_MEMORY: f64 = 1e9;

/// Files that are read if no time is stated. One of some is laid out, too, and opened in an editor.
const FEW: usize = 3000;
const ALL_STAGES_EVERY: usize = 10;

/// Longer files are cut: mutations join files to each other.
const LONGEST_FILE: usize = 20_000;

/// What stands in place of something else, or between two things.
const PIECES: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "1e9",
    "1e-9",
    "1e308",
    "-1e308",
    "5e-324",
    "1e999",
    "1e6",
    "200",
    "100000",
    "0.1",
    "2.5",
    "3..",
    "0..1e6",
    "0..500",
    "-5..5",
    "1..0",
    "any i in 0..300: ",
    "all i in 0..40: any j in 0..40: ",
    "1 mm",
    "5 kg",
    "45 deg",
    "3 rpm",
    "1 m/s^2",
    "[0, 0, 0]",
    "[1, 0]",
    "[]",
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    ",",
    ":",
    "=",
    "==",
    "<=",
    ">=",
    "..",
    " and ",
    " or ",
    "not ",
    "\\",
    "^",
    "²",
    "³",
    "^0.5",
    "^-3",
    "^1000",
    "*",
    "/",
    "-",
    "+",
    "·",
    ".x",
    ".move([1, 0, 0])",
    ".rotate_z(t)",
    ".scale(0)",
    ".scale(1e-200)",
    ".mirror([0, 0, 0])",
    "x",
    "y",
    "z",
    "t",
    "pi",
    "sphere(1)",
    "box([0,0,0],[1,1,1])",
    "torus(1, 0.2)",
    "cone(1, 0)",
    "ball([1e300, 0, 0], 1)",
    "sqrt(",
    "exp(",
    "ln(",
    "atan2(y, x)",
    "normalise(",
    "hypot(x, y)",
    "clamp(x, 0, 1)",
    "\nsolid s = ",
    "\nlet a = ",
    "\nparam p = ",
    "\nfn f(a, b = 1) = ",
    "\nscene q {",
    "@tolerance(1e-9) ",
    "\nrfm 1\n",
    "rfm 2",
    "# ",
    "\"text",
    "\u{202e}",
    "\u{0}",
    "\u{feff}",
    "ω",
    "𝛚",
    "\t",
    "shape: ",
    "spacing: 1e-6",
    "particles: 1e9",
    "particles: 1",
    "until: 1e300 s",
    "save_every: 1e-300",
    "mass: 1e-300",
    "method: dfsph",
    "picture { cut: y <= 0, hide: s, camera: [1, 0, 0] }",
    "probe p { height: [0, 0] }",
    "container { solid: s }",
];

struct Mutator {
    random: Pcg64,
    corpus: Vec<Vec<char>>,
}

impl Mutator {
    fn below(&mut self, end: usize) -> usize {
        (self.random.next_u64() % end.max(1) as u64) as usize
    }

    /// A range within a text, mostly short.
    fn span(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.below(length + 1);
        let most = if self.below(4) == 0 { length } else { 16 };
        let end = (start + self.below(most + 1)).min(length);
        start..end
    }

    fn file(&mut self) -> String {
        let which = self.below(self.corpus.len());
        let mut text = self.corpus[which].clone();
        for _ in 0..=self.below(6) {
            self.change(&mut text);
            text.truncate(LONGEST_FILE);
        }
        text.into_iter().collect()
    }

    /// Places in a text, as an editor counts them, some of them behind its end.
    fn places(&mut self, text: &str) -> [(u32, u32); 2] {
        let lines = text.lines().count() as u64 + 2;
        std::array::from_fn(|_| ((self.random.next_u64() % lines) as u32, self.below(90) as u32))
    }

    fn change(&mut self, text: &mut Vec<char>) {
        let span = self.span(text.len());
        match self.below(8) {
            0 => drop(text.drain(span)),
            1 => {
                let copy: Vec<char> = text[span.clone()].to_vec();
                text.splice(span.end..span.end, copy);
            }
            2 => {
                let moved: Vec<char> = text.drain(span).collect();
                let at = self.below(text.len() + 1);
                text.splice(at..at, moved);
            }
            3 => {
                let which = self.below(self.corpus.len());
                let from = self.span(self.corpus[which].len());
                let piece = self.corpus[which][from].to_vec();
                text.splice(span, piece);
            }
            4 => {
                // a number becomes another one
                let digits: Vec<usize> = (0..text.len()).filter(|&i| text[i].is_ascii_digit()).collect();
                if let Some(&at) = digits.get(self.below(digits.len())) {
                    let piece = PIECES[self.below(16)];
                    text.splice(at..=at, piece.chars());
                }
            }
            5 => {
                let other = char::from_u32((self.random.next_u64() % 0x250) as u32).unwrap_or('?');
                if let Some(c) = text.get_mut(span.start) {
                    *c = other;
                }
            }
            _ => {
                let piece = PIECES[self.below(PIECES.len())];
                let at = if self.below(2) == 0 { span } else { span.start..span.start };
                text.splice(at, piece.chars());
            }
        }
    }
}

/// Reads a file as far as commands do before they compute anything: parsed, lowered, checked, its scenes prepared.
fn read(text: &str) {
    let program = match Program::check(Source::file("m.rfm", text), Options::default()) {
        Ok(program) => program,
        Err(diagnostics) => {
            // messages are rendered as well
            assert!(!diagnostics.to_string().is_empty());
            return;
        }
    };
    let _ = program.warnings().to_string();
    for scene in &program.module().scenes {
        let experiment = Experiment::new(&program, &scene.name, Engine::Interpreter);
        let _ = experiment.and_then(|experiment| experiment.estimated_particles());
    }
}

/// Lays a file out: its layout is its own layout. That it has the same tree and comments is what [`format`]
/// itself compares; it would say that the file cannot be formatted.
fn lay_out(text: &str) {
    for spelling in [Spelling::Written, Spelling::Unicode, Spelling::Ascii] {
        match format(&Source::file("m.rfm", text), spelling) {
            Ok(once) => {
                let twice = format(&Source::file("m.rfm", once.as_str()), spelling);
                assert!(
                    twice.is_ok_and(|twice| twice == once),
                    "{spelling:?}: the layout has another layout"
                );
            }
            Err(broken) => {
                let bug = broken.iter().find(|message| message.message.contains("changing its meaning"));
                assert!(bug.is_none(), "{spelling:?}: {bug:?}");
            }
        }
    }
}

/// Opens a file in an editor, or changes the open one to it, and asks about random places.
fn look(editor: &mut Editor, text: &str, places: &[(u32, u32)]) {
    editor.give(text);
    const QUESTIONS: [&str; 7] =
        ["hover", "completion", "signatureHelp", "definition", "references", "prepareRename", "rename"];
    for &(line, character) in places {
        for question in QUESTIONS {
            // names that cannot be changed are refused; a server that forgot the file has failed on its text
            let answer = editor.at(question, line, character);
            assert_ne!(answer["message"], "the file is not open", "{question} at {line}:{character}");
        }
    }
    for question in ["formatting", "documentSymbol"] {
        let answer = editor.about(question);
        assert!(answer["code"].is_null(), "{question}: {answer}");
    }
}

fn corpus() -> Vec<Vec<char>> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
            let path = entry.path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|ending| ending == "rfm") {
                found.push(path);
            }
        }
    }
    let mut paths = Vec::new();
    walk(&root().join("examples"), &mut paths);
    walk(&root().join("tests/cases"), &mut paths);
    paths.sort();
    paths.iter().filter_map(|path| std::fs::read_to_string(path).ok()).map(|t| t.chars().collect()).collect()
}

/// The processor time of this process, or the time where the system does not provide it.
#[cfg(unix)]
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}

#[cfg(not(unix))]
fn processor_time() -> Duration {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default()
}

/// The processor time of another process; `None` where the system does not provide it.
fn processor_time_of(process: u32) -> Option<Duration> {
    let all = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // in hundredths of a second, behind the name in brackets and eleven other fields
    let fields = all.rsplit_once(')')?.1.split_whitespace().skip(11).take(2);
    let hundredths = fields.map(|field| field.parse::<u64>().ok()).sum::<Option<u64>>()?;
    Some(Duration::from_millis(10 * hundredths))
}

/// How long something takes: by the clock, or in processor time if that is less. The clock runs while other programs
/// compute, and the processor time of a process, which has that of all its threads, while other tests do.
fn time(work: impl FnOnce()) -> Result<Duration, String> {
    let (clock, processor) = (Instant::now(), processor_time());
    let done = catch_unwind(AssertUnwindSafe(work));
    let spent = clock.elapsed().min(processor_time() - processor);
    done.map(|()| spent).map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string())).unwrap_or_default()
    })
}

/// The most memory that a process has had, bytes; 0 where the system does not provide it.
fn peak_memory(process: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()).unwrap_or_default()
        * 1024.0
}

/// The most memory that this process and the language server have had.
fn memory(editor: &Editor) -> [f64; 2] {
    [std::process::id(), editor.server()].map(peak_memory)
}

/// What is done with a file, one after the other.
#[derive(Debug, Clone, Copy)]
enum Stage {
    Read,
    LayOut,
    Edit,
}

const STAGES: [Stage; 3] = [Stage::Read, Stage::LayOut, Stage::Edit];

impl Stage {
    fn time(self, text: &str, places: &[(u32, u32)], editor: &mut Editor) -> Result<Duration, String> {
        match self {
            Self::Read => time(|| read(text)),
            Self::LayOut => time(|| lay_out(text)),
            // the processor time is that of the server
            Self::Edit => {
                let (clock, processor) = (Instant::now(), processor_time_of(editor.server()));
                time(|| look(editor, text, places))?;
                let processor =
                    processor_time_of(editor.server()).zip(processor).map(|(end, start)| end - start);
                Ok(processor.map_or(clock.elapsed(), |spent| clock.elapsed().min(spent)))
            }
        }
    }
}

/// What fails on a file, if anything does.
fn failures(
    stages: &[Stage],
    text: &str,
    places: &[(u32, u32)],
    editor: &mut Editor,
    slowest: &mut [Duration; 3],
) -> Vec<String> {
    let before = memory(editor);
    let mut found = Vec::new();
    for (&stage, slowest) in stages.iter().zip(slowest) {
        match stage.time(text, places, editor) {
            Err(why) => found.push(format!("{stage:?} panics: {why}")),
            // a busy machine is slower: it counts if it is slow three times
            Ok(spent) if spent > LONGEST => {
                if (0..2).all(|_| stage.time(text, places, editor).is_ok_and(|again| again > LONGEST)) {
                    found.push(format!("{stage:?} takes {:.1} s", spent.as_secs_f64()));
                }
            }
            Ok(spent) => *slowest = spent.max(*slowest),
        }
    }
    for (process, (after, before)) in ["reading", "the server"].iter().zip(memory(editor).iter().zip(before))
    {
        if after - before > MOST_MEMORY {
            found.push(format!("{process} takes {:.1} GB", (after - before) / 1e9));
        }
    }
    found
}

#[test]
#[ignore = "long"]
fn damaged_files_neither_panic_nor_take_long() {
    let seconds = std::env::var("RFM_MUTATIONS").ok().map(|s| s.parse::<u64>().expect("a number of seconds"));
    let clock = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_nanos() as u64;
    let seed = if seconds.is_some() { clock } else { 1 };
    let mut mutator = Mutator { random: Pcg64::seed_from_u64(seed), corpus: corpus() };
    assert!(mutator.corpus.len() > 150);
    let started = Instant::now();
    let mut editor = Editor::new(&[]);
    let mut count = 0;
    let mut slowest = [Duration::ZERO; 3];
    let mut failed = Vec::new();
    let memory_before = memory(&editor);
    while seconds.map_or(count < FEW, |seconds| started.elapsed().as_secs() < seconds) {
        let text = mutator.file();
        let places = mutator.places(&text);
        let all = seconds.is_some() || count % ALL_STAGES_EVERY == 0;
        let stages = if all { &STAGES[..] } else { &STAGES[..1] };
        let found = failures(stages, &text, &places, &mut editor, &mut slowest);
        if !found.is_empty() {
            println!("──── {found:?}\n{text}\n────");
            failed.extend(found);
            // a server that failed may have ended
            editor = Editor::new(&[]);
        }
        count += 1;
    }
    let memory_after = memory(&editor);
    editor.end();
    println!(
        "{count} files in {:.0} s; the slowest reading {:.3} s, layout {:.3} s, editor {:.3} s; {:.0} MB more than \
         before, the server {:.0} MB",
        started.elapsed().as_secs_f64(),
        slowest[0].as_secs_f64(),
        slowest[1].as_secs_f64(),
        slowest[2].as_secs_f64(),
        (memory_after[0] - memory_before[0]) / 1e6,
        memory_after[1] / 1e6
    );
    assert!(failed.is_empty(), "{} of {count} files (seed {seed}): {failed:?}", failed.len());
}
