//! Reads the solution that is known of a flow.

use super::super::lowering::Lowering;
use super::declaration::{SceneKey, declare_keys};
use super::run::times_as_written;
use super::{Block, Truth};
use crate::diagnostic::{Code, Diagnostic};

declare_keys! {
    /// Keys of a truth.
    mod keys {
        PRESSURE = "pressure", Formulas(Dimension::PRESSURE), Text("not compared"),
            "the pressure, by a formula of x, y, z and t";
        VELOCITY = "velocity", Formulas(Dimension::SPEED), Text("not compared"),
            "the velocity, by three formulas of x, y, z and t";
        FRONT = "front", Formulas(Dimension::LENGTH), Text("not compared"),
            "how far along x the fluid has come on the floor, by a formula of t";
        FROM = "from", Number(Dimension::TIME, Bound::NotNegative), Is(0.0),
            "the time from which on this holds";
    }
}

impl<'a> Lowering<'a> {
    /// Reads the truth of a scene whose run ends at `until`, s, if that is known.
    pub(super) fn truth(&mut self, block: &Block<'_>, until: Option<f64>) -> Option<Option<Truth>> {
        let Some((_, entries, span)) = block.blocks("truth").next() else { return Some(None) };
        let block = self.block(entries, "a truth", span, keys::ALL, &[]);
        let mut formula = |key: &SceneKey| match block.setting(key.name) {
            Some((_, value)) => {
                let found = self.expr(value);
                Some(Some((self.as_number(&found, value.span)?, value.span)))
            }
            None => Some(None),
        };
        let (pressure, front) = (formula(&keys::PRESSURE)?.map(|(node, _)| node), formula(&keys::FRONT)?);
        if let Some((node, span)) = front
            && self.depends_on_place(node)
        {
            let message = "`front` may depend on the time t, not on the place";
            self.report(Diagnostic::error(Code::NOT_CONSTANT, span, message));
            return None;
        }
        let front = front.map(|(node, _)| node);
        let velocity = match block.setting(keys::VELOCITY.name) {
            Some((_, value)) => Some(self.components(value, &keys::VELOCITY)?),
            None => None,
        };
        if pressure.is_none() && velocity.is_none() && front.is_none() {
            let help = "write `pressure: 1000*9.81*(1 - z)`, `velocity: [..]` or `front: 2*t`";
            self.missing(&block, keys::PRESSURE.name, help);
            return None;
        }
        let from = self.number_key(&block, &keys::FROM)?;
        if let (Some(until), Some((_, value))) = (until, block.setting(keys::FROM.name))
            && from > until
        {
            let [from, until] = times_as_written([from, until]);
            let message = format!("the solution holds from {from} on, and the run ends at {until}");
            self.report(
                Diagnostic::warning(Code::NOTHING_COMPARED, value.span, message)
                    .at("nothing is compared with it")
                    .help("state an earlier `from`, or a later `until` in the block `run`"),
            );
        }
        Some(Some(Truth { pressure, velocity, front, from }))
    }
}
