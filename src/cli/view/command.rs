//! What a page may ask of the simulation.

use rfm::slice::Axis;
use serde::Deserialize;

/// A command of a page, as JSON: `{"do": "set", "name": "cx", "value": 1.2}`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "lowercase")]
pub(super) enum Command {
    /// Go on.
    Play,
    /// Stay at this instant.
    Pause,
    /// Take one step.
    Step,
    /// Begin again.
    Restart,
    /// Give params the values of the file.
    Reset,
    /// Show the obstacle with another value of a param, in SI units; the run goes on as it is.
    Try { name: String, value: f64 },
    /// Begin again with another value of a param.
    Set { name: String, value: f64 },
    /// Begin again with the value that the file gives a param.
    Unset { name: String },
    /// Show another solid of a file without a scene.
    Solid { name: String },
    /// Let gravity act in this direction from now on, m/s².
    Gravity { vector: [f64; 3] },
    /// Show ω in the plane across an axis at a coordinate, m; in none without an axis.
    Slice { axis: Option<SliceAxis>, at: f64 },
    /// Show the given number of simulated seconds in a second, if the machine is fast enough.
    Speed { value: f64 },
    /// The page has taken a message and is ready for another one.
    Seen,
}

/// The axis that a slice lies across.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum SliceAxis {
    X,
    Y,
    Z,
}

impl From<SliceAxis> for Axis {
    fn from(axis: SliceAxis) -> Self {
        match axis {
            SliceAxis::X => Self::X,
            SliceAxis::Y => Self::Y,
            SliceAxis::Z => Self::Z,
        }
    }
}

impl Command {
    /// Whether it is about the run of the values that were set last, which may still be prepared.
    pub fn needs_run(&self) -> bool {
        match self {
            Self::Play | Self::Pause | Self::Step | Self::Restart | Self::Solid { .. } => true,
            Self::Reset
            | Self::Try { .. }
            | Self::Set { .. }
            | Self::Unset { .. }
            | Self::Gravity { .. }
            | Self::Slice { .. }
            | Self::Speed { .. }
            | Self::Seen => false,
        }
    }
}

/// Leaves out commands that later ones undo: a slider sends many values, and only the last one counts.
pub(super) fn settled(commands: Vec<Command>) -> Vec<Command> {
    let is_undone = |command: &Command, later: &[Command]| {
        later.iter().any(|other| match (command, other) {
            (
                Command::Try { name, .. },
                Command::Try { name: again, .. }
                | Command::Set { name: again, .. }
                | Command::Unset { name: again },
            )
            | (
                Command::Set { name, .. } | Command::Unset { name },
                Command::Set { name: again, .. } | Command::Unset { name: again },
            ) => name == again,
            (Command::Gravity { .. }, Command::Gravity { .. })
            | (Command::Slice { .. }, Command::Slice { .. })
            | (Command::Solid { .. }, Command::Solid { .. })
            | (Command::Speed { .. }, Command::Speed { .. }) => true,
            _ => false,
        })
    };
    let kept = commands.iter().enumerate().filter(|(i, command)| !is_undone(command, &commands[i + 1..]));
    kept.map(|(_, command)| command.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_or_refused() {
        let read = |text: &str| serde_json::from_str::<Command>(text).ok();
        assert_eq!(read(r#"{"do":"play"}"#), Some(Command::Play));
        let set = Command::Set { name: "cx".into(), value: 1.5 };
        assert_eq!(read(r#"{"do":"set","name":"cx","value":1.5}"#), Some(set));
        assert_eq!(read(r#"{"do":"unset","name":"cx"}"#), Some(Command::Unset { name: "cx".into() }));
        let slice = Command::Slice { axis: Some(SliceAxis::Z), at: 0.25 };
        assert_eq!(read(r#"{"do":"slice","axis":"z","at":0.25}"#), Some(slice));
        for text in [
            "",
            r#"{"do":"slice","axis":"w","at":1}"#,
            "{}",
            r#"{"do":"erase"}"#,
            r#"{"do":"set","name":"cx"}"#,
            r#"{"do":"set","name":1,"value":"x"}"#,
        ] {
            assert_eq!(read(text), None, "{text}");
        }
    }

    #[test]
    fn of_a_slider_the_last_value_counts() {
        let tried = |value| Command::Try { name: "a".into(), value };
        let set = |name: &str, value| Command::Set { name: name.into(), value };
        let list = vec![tried(1.0), Command::Play, tried(2.0), set("b", 1.0), set("a", 3.0), Command::Play];
        assert_eq!(settled(list), [Command::Play, set("b", 1.0), set("a", 3.0), Command::Play]);
        let unset = || Command::Unset { name: "a".into() };
        assert_eq!(settled(vec![set("a", 1.0), unset()]), [unset()]);
        assert_eq!(settled(vec![unset(), tried(1.0), set("a", 1.0)]), [set("a", 1.0)]);
    }
}
