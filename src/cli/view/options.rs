//! The flags of `rfm view`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::cli::values::{Frames, cells, count, frames};

/// How a page shows surfaces of the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Surfaces {
    /// With so little detail that they take no more bytes than the particles
    Small,
    /// With details of half the spacing of the particles; they take several times as many bytes
    Fine,
    /// Not at all
    None,
}

#[derive(Debug, Args)]
#[command(after_help = "A run, while it is computed:  rfm view examples/pawn.rfm\n\
                        A run that is saved:          rfm view examples/pawn.out\n\
                        A solid, moving if it does:   rfm view examples/paddle.rfm -s stirrer\n\
                        One file for a colleague:     rfm view examples/pawn.out --save pawn.html\n\
                        From another machine:         ssh -L 8000:127.0.0.1:8000 HOST rfm view examples/pawn.rfm --no-open --port 8000\n\n\
                        The page is served on this machine alone, at an address with a token that nobody can guess; keep it to \
                        yourself. A file is read again whenever it changes. A simulation waits while no page is open. Ctrl-C ends \
                        the viewer.")]
pub(in crate::cli) struct View {
    /// A file, whose scene is simulated and whose solids are shown; or the folder of a run
    #[arg(value_name = "FILE|DIR")]
    pub subject: PathBuf,
    /// The scene [default: the only one]
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Show this solid instead of a scene [default: the last solid of a file without scenes]
    #[arg(short, long, value_name = "NAME", conflicts_with = "scene")]
    pub solid: Option<String>,
    /// Cells of the obstacle's mesh along its longest side
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = cells, allow_negative_numbers = true)]
    pub mesh_cells: usize,
    /// Write one file that shows the run in any browser, and open nothing; - is standard output
    #[arg(long, help_heading = "Runs", value_name = "FILE")]
    pub save: Option<PathBuf>,
    /// Only these frames of a run, counted from 0; B is the first that is left out [default: all]
    #[arg(long, help_heading = "Runs", value_name = "A..B", value_parser = frames)]
    pub frames: Option<Frames>,
    /// Only every n-th frame of a run
    #[arg(long, help_heading = "Runs", value_name = "N", default_value = "1", value_parser = count)]
    pub every: usize,
    /// Surfaces of the fluid that `rfm mesh DIR --fluid` has made
    #[arg(long, help_heading = "Runs", value_name = "DETAIL", default_value = "small")]
    pub surfaces: Surfaces,
    /// Address to serve at; others than this machine's own let others connect, if they have the token
    #[arg(long, help_heading = "Server", value_name = "HOST", default_value = "127.0.0.1")]
    pub host: String,
    /// Port to serve at [default: a free one]
    #[arg(
        long,
        help_heading = "Server",
        value_name = "PORT",
        default_value_t = 0,
        hide_default_value = true
    )]
    pub port: u16,
    /// Print the address and open no browser
    #[arg(long, help_heading = "Server")]
    pub no_open: bool,
}
