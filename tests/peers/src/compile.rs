//! Compile times: from a text, or from Fidget's expressions, to the first answer.

use std::hint::black_box;
use std::time::Instant;

use fidget::context::Tree;
use fidget::jit::JitShape;
use rfm::codegen::Form;
use rfm::glam::DVec3;

use crate::fidget as peer;
use crate::measure::Points;
use crate::ours;

/// Duration of a task in milliseconds: ours, and Fidget's if it has a counterpart.
pub struct Time {
    pub what: String,
    pub ours: f64,
    pub fidget: Option<f64>,
}

/// Keeps an unused result from being optimised away.
fn keep<T>(answer: T) {
    black_box(answer);
}

/// Times both sides in turn and keeps the fastest of each. A text is read on a thread of its own, and on a
/// busy machine the start of a thread may have to wait for longer than the whole work takes.
fn time(what: &str, turns: usize, mut ours: impl FnMut(), mut fidget: Option<&mut dyn FnMut()>) -> Time {
    let mut times = [Vec::new(), Vec::new()];
    let clock = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64() * 1e3
    };
    for _ in 0..turns {
        if let Some(fidget) = &mut fidget {
            times[1].push(clock(*fidget));
        }
        times[0].push(clock(&mut ours));
    }
    let [ours, theirs] = times.map(|list| list.into_iter().fold(f64::INFINITY, f64::min));
    Time { what: what.into(), ours, fidget: fidget.map(|_| theirs) }
}

/// Times for one obstacle, each from the very beginning to one answer.
pub fn times(title: &str, turns: usize, text: &str, name: &str, tree: &dyn Fn() -> Tree) -> Vec<Time> {
    let points = Points::random(8, 3.0, 3);
    let centre = DVec3::splat(1.5);
    let solid = || ours::solid_lazily(text, name, Form::Stable);
    let mut value = || {
        let shape = JitShape::from(tree());
        peer::raw(&shape)(&points, None);
    };
    let mut gradient = || {
        let shape = JitShape::from(tree());
        peer::raw_grad(&shape)(&points, None);
    };
    let mut one = || {
        let shape = JitShape::from(tree());
        peer::point(&shape)(&points, None);
    };
    let mut everything = || {
        let shape = JitShape::from(tree());
        peer::raw(&shape)(&points, None);
        peer::raw_grad(&shape)(&points, None);
        peer::point(&shape)(&points, None);
        black_box(peer::range(&shape)([[0.0, 1.0]; 3]));
    };
    let say = |what: &str| format!("{title}, {what}");
    vec![
        time(&say("text read, no program"), turns, || keep(solid()), None),
        time(&say("ω at one point"), turns, || keep(solid().omega(centre)), Some(&mut one)),
        time(&say("ω, f32 batch"), turns, || ours::value::<f32>(&solid())(&points, None), Some(&mut value)),
        time(&say("sign, f64 batch"), turns, || ours::sign::<f64>(&solid())(&points, None), None),
        time(
            &say("ω and ∇ω, f32 batch"),
            turns,
            || ours::gradient::<f32>(&solid())(&points, None),
            Some(&mut gradient),
        ),
        time(&say("contact, f64 batch"), turns, || ours::contact::<f64>(&solid())(&points, None), None),
        time(
            &say("range of one box"),
            turns,
            || keep(ours::range(&solid(), false)([[0.0, 1.0]; 3])),
            Some(&mut || keep(peer::range(&JitShape::from(tree()))([[0.0, 1.0]; 3]))),
        ),
        time(
            &say("all programs that a run needs"),
            turns,
            || {
                let solid = solid();
                black_box((solid.omega(centre), solid.omega_grad(centre), solid.sign(centre)));
                ours::value::<f64>(&solid)(&points, None);
                ours::gradient::<f64>(&solid)(&points, None);
                ours::sign::<f64>(&solid)(&points, None);
                ours::contact::<f64>(&solid)(&points, None);
                black_box(ours::range(&solid, false)([[0.0, 1.0]; 3]));
            },
            Some(&mut everything),
        ),
    ]
}
