//! The methods and their keys as a page in Markdown, which `rfm explain --methods` prints.

use std::fmt::Write as _;

use super::declaration::{KeyInfo, MethodInfo, Support};
use super::{KeyBlock, Method};

/// A table with one row for each method: how it finds the pressure, and which keys it has.
pub fn methods_overview() -> String {
    let mut text = String::from(
        "| `method:` | pressure | kernel; neighbours | time step | keys of its own |\n|---|---|---|---|---|\n",
    );
    for MethodInfo { name, pressure, kernel, step, keys, .. } in Method::all().iter().map(Method::info) {
        let keys: Vec<String> = keys.iter().map(in_its_block).collect();
        let _ = writeln!(text, "| `{name}` | {pressure} | {kernel} | {step} | {} |", keys.join(", "));
    }
    text
}

/// The [`methods_overview`], followed by a section for each method with everything that it declares.
pub fn methods_reference() -> String {
    let mut text = format!(
        "# Methods of the solver\n\nThis page is what `rfm explain --methods` prints. A key that the method of a scene does \
         not have is an error.\n\n{}\n{VISCOUS_FORCES}",
        methods_overview()
    );
    for method in Method::all().iter().map(Method::info) {
        // writing to a String cannot fail
        let _ = section(&mut text, &method);
    }
    text
}

/// Which viscous forces a fluid has.
const VISCOUS_FORCES: &str = "\
Viscous forces of `wcsph` and `dfsph` act against all relative motion but the turning of each neighbourhood if the \
kinematic viscosity of the fluid is above a tenth of αhc/20, with the α that damps noise by default, the support \
radius h and the speed of sound c. Those of thinner fluids act along the lines between particles, and resist layers \
that slide along each other by only 0.76 to 0.93 of their viscosity.
";

/// The section of the [`methods_reference`] about one method.
pub fn method_reference(method: Method) -> String {
    let mut text = String::new();
    // writing to a String cannot fail
    let _ = section(&mut text, &method.info());
    text.trim_start().to_string()
}

fn section(text: &mut String, method: &MethodInfo) -> std::fmt::Result {
    let fluid = &method.fluid;
    writeln!(text, "\n## `{}`: {}\n", method.name, method.title)?;
    let length = |support| match support {
        Support::Metres(length) => format!("{length} m"),
        Support::Spacings(count) => format!("{count} particle spacings"),
    };
    let mut support = length(fluid.support);
    if let Some((other, when)) = method.other_support {
        write!(support, " ({} {when})", length(other))?;
    }
    writeln!(
        text,
        "Unless the scene says otherwise, viscosity is {} Pa·s, surface tension {} N/m, the support radius {support}, and \
         sums over neighbours are in {}.\n",
        fluid.viscosity,
        fluid.surface_tension,
        fluid.precision.name()
    )?;
    writeln!(text, "| key | unit | accepts | default | meaning |\n|---|---|---|---|---|")?;
    for key in &method.keys {
        let KeyInfo { about, unit, accepts, default, .. } = key;
        let (unit, key) = (unit.unwrap_or(""), in_its_block(key));
        writeln!(text, "| {key} | {unit} | {accepts} | {default} | {about} |")?;
    }
    let passes: Vec<&str> = method.passes.iter().map(|pass| pass.name()).collect();
    writeln!(text, "\nPasses: {}.", passes.join(", "))?;
    if !method.saves.is_empty() {
        writeln!(text, "A checkpoint also holds {}.", method.saves.join(", "))?;
    }
    Ok(())
}

/// A key as a scene writes it: keys of the solver stand within their block.
fn in_its_block(key: &KeyInfo) -> String {
    match key.block {
        KeyBlock::Fluid => format!("`{}`", key.name),
        KeyBlock::Solver => format!("`solver {{ {} }}`", key.name),
    }
}
