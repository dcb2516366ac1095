//! Progress on standard error, never part of the output: a bar on a terminal, and elsewhere a line for every
//! tenth of the work that takes longer than a few seconds.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rfm::mesh::Watch;

/// Work that is mostly over sooner shows no bar before.
const MOMENT: Duration = Duration::from_millis(700);

/// Work that is over sooner needs no lines.
const FIRST_LINE: Duration = Duration::from_secs(3);

/// The progress of work whose length is known.
pub(super) struct Progress {
    what: &'static str,
    length: u64,
    started: Instant,
    position: AtomicU64,
    /// Tenths of the work that are done and were printed.
    tenths: AtomicU64,
    message: Mutex<String>,
    /// `None` where there is no terminal, and lines are printed.
    bar: Option<ProgressBar>,
    /// Whether the bar is hidden until the work has lasted a moment.
    is_late: AtomicBool,
}

/// The progress of work over `length` steps, with a text that the caller keeps up to date.
pub(super) fn bar(length: u64, what: &'static str) -> Progress {
    let bar = std::io::stderr().is_terminal().then(|| ProgressBar::new(length));
    progress(length, what, bar)
}

/// The progress of work that reports shares of itself, see [`Watch`].
pub(super) fn shares(what: &'static str) -> Progress {
    bar(1000, what)
}

/// The progress of work that is mostly over at once, and reports shares of itself: a bar on a terminal if it lasts longer
/// than a moment, and nothing elsewhere.
pub(super) fn late_shares(what: &'static str) -> Progress {
    let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::hidden());
    let own = progress(1000, what, Some(bar));
    Progress { is_late: std::io::stderr().is_terminal().into(), ..own }
}

fn progress(length: u64, what: &'static str, bar: Option<ProgressBar>) -> Progress {
    if let Some(bar) = &bar {
        let template = "{prefix:>10} {wide_bar:.cyan/blue} {percent:>3} %  {msg}  {elapsed} < {eta}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_prefix(what);
        bar.enable_steady_tick(Duration::from_millis(200));
    }
    let (started, message) = (Instant::now(), Mutex::default());
    let position = AtomicU64::new(0);
    let (tenths, is_late) = (AtomicU64::new(0), AtomicBool::new(false));
    Progress { what, length, started, position, tenths, message, bar, is_late }
}

impl Progress {
    /// Several threads may call this at once.
    pub fn inc(&self, steps: u64) {
        let position = self.position.fetch_add(steps, Ordering::Relaxed) + steps;
        self.show(position);
    }

    pub fn position(&self) -> u64 {
        self.position.load(Ordering::Relaxed)
    }

    pub fn set_position(&self, position: u64) {
        self.position.store(position, Ordering::Relaxed);
        self.show(position);
    }

    fn show(&self, position: u64) {
        match &self.bar {
            Some(bar) => {
                if self.started.elapsed() >= MOMENT && self.is_late.swap(false, Ordering::Relaxed) {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                }
                bar.set_position(position);
            }
            None => self.tell(position),
        }
    }

    pub fn set_message(&self, message: String) {
        match &self.bar {
            Some(bar) => bar.set_message(message),
            None => *self.message.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = message,
        }
    }

    /// Prints something else without the bar in its way.
    pub fn suspend<R>(&self, print: impl FnOnce() -> R) -> R {
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    pub fn finish_and_clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// Prints a line if one more tenth is done.
    fn tell(&self, position: u64) {
        let spent = self.started.elapsed();
        let Some(tenths) = self.tenths_to_tell(position, spent) else { return };
        let left = spent.as_secs_f64() * (self.length as f64 / position as f64 - 1.0);
        let message = self.message.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let message = if message.is_empty() { String::new() } else { format!(", {message}") };
        anstream::eprintln!("{}: {} %{message}, about {} left", self.what, 10 * tenths, duration(left));
    }

    /// The tenths that are done, if they were not reported before. Those of the first seconds are not
    /// reported.
    fn tenths_to_tell(&self, position: u64, spent: Duration) -> Option<u64> {
        let tenths = (10 * u128::from(position)).checked_div(self.length.into()).unwrap_or(0).min(9) as u64;
        let is_new = spent >= FIRST_LINE && self.tenths.fetch_max(tenths, Ordering::Relaxed) < tenths;
        is_new.then_some(tenths)
    }
}

impl Watch for Progress {
    fn progress(&self, done: f64) {
        self.set_position((self.length as f64 * done) as u64);
    }
}

/// Progress that never goes back, whatever part of the work reports it.
pub(super) struct Forwards<'a>(pub &'a Progress);

impl Watch for Forwards<'_> {
    fn progress(&self, done: f64) {
        let position = (self.0.length as f64 * done) as u64;
        let before = self.0.position.fetch_max(position, Ordering::Relaxed);
        self.0.show(position.max(before));
    }
}

/// A duration of some seconds in a readable form: `45 s`, `12 min`, `3.4 h`, `12 days`.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "1 s".to_string(),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} h", s / 3600.0),
        s if s < 3.15e8 => format!("{:.0} days", s / 86_400.0),
        s if s < 3.156e11 => format!("{:.0} years", s / 3.156e7),
        s => format!("{:.0e} years", s / 3.156e7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tenth_is_told_once() {
        let progress = progress(1000, "running", None);
        let told = |position, seconds| progress.tenths_to_tell(position, Duration::from_secs(seconds));
        assert_eq!([told(50, 1), told(150, 2), told(180, 4), told(190, 5)], [None, None, Some(1), None]);
        assert_eq!(
            [told(450, 6), told(449, 7), told(1000, 9), told(1000, 9)],
            [Some(4), None, Some(9), None]
        );
    }

    #[test]
    fn a_part_that_begins_anew_does_not_take_progress_back() {
        let shares = late_shares("checking");
        for done in [0.3, 0.7, 0.1] {
            Forwards(&shares).progress(done);
        }
        assert_eq!(shares.position(), 700);
        let shown = shares.bar.as_ref().map(|bar| (bar.position(), bar.length()));
        assert_eq!(shown, Some((700, Some(1000))));
    }

    #[test]
    fn durations_have_the_unit_of_their_size() {
        let shown = [0.2, 45.0, 600.0, 9e3, 9e5, 1e9, 3.5e15].map(duration);
        assert_eq!(shown, ["1 s", "45 s", "10 min", "2.5 h", "10 days", "32 years", "1e8 years"]);
    }
}
