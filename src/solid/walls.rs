//! A solid as a fluid meets it.

use glam::DVec3;

use super::construction::Solid;
use super::contact::Contact;
use crate::field::{Entry, Face, Faces, Moving, Part, Path, Walls};
use crate::geom::Placement;

impl Solid {
    /// Where the straight path between two points first meets the solid; ω = 0 counts as met.
    ///
    /// During a stretch of time, see [`Solid::between`], time passes evenly along the path. It is proven that
    /// nothing of the path before the entry is in the solid, and that a path without an entry does not touch
    /// it, however thin the solid and long the path.
    pub fn first_entry(&self, from: DVec3, to: DVec3) -> Option<Entry> {
        Walls::first_entry(self, &Path::new(from, to, f64::INFINITY))
    }
}

impl Walls for Solid {
    fn first_entry(&self, path: &Path) -> Option<Entry> {
        self.twin().first_entry(path)
    }

    fn on_path(&self, path: &Path, t: f64) -> f64 {
        self.then(t).omega(path.at(t))
    }

    fn wall_velocity(&self, p: DVec3) -> DVec3 {
        self.wall_velocity(p)
    }

    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        match self.parts() {
            Some(parts) => parts.leaves.add_faces(&parts.words, 0, p, reach, faces),
            None => {
                let Contact { distance, normal, mean_curvature } = self.contact(p);
                if distance < reach {
                    faces.push(Part::Face(Face { distance, normal, mean_curvature }));
                }
            }
        }
    }
}

impl Moving for Solid {
    fn during(&self, from: f64, to: f64) -> Box<dyn Walls> {
        Box::new(self.between(from, to))
    }

    fn moves(&self) -> bool {
        self.moves()
    }

    fn placement(&self, time: f64) -> Option<Placement> {
        self.placement(time)
    }
}
