//! From a file and values for its params to obstacles at once, and to a run as soon as it is prepared.

use std::collections::BTreeMap;
use std::sync::mpsc::RecvError;
use std::time::Instant;

use super::super::board::Topic;
use super::super::course::Course;
use super::super::exact::Field;
use super::super::making::Making;
use super::super::model::{Checked, Detail};
use super::{Prepared, Session};
use rfm::geom::Aabb;

impl Session {
    /// Checks the file with values for params and shows its obstacles. `None` if that is not possible; the
    /// reason is then reported.
    pub(super) fn show_mesh(&mut self, values: &BTreeMap<String, f64>, detail: Detail) -> Option<Checked> {
        let began = Instant::now();
        // a moving solid continues from where it is
        let time = match &self.course {
            Some(course @ Course::Solid(_)) => course.time(),
            Some(Course::Fluid(_)) | None => 0.0,
        };
        let made = self.subject.checked(values).and_then(|checked| {
            let standing = self.subject.standing(&checked, time)?;
            let mesh = self.mesher.mesh(&standing, self.subject.cells(), detail, self.run)?;
            Ok((checked, mesh, standing))
        });
        match made {
            Ok((checked, mesh, standing)) => {
                // it takes the place of what was carried along
                self.board.clear(Topic::Carried);
                self.board.set_block(Topic::Mesh, mesh);
                self.pace.mesh.time = f64::NAN;
                self.pace.carried = None;
                self.status.error = None;
                let time = standing.time;
                self.standing = Some(standing);
                self.show_slice(time);
                self.status.latency =
                    Some(format!("the obstacle followed in {:.0} ms", began.elapsed().as_secs_f64() * 1e3));
                Some(checked)
            }
            Err(error) => {
                self.status.error = Some(error);
                None
            }
        }
    }

    /// Reads the file and begins a run; if that is not possible, the last one remains.
    pub(super) fn load(&mut self) {
        self.begin_load();
        self.await_run();
    }

    /// Reads the file and shows its obstacles. Its run is prepared meanwhile; the last one stands still until then.
    pub(super) fn begin_load(&mut self) {
        // what was wrong may have been mended, and looking takes a while
        self.status.error = None;
        self.announce("compiling");
        let values = self.values.clone();
        let (Some(checked), Some(standing)) = (self.show_mesh(&values, Detail::Lasting), &self.standing)
        else {
            // a file that was never right has no picture that could remain
            self.status.playing &= self.course.is_some();
            self.values = self.shown_with.clone();
            self.board.repeat_setting();
            return;
        };
        self.shown_with = values;
        if self.values.is_empty() {
            // no slider has moved it
            self.status.latency = None;
        }
        self.board.set_field(&Field::of(&checked, &standing.solids));
        let bounds = standing.domain;
        if self.preparing.is_some() {
            // one at a time
            self.next = Some((checked, bounds));
        } else {
            self.prepare(checked, bounds);
        }
    }

    /// Prepares a run of what is shown.
    fn prepare(&mut self, checked: Checked, bounds: Aabb) {
        let values = self.shown_with.clone();
        let Some(scene) = checked.scene.clone() else {
            let course = Ok(self.standing.as_ref().and_then(|standing| self.subject.motion(standing)));
            self.take(Prepared { checked, bounds, values, course });
            return;
        };
        let subject = self.subject.clone();
        let prepare = move |_: &_| {
            let course = subject.start(&checked, &scene).map(Some);
            Prepared { checked, bounds, values, course }
        };
        match Making::begin(prepare) {
            Ok(preparing) => self.preparing = Some(preparing),
            Err(error) => self.status.error = Some(format!("cannot start a thread: {error}")),
        }
    }

    /// Waits for the run that is prepared, if there is one, and begins it.
    pub(super) fn await_run(&mut self) {
        while let Some(preparing) = self.preparing.take() {
            self.take_prepared(preparing.wait());
        }
    }

    /// Takes what other threads have made.
    pub(super) fn take_what_is_made(&mut self) {
        if let Some((mesh, took)) = self.mesher.finished() {
            match mesh {
                Ok(mesh) => {
                    self.board.set_block(Topic::Mesh, mesh);
                    if let Some(latency) = &mut self.status.latency {
                        *latency += &format!(", with all edges in {:.0} ms", took.as_secs_f64() * 1e3);
                    }
                }
                Err(error) => self.status.error = Some(error),
            }
            self.tell();
        }
        if let Some(made) = self.preparing.as_ref().and_then(Making::finished) {
            self.preparing = None;
            self.take_prepared(made);
            self.tell();
        }
    }

    fn take_prepared(&mut self, made: Result<Prepared, RecvError>) {
        match (self.next.take(), made) {
            // meanwhile something else is wanted
            (Some((checked, bounds)), _) => self.prepare(checked, bounds),
            (None, Ok(prepared)) => self.take(prepared),
            (None, Err(_)) => self.status.error = Some("the run could not be prepared".into()),
        }
    }

    /// Begins a run that is prepared; if it cannot begin, the last one remains.
    fn take(&mut self, Prepared { checked, bounds, values, course }: Prepared) {
        match course {
            Ok(course) => {
                self.course = course;
                self.checked = Some(checked);
                self.runs_with = values;
                self.begin(&bounds);
            }
            Err(error) => {
                if self.values != self.runs_with {
                    // the values of the last run, and its obstacles with them
                    self.values.clone_from(&self.runs_with);
                    self.shown_with.clone_from(&self.runs_with);
                    self.show_mesh(&self.values.clone(), Detail::Lasting);
                }
                self.status.error = Some(error);
                // the last run remains, and its obstacles with it
                self.show_obstacles();
                // its params must be within reach, so that they can be set otherwise
                if self.checked.is_none() {
                    self.board.set_setting(self.subject.setting(Some(&checked), &bounds, None));
                    self.checked = Some(checked);
                } else {
                    self.board.repeat_setting();
                }
            }
        }
    }
}
