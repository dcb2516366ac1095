//! The flags of `rfm report`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::cli::sweep::options::{Again, SweepOptions};
use crate::cli::values::{cells, count};
use rfm::sph::Method;

#[derive(Debug, Clone, Args)]
#[command(after_help = "A solid is judged by exact arithmetic:  rfm report examples/pawn.rfm -o pawn.svg\n\
                        A scene by its `truth`, at growing resolution:\n  \
                        rfm report examples/validation/free_fall.rfm:free_fall --particles 125,1000 \
                        --methods wcsph,dfsph -o fall.svg\n\
                        All in a page for others:            rfm report examples/pawn.rfm --html pawn.html")]
pub(in crate::cli) struct Report {
    /// The file, with the name of a solid or a scene if it has several; `-` is standard input
    #[arg(value_name = "FILE[:NAME]")]
    pub subject: String,
    /// The solid [default: the only one, or the first obstacle of the scene]
    #[arg(short, long, value_name = "NAME")]
    pub solid: Option<String>,
    /// Plot speed against error, or the error of a flow against its cost: .svg or .png
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Plot the error of meshes against their cells: .svg or .png
    #[arg(long, value_name = "FILE")]
    pub mesh_plot: Option<PathBuf>,
    /// Write all of it as one page: tables, plots, pictures, the .rfm files, the machine and the command. It needs no
    /// network
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Cells along the longest side of the finest mesh; the others have half as many each
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = cells, allow_negative_numbers = true)]
    pub mesh_cells: usize,
    #[command(flatten)]
    pub flow: Flow,
    #[command(flatten)]
    pub sweep: SweepOptions,
    #[command(flatten)]
    pub again: Again,
}

/// How a flow is measured.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Flows")]
pub(in crate::cli) struct Flow {
    /// Run the scene with so many particles, by its `param particles` [default: 1/16, 1/4 and all of what the
    /// file states]
    #[arg(long, value_name = "N,N,…", value_delimiter = ',', value_parser = count, conflicts_with_all = ["solid", "mesh_plot"])]
    pub particles: Vec<usize>,
    /// Run the scene by these methods, without keys that only its own method has [default: its own]
    #[arg(long, value_parser = flow_method(), value_delimiter = ',', conflicts_with_all = ["solid", "mesh_plot"])]
    pub methods: Vec<Method>,
}

/// A method of the solver by its name.
fn flow_method() -> impl TypedValueParser<Value = Method> {
    let names = Method::all().into_iter().map(|method| {
        let info = method.info();
        PossibleValue::new(info.name).help(info.title)
    });
    let unknown = "clap lets only the names of methods through";
    PossibleValuesParser::new(names).try_map(move |name| Method::named(&name).ok_or(unknown))
}
