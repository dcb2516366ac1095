//! Ranges of params without the unit that the value has, as in `param a = 45 deg in 0 .. 90`.

use super::lowering::Lowering;
use super::module::ParamValue;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{Expr, Param};

/// A range whose ends have no unit, although the value of the param has one other than that of SI.
pub(super) struct BareRange {
    /// The ends in SI units, as they stand.
    stated: [f64; 2],
    /// The ends in SI units if they are read in the unit of the value.
    in_unit: [f64; 2],
    /// The range as it is to be written.
    meant: String,
    /// What is to be written.
    pub(super) help: String,
}

impl Lowering<'_> {
    /// The range of a param if an end of it lacks the unit that the value has. `None` if the value in the file would lie
    /// outside the range in that unit: then SI units are meant, as in `20 mm in 0.01 .. 0.1`.
    pub(super) fn bare_range(
        &self,
        param: &Param,
        given: &ParamValue,
        stated: Option<f64>,
    ) -> Option<BareRange> {
        let (unit, text) = given.unit.as_ref().filter(|(unit, _)| unit.factor != 1.0)?;
        let ((low, high), (from, to)) = (given.range?, param.range.as_ref()?);
        // zero is zero in every unit
        let lacks = |end: f64, written: &Expr| end != 0.0 && self.is_bare(written);
        let ends = [(low, from), (high, to)];
        if !ends.iter().any(|(end, written)| lacks(*end, written)) {
            return None;
        }
        let in_unit = ends.map(|(end, written)| if lacks(end, written) { end * unit.factor } else { end });
        let is_meant = stated.is_some_and(|value| (in_unit[0]..=in_unit[1]).contains(&value));
        let written = |end: f64, expr: &Expr| match self.written(expr) {
            Some(number) if number.parse::<f64>().is_ok() => format!("{number} {text}"),
            Some(other) if !self.is_bare(expr) => other.to_string(),
            Some(_) | None => format!("{end} {text}"),
        };
        let (name, value) = (&param.name.text, self.written(&param.value).unwrap_or("…"));
        let meant = format!("{} .. {}", written(low, from), written(high, to));
        let help =
            format!("numbers without a unit are in SI units: write `param {name} = {value} in {meant}`");
        is_meant.then_some(BareRange { stated: [low, high], in_unit, meant, help })
    }

    /// Warns of a range that lacks the unit of the value. A value outside the range as it stands is an error of its own.
    pub(super) fn warn_of_bare_range(&mut self, param: &Param, given: &ParamValue, range: &BareRange) {
        let Some((from, to)) = &param.range else { return };
        let [low, high] = range.stated.map(|end| given.shown(end));
        let at = from.span.to(to.span);
        let message = format!("the range of `{}` has no unit: it is {low} .. {high}", given.name);
        let warning = Diagnostic::warning(Code::BARE_RANGE, at, message)
            .label(param.value.span, "the value has one")
            .help(&range.help);
        let warning = match self.written_at(at) {
            Some(written) => {
                let written = written.to_string();
                warning.edit(at, written, &range.meant, false)
            }
            None => warning,
        };
        self.report(warning);
    }
}

impl BareRange {
    /// The ends in SI units if they are read in the unit of the value.
    pub(super) fn in_unit(&self) -> (f64, f64) {
        (self.in_unit[0], self.in_unit[1])
    }

    /// Whether the range as it stands holds a value, in SI units.
    pub(super) fn holds(&self, value: f64) -> bool {
        let [low, high] = self.stated;
        low <= value && value <= high
    }
}
