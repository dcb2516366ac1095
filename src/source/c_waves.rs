//! Sine and cosine of files in C: the operations of `codegen::sine`, with its constants, so that loops over columns are
//! vectorised.
//!
//! Like those of the machine code, they leave some arguments to the mathematical library: there they give NaN.

use crate::codegen::sine::{double, quadrants, single};
use crate::precision::Precision;

/// What is left of |u| in `f64` without its multiple of π/2, and its error.
const DOUBLE_REDUCED: &str = "x = abs(u)
multiple = (x * {quarters} + {to_whole}) - {to_whole}
rest = x - multiple * {quarter}
rest_tail = multiple * {quarter_tail}
y = rest - rest_tail
tail = (rest - y) - rest_tail
size = abs(y)
is_rare? = (size < x * {cancelled}) | !(size <= {next_quadrant})
z = y * y
w = z * z
";

const DOUBLE_KERNELS: &str = "sine_low = {s1} + z * ({s2} + z * {s3})
r = sine_low + z * w * ({s4} + z * {s5})
cube = z * y
plain = cube * ({s0} + z * r)
exact = cube * {s0} - (z * (tail * {0.5} - cube * r) - tail)
sine = y + pick(multiple == {0}, plain, exact)
cosine_low = z * ({c0} + z * ({c1} + z * {c2}))
q = cosine_low + w * w * ({c3} + z * ({c4} + z * {c5}))
half = z * {0.5}
one_less_half = {1} - half
cosine = one_less_half + ((({1} - one_less_half) - half) + (z * q - y * tail))
";

/// In `f32`: large arguments are reduced in two steps.
const SINGLE_REDUCED: &str = "x = abs(u)
multiple = (x * {quarters} + {to_whole}) - {to_whole}
in_one_step = x - multiple * {quarter}
in_two_steps = (x - multiple * {quarter_head}) - multiple * {quarter_tail}
y = pick(x <= {one_step}, in_one_step, in_two_steps)
is_rare? = !(abs(y) <= {next_quadrant}) | (x > {largest})
z = y * y
w = z * z
";

const SINGLE_KERNELS: &str = "cube = z * y
sine_low = y + cube * ({s0} + z * {s1})
sine = sine_low + cube * w * ({s2} + z * {s3})
cosine_low = ({1} + z * {c0}) + w * {c1}
cosine = cosine_low + w * z * ({c2} + z * {c3})
";

/// The multiple without whole turns, from −2 to 2, and what it does to sizes and signs.
const QUADRANT: &str = "turned = multiple - {4} * ((multiple * {0.25} + {to_whole}) - {to_whole})
is_odd? = abs(turned) == {1}
";

const SINE: &str = "wave = pick(is_odd, cosine, sine)
turned_wave = pick((turned < {0}) | (turned == {2}), -wave, wave)
value = pick(is_rare, {nan}, copysign({1}, u) * turned_wave)
";

const COSINE: &str = "wave = pick(is_odd, sine, cosine)
turned_wave = pick((turned == {1}) | (abs(turned) == {2}), -wave, wave)
value = pick(is_rare, {nan}, turned_wave)
";

/// The one or the other of two functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wave {
    Sine,
    Cosine,
}

/// The formula of a function, line by line, see `operations`. All numbers but `u` are in `f64`.
pub(super) fn formula(wave: Wave, precision: Precision) -> String {
    let parts = match precision {
        Precision::F64 => [DOUBLE_REDUCED, DOUBLE_KERNELS, QUADRANT],
        Precision::F32 => [SINGLE_REDUCED, SINGLE_KERNELS, QUADRANT],
    };
    let last = match wave {
        Wave::Sine => SINE,
        Wave::Cosine => COSINE,
    };
    let text = parts.concat() + last;
    let named = |text: String, (name, value): (String, f64)| {
        text.replace(&format!("{{{name}}}"), &format!("{{{value:?}}}"))
    };
    constants(precision).into_iter().fold(text, named)
}

/// The constants by their names in the formulas.
fn constants(precision: Precision) -> Vec<(String, f64)> {
    let (named, sine, cosine) = match precision {
        Precision::F64 => (
            vec![
                ("quarter", double::QUARTER),
                ("quarter_tail", double::QUARTER_TAIL),
                ("cancelled", double::CANCELLED),
                ("next_quadrant", double::NEXT_QUADRANT),
            ],
            &double::SINE[..],
            &double::COSINE[..],
        ),
        Precision::F32 => (
            vec![
                ("quarter", single::QUARTER),
                ("quarter_head", single::QUARTER_HEAD),
                ("quarter_tail", single::QUARTER_TAIL),
                ("one_step", single::ONE_STEP),
                ("largest", single::LARGEST),
                ("next_quadrant", single::NEXT_QUADRANT),
            ],
            &single::SINE[..],
            &single::COSINE[..],
        ),
    };
    let both = [("quarters", quadrants::QUARTERS), ("to_whole", quadrants::TO_WHOLE)];
    let named = named.into_iter().chain(both).map(|(name, value)| (name.to_string(), value));
    let series = |letter: char, values: &'static [f64]| {
        values.iter().enumerate().map(move |(i, &value)| (format!("{letter}{i}"), value))
    };
    named.chain(series('s', sine)).chain(series('c', cosine)).collect()
}
