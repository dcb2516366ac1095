//! The simulation on its own thread: it takes commands, advances, and puts what is new on the board.
//!
//! Invariant: an error of the file leaves the last good run as it is; it is shown beside it until the file is
//! mended.

mod loading;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::super::failure::Failure;
use super::super::shared::Shared;
use super::board::{Board, Status, Topic};
use super::command::{Command, settled};
use super::course::Course;
use super::making::Making;
use super::mesher::Mesher;
use super::model::{Checked, Detail, Stamp, Standing, Subject};
use super::options::View;
use super::section;
use rfm::Solid;
use rfm::geom::Aabb;
use rfm::slice::Plane;

/// Time between looks at the file, and the longest time for which a command waits while nothing runs.
const LOOK: Duration = Duration::from_millis(100);

/// Time of the clock between frames.
const FRAME: Duration = Duration::from_millis(33);

/// Time of the clock between plots.
const PLOTS: Duration = Duration::from_millis(250);

/// A file that is missing this many times in a row, every [`LOOK`], is gone.
const MISSED: u32 = 4;

/// Pause of a simulation that is ahead of the clock, and of one that waits for what another thread makes.
const BREATH: Duration = Duration::from_millis(4);

/// A file that is viewed.
pub(super) struct Session {
    subject: Subject,
    board: Arc<Board>,
    /// Values of params that pages have set.
    values: BTreeMap<String, f64>,
    /// Those of them with which the obstacles are shown, and those of the present run: values that the file refuses
    /// give way to them.
    shown_with: BTreeMap<String, f64>,
    runs_with: BTreeMap<String, f64>,
    mesher: Mesher,
    /// The run that is being prepared, and that which is prepared next.
    preparing: Option<Making<Prepared>>,
    next: Option<(Checked, Aabb)>,
    stamp: Stamp,
    /// How often the file was not there when it was looked for.
    missed: u32,
    checked: Option<Checked>,
    /// The fluid or solid that changes in time; `None` if the file has none.
    course: Option<Course>,
    status: Status,
    /// What stands in the scene as it is shown, and the box around it.
    standing: Option<Standing>,
    /// The plane in which a page looks at ω.
    plane: Option<Plane>,
    /// Gravity in the box, m/s², if a page has turned it.
    gravity: Option<DVec3>,
    pace: Pace,
    /// The number of the present run.
    run: u64,
}

/// A run that can begin, with the values of params and the box of its scene.
struct Prepared {
    checked: Checked,
    bounds: Aabb,
    values: BTreeMap<String, f64>,
    course: Result<Option<Course>, String>,
}

/// How the simulated time follows the clock.
struct Pace {
    /// An instant of the clock and the simulated time then, s.
    from: (Instant, f64),
    seconds_per_step: f64,
    mesh: MeshShown,
    /// The run whose mesh is carried along and has been shown.
    carried: Option<u64>,
    /// When the plots were last sent.
    plots: Instant,
}

/// The last mesh of a moving obstacle.
struct MeshShown {
    /// When it was made, and how long that took.
    at: Instant,
    took: Duration,
    /// The simulated time that it belongs to, s. Not a number before the first one of a run.
    time: f64,
}

impl Session {
    /// Reads the file for the first time, and starts the thread. Its end of the channel takes commands.
    pub fn start(shared: &Shared, options: &View, board: Arc<Board>) -> Result<Sender<Command>, Failure> {
        let now = Instant::now();
        let session = Self {
            subject: Subject::new(shared, options),
            board,
            values: BTreeMap::new(),
            shown_with: BTreeMap::new(),
            runs_with: BTreeMap::new(),
            mesher: Mesher::new(),
            preparing: None,
            next: None,
            stamp: None,
            missed: 0,
            checked: None,
            course: None,
            status: Status { speed: 1.0, ..Status::default() },
            standing: None,
            plane: None,
            gravity: None,
            pace: Pace {
                from: (now, 0.0),
                seconds_per_step: 0.0,
                mesh: MeshShown { at: now, took: Duration::ZERO, time: f64::NAN },
                carried: None,
                plots: now,
            },
            run: 0,
        };
        // a page that is asked for before the first run needs something to show
        let checked = session.subject.checked(&session.values).ok();
        let bounds = checked.as_ref().and_then(|checked| session.subject.domain(checked).ok());
        let bounds = bounds.unwrap_or(Aabb::new(DVec3::ZERO, DVec3::ONE));
        session.board.set_setting(session.subject.setting(checked.as_ref(), &bounds, None));
        let (send, receive) = channel();
        thread::Builder::new()
            .name("rfm-simulation".into())
            .spawn(move || session.go(&receive))
            .map_err(|error| Failure::usage(format!("cannot start a thread: {error}")))?;
        Ok(send)
    }

    /// Runs until no more commands can arrive.
    fn go(mut self, commands: &Receiver<Command>) {
        self.stamp = self.subject.stamp();
        self.load();
        self.status.playing = self.course.as_ref().is_some_and(Course::begins_by_itself);
        self.tell();
        let mut looked = Instant::now();
        let mut waited = false;
        loop {
            // a simulation without viewers waits, and does not make up for that later
            let is_watched = self.board.is_watched();
            if is_watched && waited {
                self.follow_clock();
            }
            waited = !is_watched;
            let advances = self.status.playing && is_watched && self.preparing.is_none();
            let wait = match advances {
                true if self.is_ahead() => BREATH,
                true => Duration::ZERO,
                false if self.preparing.is_some() || self.mesher.is_busy() => BREATH,
                false => LOOK,
            };
            let first = match commands.recv_timeout(wait) {
                Ok(command) => Some(command),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => return,
            };
            let list: Vec<Command> = first.into_iter().chain(commands.try_iter()).collect();
            for command in settled(list) {
                self.obey(command);
            }
            if looked.elapsed() >= LOOK {
                looked = Instant::now();
                self.reload_if_changed();
            }
            self.take_what_is_made();
            if self.status.playing && is_watched && self.preparing.is_none() && !self.is_ahead() {
                self.advance();
            }
        }
    }

    fn obey(&mut self, command: Command) {
        if command.needs_run() {
            self.await_run();
        }
        match command {
            Command::Play => {
                if self.course.as_ref().is_some_and(Course::has_ended) {
                    self.restart();
                }
                self.status.playing = self.course.is_some();
                self.follow_clock();
            }
            Command::Pause => {
                self.status.playing = false;
                self.show_obstacles();
                self.show_plots();
            }
            Command::Step => {
                self.status.playing = false;
                self.steps(self.frame_time(), |_| true);
            }
            Command::Restart => self.restart(),
            Command::Reset => {
                self.values.clear();
                self.shown_with.clear();
                self.begin_load();
            }
            Command::Try { name, value } if self.may_set(&name, value) => {
                let mut values = self.values.clone();
                values.insert(name, value);
                self.show_mesh(&values, Detail::Passing);
            }
            Command::Set { name, value } if self.may_set(&name, value) => {
                self.values.insert(name, value);
                self.begin_load();
            }
            Command::Unset { name } => match self.values.remove(&name) {
                Some(_) => self.begin_load(),
                // the page has nothing in its field
                None => self.board.repeat_setting(),
            },
            // a page that has not yet heard of a change of the file
            Command::Try { .. } | Command::Set { .. } => {}
            Command::Solid { name } => {
                let before = self.subject.choose(Some(name));
                self.load();
                if self.status.error.is_some() {
                    self.subject.choose(before);
                } else {
                    self.status.playing = self.course.as_ref().is_some_and(Course::begins_by_itself);
                    self.follow_clock();
                }
            }
            Command::Gravity { vector } => {
                let gravity = DVec3::from_array(vector);
                if gravity.is_finite() {
                    self.gravity = Some(gravity);
                    self.course.iter_mut().for_each(|course| course.set_gravity(gravity));
                }
            }
            Command::Slice { axis, at } => {
                let plane = axis.map(|axis| Plane::new(axis.into(), at));
                self.plane = plane.filter(|plane| plane.value.is_finite());
                if self.plane.is_none() {
                    self.board.clear(Topic::Slice);
                }
                self.show_slice(self.time());
            }
            Command::Speed { value } => {
                if value.is_finite() && value > 0.0 {
                    self.status.speed = value;
                    self.follow_clock();
                }
            }
            Command::Seen => {}
        }
        self.tell();
    }

    fn may_set(&self, name: &str, value: f64) -> bool {
        value.is_finite() && self.checked.as_ref().is_some_and(|checked| checked.has_param(name))
    }

    fn reload_if_changed(&mut self) {
        let stamp = self.subject.stamp();
        if stamp.is_none() {
            // an editor may have taken the file away for a moment
            self.missed += 1;
            if self.missed == MISSED {
                let title = self.subject.title();
                self.status.error =
                    Some(format!("`{title}` is not there any more: the last picture of it remains"));
                // what comes back is read
                self.stamp = None;
                self.tell();
            }
            return;
        }
        self.missed = 0;
        if stamp == self.stamp {
            return;
        }
        self.stamp = stamp;
        self.announce("reading the file");
        self.subject.forget();
        self.mesher.forget();
        if let Ok(plain) = self.subject.checked(&BTreeMap::new()) {
            self.values.retain(|name, value| plain.admits(name, *value));
            if self.subject.checked(&self.values).is_err() {
                // a file without mistakes is shown, whatever a page has set before
                self.values.clear();
            }
        }
        self.begin_load();
        self.tell();
    }

    /// Begins the present experiment again.
    fn restart(&mut self) {
        let Some(course) = &mut self.course else { return };
        match course.restart() {
            Ok(()) => {
                self.status.error = None;
                let room = course.room();
                self.begin(&room);
            }
            Err(error) => self.status.error = Some(error),
        }
    }

    /// Shows the first instant of a run.
    fn begin(&mut self, bounds: &Aabb) {
        self.run += 1;
        if self.course.as_ref().and_then(Course::flow).is_none() {
            // a fluid that the file no longer has must not be seen by a page that is opened now
            self.board.clear(Topic::Frame);
            self.board.clear(Topic::Plots);
            self.status.text.clear();
        }
        self.board.set_setting(self.subject.setting(self.checked.as_ref(), bounds, self.course.as_ref()));
        if let (Some(course), Some(gravity)) = (&mut self.course, self.gravity) {
            course.set_gravity(gravity);
        }
        self.pace.seconds_per_step = 0.0;
        self.pace.mesh.time = f64::NAN;
        self.follow_clock();
        self.show_frame();
        self.show_plots();
    }

    fn follow_clock(&mut self) {
        self.pace.from = (Instant::now(), self.time());
    }

    /// The simulated time, s.
    fn time(&self) -> f64 {
        self.course.as_ref().map_or(0.0, Course::time)
    }

    /// Shows ω at a time, s, in the plane that is asked for.
    fn show_slice(&mut self, time: f64) {
        let (Some(plane), Some(standing)) = (self.plane, &self.standing) else { return };
        let solids: Vec<Solid> = standing.solids.iter().map(|solid| solid.at(time)).collect();
        match section::block(&solids, &standing.domain, plane, self.run) {
            Ok(Some(block)) => self.board.set_block(Topic::Slice, block),
            // a scene without obstacles has no ω
            Ok(None) => {}
            Err(error) => self.status.error = Some(error),
        }
    }

    /// The simulated time that belongs to the present instant of the clock, s.
    fn due(&self) -> f64 {
        let (since, time) = self.pace.from;
        time + since.elapsed().as_secs_f64() * self.status.speed
    }

    fn is_ahead(&self) -> bool {
        self.course.as_ref().is_none_or(|course| match course {
            Course::Fluid(_) => course.time() >= self.due(),
            // a step takes no time, so there is one for each picture
            Course::Solid(_) => course.time() + self.frame_time() > self.due(),
        })
    }

    /// The simulated time between pictures, s.
    fn frame_time(&self) -> f64 {
        FRAME.as_secs_f64() * self.status.speed
    }

    /// Goes on for as long as a frame lasts.
    fn advance(&mut self) {
        let began = Instant::now();
        let due = self.due();
        self.steps(due - self.time(), |time| began.elapsed() >= FRAME || time >= due);
        if self.time() < due {
            // what could not be computed in time is not made up for later
            self.follow_clock();
        }
        self.tell();
    }

    /// Takes steps, at least one, until `is_enough` of the simulated time, and shows the instant. `by` is the
    /// time, s, by which something without steps of its own advances.
    fn steps(&mut self, by: f64, is_enough: impl Fn(f64) -> bool) {
        let Some(course) = self.course.as_mut().filter(|course| !course.has_ended()) else { return };
        loop {
            let began = Instant::now();
            if let Err(error) = course.step(by) {
                self.status.error = Some(error);
                self.status.playing = false;
                break;
            }
            let spent = began.elapsed().as_secs_f64();
            let mean = &mut self.pace.seconds_per_step;
            *mean = if *mean > 0.0 { 0.9 * *mean + 0.1 * spent } else { spent };
            if is_enough(course.time()) || course.has_ended() {
                break;
            }
        }
        course.sample();
        self.status.playing &= !course.has_ended();
        self.show_frame();
        if !self.status.playing || self.pace.plots.elapsed() >= PLOTS {
            self.show_plots();
        }
    }

    /// Shows what is known of the quantities over time.
    fn show_plots(&mut self) {
        if let Some(flow) = self.course.as_ref().and_then(Course::flow) {
            self.board.set_plots(flow.history.plots());
            self.pace.plots = Instant::now();
        }
    }

    /// Shows what moves where it stands now, unless it is shown so already.
    fn show_obstacles(&mut self) {
        let Some(course) = &self.course else { return };
        let time = course.time();
        if !course.moves() || self.pace.mesh.time == time {
            return;
        }
        let began = Instant::now();
        if course.is_carried() {
            if self.pace.carried != Some(self.run)
                && let Some(mesh) = course.carried(self.run)
            {
                self.board.set_block(Topic::Carried, mesh);
                self.pace.carried = Some(self.run);
            }
        } else {
            // a page forgets what was carried as soon as it is given this
            self.pace.carried = None;
            match course.mesh(self.run) {
                Ok(mesh) => self.board.set_block(Topic::Mesh, mesh),
                Err(error) => self.status.error = Some(error),
            }
        }
        self.show_slice(time);
        self.pace.mesh = MeshShown { at: Instant::now(), took: began.elapsed(), time };
    }

    fn show_frame(&mut self) {
        // while it plays, meshes of what moves may take as much time as frames do
        let MeshShown { at, took, .. } = self.pace.mesh;
        let is_new = self.pace.carried.is_none() && self.course.as_ref().is_some_and(Course::is_carried);
        if !self.status.playing || is_new || at.elapsed() > 2 * took {
            self.show_obstacles();
        }
        let Some(course) = &self.course else { return };
        self.board.set_block(Topic::Frame, course.frame(self.run));
    }

    /// Reports that something takes a while from now on.
    fn announce(&mut self, doing: &str) {
        self.status.text = doing.into();
        self.board.set_status(&self.status);
    }

    fn tell(&mut self) {
        let state = self.course.as_ref().map_or_else(String::new, |course| {
            if self.preparing.is_some() {
                return "the run is prepared".into();
            }
            let doing = if self.status.playing { "running" } else { "paused" };
            format!("{doing}{}", course.details(self.pace.seconds_per_step))
        });
        if self.checked.is_some() || self.status.error.is_some() {
            self.status.text = state;
        }
        self.board.set_status(&self.status);
    }
}
