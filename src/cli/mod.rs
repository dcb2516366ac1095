//! The command line: one file for each command. Only this part of the crate touches files and terminals.
//!
//! Data goes to standard output, messages and progress bars go to standard error. Exit codes: 0 fine; 1 the
//! input has findings; 2 usage or file error; 3 numerical failure in a run; 130 interrupted.

/// Prints one line of data on standard output.
macro_rules! say {
    ($($words:tt)*) => { $crate::cli::output::line(format_args!($($words)*)) };
}

mod args;
mod build;
mod chains;
mod check;
mod choose;
mod deadline;
mod eval;
mod explain;
mod failure;
mod findings;
mod fmt;
mod hidden;
mod init;
mod input;
mod interrupt;
mod language;
mod lints;
mod lsp;
mod manual;
mod mesh;
mod message;
mod output;
mod params;
mod plot;
mod progress;
mod render;
mod report;
mod run;
mod saved;
mod scenery;
mod section;
mod shared;
mod stated;
mod stopwatch;
mod surfaces;
mod survey;
mod sweep;
mod values;
mod view;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::FromArgMatches;
use clap::error::{ContextKind, ContextValue};
use rfm::diagnostic::{is_hidden, printable};
use rfm::lower::vocabulary;
use rfm::quantity::{parse_quantity, parse_unit};

use failure::{Failure, note};

/// Runs the program with the arguments of a process, the program's name first, and gives its exit code.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let hidden = arguments.iter().any(|argument| argument.to_string_lossy().contains(is_hidden));
    let mut declaration = args::declaration();
    let matched = declaration.try_get_matches_from_mut(arguments);
    let read = matched.and_then(|mut matches| {
        let read = args::Arguments::from_arg_matches_mut(&mut matches);
        read.map_err(|error| error.format(&mut declaration))
    });
    let arguments = match read {
        Ok(arguments) => arguments,
        Err(error) => {
            if hidden {
                // the message repeats what was written, and its own colours could not be distinguished from
                // it
                anstream::eprint!("{}", printable(&error.render().to_string()));
                return ExitCode::from(2);
            }
            let error = with_known_words(error);
            // clap reports help and version as errors; printing them fails only if standard output is closed
            let _ = error.print();
            if let Some(hint) = hint(&error) {
                note(hint);
            }
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    outlive_size_limits();
    command(arguments).map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}

/// The error with the flag or command that is meant by a word of other programs, in place of one that merely looks
/// like it.
fn with_known_words(mut error: clap::Error) -> clap::Error {
    let text = |error: &clap::Error, kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let word = text(&error, ContextKind::InvalidSubcommand);
    if let Some(command) = word.and_then(|word| elsewhere(&word)) {
        let name = command.split(' ').next().unwrap_or(command).to_string();
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![name]));
    }
    let flag = text(&error, ContextKind::InvalidArg);
    // the usage names the command
    let meshes = error.get(ContextKind::Usage).is_some_and(|usage| usage.to_string().contains("rfm mesh "));
    if meshes && matches!(flag.as_deref(), Some("--resolution" | "--res" | "--grid")) {
        error.insert(ContextKind::SuggestedArg, ContextValue::String("--cells".into()));
        // it shows the flag that merely looks alike
        error.remove(ContextKind::Usage);
    }
    let runs = error.get(ContextKind::Usage).is_some_and(|usage| usage.to_string().contains("rfm run "));
    if runs && flag.as_deref() == Some("-s") {
        error.insert(ContextKind::SuggestedArg, ContextValue::String("--scene".into()));
    }
    // of what stands behind `--` no command makes a flag's value
    if let Some(ContextValue::StyledStrs(tips)) = error.remove(ContextKind::Suggested) {
        let others: Vec<_> =
            tips.into_iter().filter(|tip| !tip.to_string().contains("as a value, use '")).collect();
        if !others.is_empty() {
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(others));
        }
    }
    error
}

/// What there is to say to arguments that are none, beyond a similar flag.
fn hint(error: &clap::Error) -> Option<String> {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    if let Some(word) = text(ContextKind::InvalidSubcommand) {
        if Path::new(word).extension().is_some_and(|ending| ending == "rfm") {
            let commands = format!("`rfm check {word}` lists its solids, `rfm run {word}` runs its scene");
            return Some(format!("a command comes first: {commands}"));
        }
        return elsewhere(word).map(|command| format!("`rfm {command}` does that"));
    }
    let argument = text(ContextKind::InvalidArg)?;
    if let Some(value) = text(ContextKind::InvalidValue) {
        let has_unit =
            value.starts_with(|c: char| c.is_ascii_digit()) && value.ends_with(char::is_alphabetic);
        return match argument.split(' ').next()? {
            "--cells" if has_unit && parse_quantity(value).is_ok() => {
                Some(format!("--cells counts cells; how large they are is `--cell {value}`"))
            }
            "--what" if ["omega", "ω", "w", "f"].contains(&value) => Some("ω is `--what value`".into()),
            _ => None,
        };
    }
    if argument.parse::<f64>().is_ok() && std::env::args().any(|flag| flag == "--at") {
        return Some("the numbers of a point are joined by commas, as in `--at 1,2,3`".into());
    }
    if let Some(number) = argument_before(argument).filter(|number| number.parse::<f64>().is_ok())
        && parse_unit(argument).is_some()
    {
        return Some(format!(
            "a number and its unit are one argument: write `{number}{argument}`, or `\"{number} {argument}\"` in quotes"
        ));
    }
    if let Some((flag, file)) = flag_of_name(argument) {
        let (argument, file) = (printable(argument), printable(&file));
        return Some(format!("`{argument}` of `{file}` is chosen by `{flag} {argument}`"));
    }
    let key = argument.strip_prefix("--")?.replace('-', "_");
    if let Some(file) = file_with(&key, "param ") {
        let value = arguments().skip_while(|given| given != argument).nth(1);
        let value = value.filter(|value| parse_quantity(value).is_ok()).unwrap_or_else(|| "…".into());
        return Some(format!("`{key}` is a param of `{}`: write `-D {key}={value}`", printable(&file)));
    }
    vocabulary::is_key(&key).then(|| {
        format!(
            "`{key}` is a key of scenes: to set it from here let it be a param of the file, as in \
             `param p = …` and `{key}: p`, and write `-D p=…`"
        )
    })
}

/// The arguments of this program, as far as they are text.
fn arguments() -> impl Iterator<Item = String> {
    std::env::args_os().map(|argument| argument.to_string_lossy().into_owned())
}

/// The argument in front of another one.
fn argument_before(argument: &str) -> Option<String> {
    let all: Vec<String> = arguments().collect();
    let at = all.iter().position(|given| given == argument)?;
    all.get(at.checked_sub(1)?).cloned()
}

/// The flag that chooses the solid or the scene of this name, and the file among the arguments that has it.
fn flag_of_name(name: &str) -> Option<(&'static str, String)> {
    let of_kind = |kind, flag| file_with(name, kind).map(|file| (flag, file));
    let is_run = arguments().nth(1).is_some_and(|command| command == "run");
    let solid = if is_run { None } else { of_kind("solid ", "-s") };
    solid.or_else(|| of_kind("scene ", "--scene"))
}

/// The file among the arguments that defines this name, in a line that begins with the word for what it is.
fn file_with(name: &str, kind: &str) -> Option<String> {
    let declares = |line: &str| {
        line.strip_prefix(kind).is_some_and(|rest| rest.split(['=', ' ', '{']).next() == Some(name))
    };
    let mut files = arguments().filter(|argument| argument.ends_with(".rfm"));
    files.find(|file| std::fs::read_to_string(file).is_ok_and(|text| text.lines().any(declares)))
}

/// The command that does the same as the command of this name in other programs; `None` if no other program
/// is known to have it.
fn elsewhere(word: &str) -> Option<&'static str> {
    Some(match word {
        "slice" | "section" | "plot" | "cut" => "check FILE --slice z=0.5",
        "info" | "list" | "lint" | "validate" | "volume" => "check FILE",
        "stl" | "obj" | "export" | "convert" | "triangulate" | "tessellate" => "mesh FILE -o part.stl",
        "simulate" | "sim" | "solve" | "start" | "resume" | "continue" => "run FILE",
        "show" | "open" | "display" | "preview" | "serve" => "view FILE",
        "picture" | "image" | "film" | "animate" | "movie" | "draw" => "render FILE",
        "compile" | "generate" | "emit" | "codegen" => "build FILE -o part.c",
        "evaluate" | "sample" | "value" => "eval FILE --at 0,0,0",
        "sweep" => "run FILE --sweep NAME=1..2:5",
        "new" | "create" => "init",
        "format" => "fmt FILE",
        _ => return None,
    })
}

/// Lets a write beyond the limit for the size of a file fail as one to a full disk does. Without this the
/// system ends the process.
fn outlive_size_limits() {
    #[cfg(unix)]
    {
        // if it cannot be registered, the process ends there as it would have
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default());
    }
}

fn command(arguments: args::Arguments) -> Result<(), Failure> {
    if let Some(threads) = arguments.shared.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global();
        pool.map_err(|e| Failure::usage(format!("cannot start {threads} threads: {e}")))?;
    }
    let mut shared = arguments.shared;
    // of two values for one param the later one is taken
    let mut define = params::read(&shared.params)?;
    define.append(&mut shared.define);
    shared.define = define;
    match arguments.command {
        args::Command::Check(options) if !options.sweep.sweep.is_empty() => {
            sweep::commands::check(&shared, &options)
        }
        args::Command::Check(options) => check::run(&shared, &options),
        args::Command::Eval(options) => eval::run(&shared, &options),
        args::Command::Mesh(options) if !options.sweep.sweep.is_empty() => {
            sweep::commands::mesh(&shared, &options)
        }
        args::Command::Mesh(options) => mesh::run(&shared, &options),
        args::Command::Build(options) => build::run(&shared, &options),
        args::Command::Run(options) if !options.sweep.sweep.is_empty() => {
            sweep::commands::run(&shared, &options)
        }
        args::Command::Run(options) => run::run(&shared, &options),
        args::Command::View(options) => view::run(&shared, &options),
        args::Command::Render(options) => render::run(&shared, &options),
        args::Command::Report(options) if !options.sweep.sweep.is_empty() => {
            sweep::commands::report(&shared, &options)
        }
        args::Command::Report(options) => report::run(&shared, &options),
        args::Command::Explain(options) => explain::run(&shared, &options),
        args::Command::Fmt(options) => fmt::run(&shared, &options),
        args::Command::Lsp(options) => lsp::run(&options),
        args::Command::Init(options) => init::run(&options),
        args::Command::Completions(options) => manual::completions(&options),
        args::Command::Man(options) => manual::man(&options),
    }
}
