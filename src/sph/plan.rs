//! Which passes a simulation runs, and why it leaves out the others.

use std::borrow::Cow;

use super::methods::Method;
use super::params::Parameters;
use super::pass::Pass;

/// All passes in the order of a step, each with the reason if it does not run.
pub(super) fn plan(
    parameters: &Parameters,
    obstacles: usize,
    has_gravity: bool,
) -> Vec<(Pass, Option<Cow<'static, str>>)> {
    let unless = |needed: bool, reason: &'static str| (!needed).then_some(reason);
    let of_all_methods = [
        (Pass::Integrate, None),
        (Pass::Walls, None),
        (Pass::Obstacles, unless(obstacles > 0, "the scene has no obstacle")),
        (Pass::Neighbours, None),
        (Pass::Gravity, unless(has_gravity, "gravity is zero")),
    ];
    let own = parameters.method.passes(&parameters.scales());
    let mut plan: Vec<(Pass, Option<Cow<'static, str>>)> = of_all_methods
        .into_iter()
        .chain(own)
        .map(|(pass, reason)| (pass, reason.map(Cow::Borrowed)))
        .collect();
    for method in Method::all() {
        for pass in method.info().passes {
            if !plan.iter().any(|(known, _)| *known == pass) {
                plan.push((pass, Some(Cow::Owned(belongs(pass)))));
            }
        }
    }
    plan.sort_by_key(|(pass, _)| *pass);
    plan
}

/// Why a method that does not declare the pass does not run it: names the methods that have it.
fn belongs(pass: Pass) -> String {
    let has_pass = |method: &Method| method.info().passes.contains(&pass);
    let names: Vec<&str> = Method::all().iter().filter(|m| has_pass(m)).map(Method::name).collect();
    let methods = if names.len() == 1 { "method" } else { "methods" };
    format!("it belongs to the {methods} {}", names.join(" and "))
}
