//! `rfm completions` and `rfm man`: what shells and `man` read about the commands, made from their declarations.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;

use super::args::Arguments;
use super::failure::Failure;
use super::output::{self, Shown};

#[derive(Debug, Args)]
#[command(after_help = "bash:  rfm completions bash > ~/.local/share/bash-completion/completions/rfm\n\
                        fish:  rfm completions fish > ~/.config/fish/completions/rfm.fish\n\
                        zsh:   rfm completions zsh > a file _rfm in a folder of $fpath")]
pub(super) struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub(super) struct Man {
    /// Folder for a page of each command [default: rfm's own page, on standard output]
    #[arg(value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

/// Prints the completions of a shell.
pub(super) fn completions(options: &Completions) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(options.shell, &mut Arguments::command(), "rfm", &mut text);
    print(&text)
}

/// Prints rfm's own page, or writes the pages of all commands.
pub(super) fn man(options: &Man) -> Result<(), Failure> {
    let mut whole = Arguments::command();
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
    let mut text = Vec::new();
    clap_mangen::Man::new(command)
        .render(&mut text)
        .map_err(|e| Failure::usage(format!("cannot make the page: {e}")))?;
    Ok(text)
}

/// Prints text that ends in a line of its own.
fn print(text: &[u8]) -> Result<(), Failure> {
    match std::io::stdout().write_all(text) {
        // who has read enough goes away
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::usage(format!("cannot write to standard output: {error}")))
        }
        Err(_) | Ok(()) => Ok(()),
    }
}
