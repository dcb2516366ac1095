//! Reads how long a scene runs, and what is saved of it.

use super::super::lowering::Lowering;
use super::declaration::declare_keys;
use super::{Block, Run, Scene};
use crate::diagnostic::{Code, Diagnostic, Span};

declare_keys! {
    /// Keys of a run.
    mod keys {
        DT = "dt", Number(Dimension::TIME, Bound::Positive), Text("as long as is stable"),
            "the length of every step";
        UNTIL = "until", Number(Dimension::TIME, Bound::Positive), Is(5.0),
            "the simulated time at which the run ends";
        SAVE_EVERY = "save_every", Number(Dimension::TIME, Bound::Positive), Is(0.05),
            "the simulated time between frames";
        CHECKPOINT_EVERY = "checkpoint_every", Number(Dimension::TIME, Bound::Positive), Text("with every frame"),
            "the simulated time between checkpoints, from which a run goes on";
    }
}

/// More frames or checkpoints get a warning.
const MANY: f64 = 20_000.0;

impl<'a> Lowering<'a> {
    pub(super) fn run(&mut self, block: &Block<'_>) -> Option<Run> {
        let (_, entries, span) = block.blocks("run").next().unwrap_or((None, &[], block.span));
        let block = self.block(entries, "a run", span, keys::ALL, &[]);
        let dt = self.stated_number(&block, &keys::DT);
        let checkpoint_every = self.stated_number(&block, &keys::CHECKPOINT_EVERY);
        let until = self.number_key(&block, &keys::UNTIL);
        let save = self.number_key(&block, &keys::SAVE_EVERY);
        let run = Run {
            dt: dt?,
            dt_span: block.setting(keys::DT.name).map(|(_, value)| value.span),
            until: until?,
            save_every: save?,
            checkpoint_every: checkpoint_every?,
        };
        if let (Some(every), Some((_, value))) =
            (run.checkpoint_every, block.setting(keys::CHECKPOINT_EVERY.name))
            && every > run.until
        {
            let [until, every] = times_as_written([run.until, every]);
            let message = format!("a checkpoint every {every} in a run of {until}: only its end is saved");
            let help =
                "a run that is interrupted saves one too; without this key there is one with every frame";
            self.report(Diagnostic::warning(Code::FRAMES, value.span, message).help(help));
        }
        if let (Some(every), Some((_, value))) =
            (run.checkpoint_every, block.setting(keys::CHECKPOINT_EVERY.name))
            && run.until / every > MANY
        {
            let count = run.until / every;
            let [until, every] = times_as_written([run.until, every]);
            let message = format!("{until} with a checkpoint every {every} are {count:.3e} checkpoints");
            let help = "each holds all particles and takes the place of an older one: without this key there is one with \
                        every frame";
            self.report(Diagnostic::warning(Code::FRAMES, value.span, message).help(help));
        }
        let stated = block
            .setting(keys::SAVE_EVERY.name)
            .or(block.setting(keys::UNTIL.name))
            .map_or(span, |(_, value)| value.span);
        self.frames_fit(&run, stated).then_some(run)
    }

    /// Reports frames that would fill a disk, and warns of frames so rare that there are none.
    fn frames_fit(&mut self, run: &Run, at: Span) -> bool {
        let frames = run.until / run.save_every;
        let [until, every] = times_as_written([run.until, run.save_every]);
        let fewer = format!("write for example `save_every: {}`", seconds_as_written(run.until / 100.0));
        if frames > Scene::MOST_FRAMES as f64 {
            let message = format!(
                "{until} with a frame every {every} are {frames:.3e} frames; at most {} are saved",
                Scene::MOST_FRAMES
            );
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, at, message).help(fewer));
            return false;
        }
        if frames > MANY {
            let message = format!("{until} with a frame every {every} are {frames:.0} frames");
            self.report(Diagnostic::warning(Code::FRAMES, at, message).help(fewer));
        } else if run.save_every > run.until {
            let message =
                format!("a frame every {every} in a run of {until}: only its start and its end are saved");
            self.report(Diagnostic::warning(Code::FRAMES, at, message).help(fewer));
        }
        true
    }
}

/// Two times as a file writes them, with as many digits as tell them apart, and two at least.
pub(in crate::lower) fn times_as_written(times: [f64; 2]) -> [String; 2] {
    let with = |digits: usize| times.map(|time| written_with(digits, time));
    (2..ALL_DIGITS).map(with).find(|[a, b]| a != b).unwrap_or_else(|| with(ALL_DIGITS))
}

/// Digits that tell any two numbers apart.
const ALL_DIGITS: usize = 17;

/// A time as a file writes it, with two digits: `50 ms`, `0.2 s`.
pub(in crate::lower) fn seconds_as_written(time: f64) -> String {
    written_with(2, time)
}

fn written_with(digits: usize, time: f64) -> String {
    let rounded = |value: f64| format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    if time < 0.1 && time > 1e-5 {
        format!("{} ms", rounded(1e3 * time))
    } else {
        format!("{} s", rounded(time))
    }
}
