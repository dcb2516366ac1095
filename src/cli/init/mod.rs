//! `rfm init`: a file to begin with.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::output::{self, Shown};

#[derive(Debug, Args)]
#[command(after_help = "An experiment to begin with:  rfm init dam.rfm --template experiment\n\
                        The text on the terminal:     rfm init - --template validation")]
pub(super) struct Init {
    /// The file to write; `-` is standard output [default: the template's name + .rfm]
    #[arg(value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// What the file holds
    #[arg(long, value_enum, default_value_t = Template::Obstacle)]
    pub template: Template,
    /// Replace a file that is there
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Template {
    /// A solid, for meshes and for other programs
    Obstacle,
    /// A solid in a fluid
    Experiment,
    /// A flow whose outcome is known
    Validation,
}

impl Template {
    /// As it is called on the command line.
    fn word(self) -> &'static str {
        let name = self.name();
        name.strip_suffix(".rfm").unwrap_or(name)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Obstacle => "obstacle.rfm",
            Self::Experiment => "experiment.rfm",
            Self::Validation => "validation.rfm",
        }
    }

    /// The text, in which `FILE` stands for the name of the file.
    fn text(self) -> &'static str {
        match self {
            Self::Obstacle => include_str!("obstacle.rfm"),
            Self::Experiment => include_str!("experiment.rfm"),
            Self::Validation => include_str!("validation.rfm"),
        }
    }

    /// The first command to try.
    fn first_command(self) -> &'static str {
        match self {
            Self::Obstacle => "check",
            Self::Experiment | Self::Validation => "run",
        }
    }
}

pub(super) fn run(options: &Init) -> Result<(), Failure> {
    let path = options.file.clone().unwrap_or_else(|| PathBuf::from(options.template.name()));
    if let Some(template) =
        Template::value_variants().iter().find(|template| path.as_os_str() == template.word())
    {
        let (word, name) = (template.word(), template.name());
        return Err(Failure::usage(format!(
            "`{word}` is a template: rfm init {name} --template {word}; for a file of this name: rfm init ./{word}"
        )));
    }
    if path.as_os_str() == "-" {
        say!("{}", options.template.text().trim_end());
        return Ok(());
    }
    let shown = path.shown();
    if path.exists() && !options.force {
        return Err(Failure::usage(format!(
            "`{shown}` is there already: name another file, or replace it with --force"
        )));
    }
    let text = options.template.text().replace("FILE", &shown);
    output::write(&path, |out| out.write_all(text.as_bytes()))?;
    say!("written to {shown}; go on with: rfm {} {shown}", options.template.first_command());
    Ok(())
}
