//! The mesh of what stands in a scene: a sharp one if it takes no time, or else a rough one at once and the sharp one
//! later.

use std::time::{Duration, Instant};

use super::super::deadline::Deadline;
use super::super::run::bodies::Bodies;
use super::course::packed;
use super::making::{Making, Wanted};
use super::messages::message;
use super::model::{Detail, Standing};
use rfm::mesh::Watch;

/// What nobody takes for waiting, s.
const AT_ONCE: f64 = 0.1;

/// Most cells along the longest side of a sharp mesh that is shown while a slider moves.
const PASSING_CELLS: usize = 40;

/// Most cells along the longest side of a rough mesh.
const ROUGH_CELLS: usize = 64;

/// What is left to be made, with the instant at which it was asked for.
struct Sharp {
    making: Making<Result<Vec<u8>, String>>,
    asked: Instant,
}

/// Makes meshes, and remembers whether they take long.
pub(super) struct Mesher {
    /// A sharp mesh that takes longer than this is preceded by a rough one, s.
    at_once: f64,
    is_slow: bool,
    sharp: Option<Sharp>,
}

impl Mesher {
    pub fn new() -> Self {
        Self { at_once: AT_ONCE, is_slow: false, sharp: None }
    }

    /// Forgets how long meshes take: the file is another one.
    pub fn forget(&mut self) {
        self.is_slow = false;
    }

    /// The block of the mesh of solids as they stand, with at most the given number of cells along the longest side of
    /// each. If it is a rough one that stays, the sharp one follows.
    ///
    /// # Errors
    /// Why there is no mesh.
    pub fn mesh(
        &mut self,
        standing: &Standing,
        cells: usize,
        detail: Detail,
        run: u64,
    ) -> Result<Vec<u8>, String> {
        self.sharp = None;
        let asked = Instant::now();
        let time = standing.time;
        let bodies = |cells| Bodies::of(standing.solids.clone(), standing.domain, cells);
        let sharp = bodies(match detail {
            Detail::Passing => cells.min(PASSING_CELLS),
            Detail::Lasting => cells,
        });
        if detail == Detail::Lasting && sharp.move_about() {
            // the sharp mesh is what moves from now on
            let meshes = sharp.meshes_at(time).map_err(message)?;
            self.is_slow = asked.elapsed().as_secs_f64() > self.at_once;
            return Ok(packed(&meshes, time, run));
        }
        if !self.is_slow {
            let watch = Deadline::after(self.at_once);
            match sharp.meshes_while(time, &watch).map_err(message)? {
                Some(meshes) => {
                    // some of the work may not look at the watch
                    self.is_slow = watch.is_over();
                    return Ok(packed(&meshes, time, run));
                }
                None => self.is_slow = true,
            }
        }
        let rough = bodies(cells.min(ROUGH_CELLS)).rough_meshes_at(time).map_err(message)?;
        if detail == Detail::Lasting {
            let make = move |wanted: &Wanted| {
                let meshes = sharp.meshes_while(time, wanted).map_err(message)?;
                // without a mesh nobody wants one
                Ok(packed(&meshes.unwrap_or_default(), time, run))
            };
            let making = Making::begin(make).map_err(|error| format!("cannot start a thread: {error}"))?;
            self.sharp = Some(Sharp { making, asked });
        }
        Ok(packed(&rough, time, run))
    }

    /// Whether a sharp mesh will follow.
    pub fn is_busy(&self) -> bool {
        self.sharp.is_some()
    }

    /// The block of the sharp mesh that was to follow, and how long it took, once it is there.
    pub fn finished(&mut self) -> Option<(Result<Vec<u8>, String>, Duration)> {
        let sharp = self.sharp.as_ref()?;
        let made = sharp.making.finished()?;
        let took = sharp.asked.elapsed();
        self.sharp = None;
        self.is_slow = took.as_secs_f64() > self.at_once;
        Some((made.unwrap_or_else(|_| Err("the sharp mesh of the obstacle failed".into())), took))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use rfm::geom::Aabb;
    use rfm::{Engine, Program};
    use std::thread;

    fn triangles(block: &[u8]) -> u64 {
        let length = u32::from_le_bytes(block[..4].try_into().unwrap()) as usize;
        let head: serde_json::Value = serde_json::from_slice(&block[4..4 + length]).unwrap();
        head["triangles"].as_u64().unwrap()
    }

    #[test]
    fn a_rough_mesh_comes_at_once_and_the_sharp_one_of_what_stays_follows() {
        let program = Program::from_source("a.rfm", "rfm 1\nsolid s = sphere(1) \\ x >= 0.3\n").unwrap();
        let solid = program.solid_with("s", Engine::Interpreter).unwrap();
        let domain = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
        let standing = Standing { solids: vec![solid], domain, way: None, time: 0.0 };
        let mut patient = Mesher { at_once: 1e9, ..Mesher::new() };
        let sharp = triangles(&patient.mesh(&standing, 24, Detail::Lasting, 0).unwrap());
        assert!(!patient.is_busy() && !patient.is_slow);
        let mut mesher = Mesher { at_once: 0.0, ..Mesher::new() };
        let rough = triangles(&mesher.mesh(&standing, 24, Detail::Lasting, 0).unwrap());
        assert!(rough != sharp && mesher.is_busy() && mesher.is_slow);
        let made = loop {
            match mesher.finished() {
                Some((made, _)) => break made.unwrap(),
                None => thread::yield_now(),
            }
        };
        assert_eq!(triangles(&made), sharp);
        assert!(!mesher.is_busy());
        // what passes is not followed by anything
        let passing = triangles(&mesher.mesh(&standing, 24, Detail::Passing, 0).unwrap());
        assert_eq!((passing, mesher.is_busy()), (rough, false));
    }
}
