//! The flags of `rfm render`.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::DVec3;

use super::film::{Kind, Target};
use crate::cli::failure::Failure;
use crate::cli::scenery::Viewpoint;
use crate::cli::values::{
    CutFlag, Frames, camera, cells, count, cut, frames, point, range, seconds, size, times, zoom,
};
use rfm::render::{ColourMap, Material};

/// How the surface of the fluid looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Surface {
    /// What is in the fluid is seen
    Clear,
    /// What is in the fluid is hidden
    Opaque,
}

impl Surface {
    /// What its mesh is made of.
    pub fn material(self) -> Material {
        match self {
            Self::Clear => Material::ClearWater,
            Self::Opaque => Material::Water,
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "A run as a film:             rfm render out -o pawn.gif\n\
                        Every fifth frame, by name:  rfm render out -o frames --every 5\n\
                        One frame for a paper:       rfm render out -o pawn.png --frames 40 --size 2400x1600 --colours viridis\n\
                        Closer, from the left:       rfm render out -o near.mp4 --camera=-1,-0.3,0.2 --look-at 1.5,1.5,0.5 --zoom 3\n\
                        By pressure, fixed range:    rfm render out -o p.gif --by pressure --range 0..5000\n\
                        The surface of the water:    rfm mesh out --fluid, then rfm render out -o water.gif --surface=opaque\n\
                        What stands in the water:    rfm render out -o in.png --frames 40 --cut y=1.5 --cut-fluid\n\
                        Through a clear vessel:      rfm render out -o bowl.png --frames 40 --glass bowl\n\
                        A solid:                     rfm render examples/pawn.rfm -o pawn.png\n\
                        A solid that moves:          rfm render examples/paddle.rfm -o paddle.gif --times 0..2\n\n\
                        The folder is that of `rfm run`, finished or not: its frames, obstacle.vtp and summary.json are read, so \
                        nothing is computed again. What the scene states in `picture { … }` holds where no flag says otherwise. All pictures of a command have one camera, one range of colours and the same \
                        cut. .png, .gif and .apng are built in and have the same bytes for any number of threads; .mp4 and .webm \
                        are made by the program `ffmpeg`, which must be installed. A .gif has 255 colours, an .apng has all.")]
pub(in crate::cli) struct Render {
    /// The folder of a run; or a file, of which a solid is shown
    #[arg(value_name = "DIR|FILE")]
    pub subject: PathBuf,
    /// A file .gif, .apng, .mp4 or .webm, or .png for one picture; or a folder, for a .png of each frame
    /// [default: DIR/render, or SOLID.png]
    #[arg(short, long, value_name = "FILE|DIR")]
    pub output: Option<PathBuf>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: (u32, u32),
    /// Direction from the scene to the eye; also as the viewer copies it, with the place in the middle and the size:
    /// "picture { camera: [0.5, -1, 0.4], look_at: [1, 1, 0.5], zoom: 2 }" [default: 0.48,-1,0.46]
    #[arg(long, value_name = "X,Y,Z", value_parser = camera, allow_hyphen_values = true)]
    pub camera: Option<Viewpoint>,
    /// The place in the middle of the picture [default: that of --camera, or the middle of the box]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub look_at: Option<DVec3>,
    /// How many times as large as if the whole box were seen [default: that of --camera, or 1]
    #[arg(long, value_name = "FACTOR", value_parser = zoom)]
    pub zoom: Option<f64>,
    /// Keep parallel lines parallel, so that lengths across the view can be measured in the picture
    #[arg(long)]
    pub parallel: bool,
    /// Cut obstacles and the surface of the fluid open at a plane, the side towards the eye being taken away; `auto` cuts
    /// obstacles that hide much of the fluid of the first frame, `none` none [default: auto; of a solid none]
    #[arg(long, value_name = "AXIS=VALUE|auto|none", value_parser = cut)]
    pub cut: Option<CutFlag>,
    /// Leave out the particles on that side, too: what stands in the fluid is seen
    #[arg(long, help_heading = "Runs", requires = "cut")]
    pub cut_fluid: bool,
    /// The text over the picture [default: the run, its scene and what was cut]
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Do not draw an obstacle; may be repeated
    #[arg(long, help_heading = "Runs", value_name = "NAME", value_delimiter = ',')]
    pub hide: Vec<String>,
    /// Draw an obstacle as clear glass, so that the fluid behind it is seen; a plane of --cut opens it; may be repeated
    #[arg(long, help_heading = "Runs", value_name = "NAME", value_delimiter = ',')]
    pub glass: Vec<String>,
    /// Draw the surface of the fluid, which `rfm mesh DIR --fluid` makes, in place of the particles: `clear` shows what is in
    /// the fluid, `opaque` does not [default without a word: clear]
    #[arg(long, help_heading = "Runs", value_name = "LOOK", num_args = 0..=1, require_equals = true, default_missing_value = "clear", value_enum)]
    pub surface: Option<Surface>,
    /// Draw the particles, too, within the surface
    #[arg(long, help_heading = "Runs", requires = "surface")]
    pub particles: bool,
    /// Colour particles by this array of the frames, or by "velocity x", and the surface if there is one [default: speed,
    /// and water]
    #[arg(long, help_heading = "Runs", value_name = "ARRAY")]
    pub by: Option<String>,
    /// The values at the ends of the colours, in SI units [default: those of the chosen frames without the outermost
    /// thousandth; speeds begin at 0]
    #[arg(long, help_heading = "Runs", value_name = "LOW..HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<(f64, f64)>,
    /// The map of colours [default: blue-yellow-red]
    #[arg(long, help_heading = "Runs", value_name = "MAP", value_parser = colour_map())]
    pub colours: Option<ColourMap>,
    /// Only these frames, counted from 0; B is the first that is left out [default: all]
    #[arg(long, help_heading = "Runs", value_name = "A..B", value_parser = frames)]
    pub frames: Option<Frames>,
    /// Only frames of these times, in seconds or with units: 0.5..2, 500ms..; of a solid that moves, the times of the film
    /// [default: all frames; 0..2 for a solid]
    #[arg(long, value_name = "A..B", value_parser = times, conflicts_with = "frames", allow_hyphen_values = true)]
    pub times: Option<(f64, f64)>,
    /// Only every n-th of them
    #[arg(long, help_heading = "Runs", value_name = "N", value_parser = count)]
    pub every: Option<usize>,
    /// Pictures in a second of a film, and of the motion of a solid [default: 25]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240))]
    pub fps: Option<u32>,
    /// The solid [default: the only one, or the first obstacle of the scene]
    #[arg(short, long, help_heading = "Solids", value_name = "NAME")]
    pub solid: Option<String>,
    /// Time at which a moving solid is shown, in seconds or with a unit [default: 0]
    #[arg(long, help_heading = "Solids", value_name = "TIME", value_parser = seconds, allow_negative_numbers = true)]
    pub time: Option<f64>,
    /// Cells of its mesh along the longest side [default: 128]
    #[arg(long, help_heading = "Solids", value_name = "N", value_parser = cells, allow_negative_numbers = true)]
    pub mesh_cells: Option<usize>,
}

/// Pictures in a second of a film.
const RATE: u32 = 25;

impl Render {
    /// Where the pictures go.
    ///
    /// # Errors
    /// The name tells no kind of pictures.
    pub(super) fn target(&self, path: PathBuf) -> Result<Target, Failure> {
        let kind = Kind::of(&path)?;
        Ok(Target { path, kind, size: self.size, rate: self.fps.unwrap_or(RATE) })
    }

    /// The first flag that is given and means something for runs alone.
    pub fn flag_of_runs(&self) -> Option<&'static str> {
        let given = [
            ("--hide", !self.hide.is_empty()),
            ("--glass", !self.glass.is_empty()),
            ("--cut-fluid", self.cut_fluid),
            ("--surface", self.surface.is_some()),
            ("--by", self.by.is_some()),
            ("--range", self.range.is_some()),
            ("--colours", self.colours.is_some()),
            ("--frames", self.frames.is_some()),
            ("--every", self.every.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(flag, _)| flag)
    }

    /// The first flag that is given and means nothing for one picture.
    pub fn flag_of_films(&self) -> Option<&'static str> {
        let given = [("--times", self.times.is_some()), ("--fps", self.fps.is_some())];
        given.into_iter().find(|(_, given)| *given).map(|(flag, _)| flag)
    }

    /// The first flag that is given and means something for solids alone.
    pub fn flag_of_solids(&self) -> Option<&'static str> {
        let given = [
            ("--solid", self.solid.is_some()),
            ("--time", self.time.is_some()),
            ("--mesh-cells", self.mesh_cells.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(flag, _)| flag)
    }
}

fn colour_map() -> impl TypedValueParser<Value = ColourMap> {
    let unknown = "clap lets only the names of maps through";
    PossibleValuesParser::new(ColourMap::ALL.map(ColourMap::name))
        .try_map(move |name| ColourMap::ALL.into_iter().find(|map| map.name() == name).ok_or(unknown))
}
