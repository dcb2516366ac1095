//! `rfm completions` and `rfm man`: what shells and `man` read about the commands, made from their declarations.

use std::io::Write;

use clap::{Arg, ArgAction, Command};

use super::args::{self, Completions, Man};
use super::failure::Failure;
use super::output::{self, Shown};

/// Prints the completions of a shell.
pub(super) fn completions(options: &Completions) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(options.shell, &mut args::declaration(), "rfm", &mut text);
    print(&text)
}

/// Prints rfm's own page, or writes the pages of all commands.
pub(super) fn man(options: &Man) -> Result<(), Failure> {
    let mut whole = args::declaration();
    whole.build();
    let Some(folder) = &options.folder else { return print(&page(whole)?) };
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::usage(format!("cannot make the folder `{}`: {e}", folder.shown())))?;
    let commands: Vec<Command> = whole.get_subcommands().cloned().collect();
    for command in std::iter::once(whole).chain(commands) {
        let name = command.get_display_name().unwrap_or_else(|| command.get_name()).to_string();
        let text = page(command)?;
        output::write(&folder.join(format!("{name}.1")), |out| out.write_all(&text))?;
    }
    say!("pages written to {}; read one with: man {}", folder.shown(), folder.join("rfm.1").shown());
    Ok(())
}

fn page(command: Command) -> Result<Vec<u8>, Failure> {
    let command = command.mut_args(|arg| arg.hide_short_help(false));
    let usage = synopsis(&command);
    let command = command.override_usage(usage);
    let mut text = Vec::new();
    clap_mangen::Man::new(command)
        .render(&mut text)
        .map_err(|e| Failure::usage(format!("cannot make the page: {e}")))?;
    Ok(text)
}

/// What may be written behind the name of a command, with the names of values.
fn synopsis(command: &Command) -> String {
    let name = command.get_bin_name().unwrap_or_else(|| command.get_name());
    let options = command.get_arguments().filter(|arg| !arg.is_hide_set() && !arg.is_positional());
    let mut words = vec![name.to_string()];
    words.extend(options.chain(command.get_positionals()).map(written));
    if command.has_subcommands() {
        words.push("COMMAND".to_string());
    }
    words.join(" ")
}

/// An argument as it is written: `[-s|--solid NAME]`.
fn written(arg: &Arg) -> String {
    let flags = [arg.get_short().map(|c| format!("-{c}")), arg.get_long().map(|long| format!("--{long}"))];
    let flag = flags.into_iter().flatten().collect::<Vec<_>>().join("|");
    let value = match arg.get_value_names() {
        Some([name, ..]) if arg.get_action().takes_values() => name.as_str(),
        _ => "",
    };
    let words = format!("{flag} {value}");
    let words = words.trim();
    let words = if arg.is_required_set() { words.to_string() } else { format!("[{words}]") };
    if matches!(arg.get_action(), ArgAction::Append) { format!("{words} …") } else { words }
}

/// Prints text that ends in a line of its own.
fn print(text: &[u8]) -> Result<(), Failure> {
    match std::io::stdout().write_all(text) {
        // the reader may stop early
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::usage(format!("cannot write to standard output: {error}")))
        }
        Err(_) | Ok(()) => Ok(()),
    }
}
