//! What a scene states of its pictures, as `summary.json` keeps it for the pictures that are made later.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::scenery::half;
use rfm::lower::{Opening, Picture};
use rfm::render::Cut;
use rfm::view::{Outset, OutsetCut};

/// The block `picture` of a scene; null and empty where it states nothing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Stated {
    /// The direction from the scene to the eye.
    pub camera: Option<[f64; 3]>,
    /// The place in the middle, m.
    pub look_at: Option<[f64; 3]>,
    pub zoom: Option<f64>,
    /// Whether lines that are parallel stay so.
    pub parallel: bool,
    pub cut: StatedCut,
    /// The speed at the end of the colours, m/s.
    pub fastest: Option<f64>,
    /// The names of obstacles that are not drawn, and of those that are drawn clear.
    pub hide: Vec<String>,
    pub glass: Vec<String>,
}

/// What is taken away of obstacles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum StatedCut {
    #[default]
    Auto,
    None,
    /// The half of space on one side of a plane.
    Half {
        axis: Across,
        /// Where the plane meets the axis, m.
        at: f64,
        /// Whether the part at smaller coordinates is taken away.
        below: bool,
    },
}

/// The axis that a plane lies across.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Across {
    X,
    Y,
    Z,
}

impl Across {
    const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

impl Stated {
    pub fn of(picture: &Picture) -> Self {
        let cut = match picture.cut {
            Opening::Automatic => StatedCut::Auto,
            Opening::None => StatedCut::None,
            Opening::Half { axis, at, below } => StatedCut::Half { axis: Across::ALL[axis], at, below },
        };
        Self {
            camera: picture.camera.map(|camera| camera.to_array()),
            look_at: picture.look_at.map(|at| at.to_array()),
            zoom: picture.zoom,
            parallel: picture.parallel,
            cut,
            fastest: picture.fastest,
            hide: picture.hide.clone(),
            glass: picture.glass.clone(),
        }
    }

    /// How large the picture is, if that is a size that a scene may state.
    pub fn zoom(&self) -> Option<f64> {
        self.zoom.filter(|zoom| Picture::ZOOMS.contains(zoom))
    }

    /// How a page begins that shows the scene.
    pub fn outset(&self) -> Outset {
        let cut = match self.cut {
            StatedCut::Auto | StatedCut::None => None,
            StatedCut::Half { axis, at, below } => Some(OutsetCut { axis: axis.index(), at, below }),
        };
        Outset {
            camera: self.camera.filter(|camera| *camera != [0.0; 3]),
            look_at: self.look_at,
            zoom: self.zoom(),
            parallel: self.parallel,
            cut,
            obstacle: match self.cut {
                StatedCut::Auto => None,
                StatedCut::None | StatedCut::Half { .. } => Some("opaque"),
            },
            hide: self.hide.clone(),
            glass: self.glass.clone(),
        }
    }
}

impl StatedCut {
    /// The cut at a plane, if one is stated.
    pub fn plane(self) -> Option<Cut> {
        match self {
            Self::Auto | Self::None => None,
            Self::Half { axis, at, below } => Some(half(DVec3::AXES[axis.index()], at, below)),
        }
    }
}
