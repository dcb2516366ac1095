//! Promises of the product about its speed, each beside the figure that this run found.

use crate::compile::Time;
use crate::groups::{MAP_CONTACT, MAP_SIGN};
use crate::measure::Group;

/// One promise.
pub struct Bar {
    pub work: &'static str,
    pub says: String,
    /// `None` if the product cannot do it.
    pub found: Option<f64>,
    pub bar: Limit,
}

#[derive(Clone, Copy)]
pub enum Limit {
    AtMost(f64),
    AtLeast(f64),
}

impl Bar {
    pub fn passes(&self) -> bool {
        match (self.found, self.bar) {
            (None, _) => false,
            (Some(found), Limit::AtMost(bar)) => found <= bar,
            (Some(found), Limit::AtLeast(bar)) => found >= bar,
        }
    }
}

/// All measured results.
pub struct Found {
    pub groups: Vec<Group>,
    pub decided: Vec<(String, f64)>,
    pub ulps: Vec<(String, f64, f64)>,
    pub compile: Vec<Time>,
}

impl Found {
    fn group(&self, title: &str) -> Option<&Group> {
        self.groups.iter().find(|group| group.title.starts_with(title))
    }

    fn ratio(&self, title: &str, of: &str, to: &str) -> Option<f64> {
        self.group(title)?.ratio(of, to)
    }

    fn time(&self, title: &str, row: &str) -> Option<f64> {
        Some(self.group(title)?.find(row)?.median())
    }

    fn compile(&self, what: &str) -> Option<f64> {
        Some(self.compile.iter().find(|time| time.what == what)?.ours)
    }

    fn ulps(&self, name: &str) -> Option<(f64, f64)> {
        self.ulps.iter().find(|(row, ..)| row == name).map(|(_, value, weight)| (*value, *weight))
    }

    /// Number of signs that our sign programs got wrong, in all groups.
    fn wrong_signs(&self) -> f64 {
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        let ours = rows.filter(|row| row.name.starts_with("ours sign"));
        ours.filter_map(|row| row.errors.wrong_signs).map(|(wrong, _)| wrong as f64).sum()
    }

    /// Number of our gradients in the stable form that are not numbers, corners and edges included.
    fn nan_gradients(&self) -> f64 {
        let rows = self.groups.iter().flat_map(|group| &group.rows);
        let ours = rows.filter(|row| row.name.starts_with("ours") && row.name.contains("stable"));
        ours.map(|row| row.errors.nan + row.errors.nan_at_corners.map_or(0, |(nan, _)| nan)).sum::<usize>()
            as f64
    }

    /// Table of promises.
    pub fn bars(&self) -> Vec<Bar> {
        use Limit::{AtLeast, AtMost};
        let mut list = Vec::new();
        let mut bar = |work, says: &str, found, bar| list.push(Bar { work, says: says.into(), found, bar });

        let (pawn, hand) = ("pawn: ω", "hand textbook 128-bit f64");
        let work = "pawn ω, f64 batch";
        bar(work, "textbook / hand 128-bit", self.ratio(pawn, "ours textbook f64", hand), AtMost(1.05));
        bar(work, "stable / hand 128-bit", self.ratio(pawn, "ours stable f64", hand), AtMost(2.3));
        bar(work, "guarded / hand 128-bit", self.ratio(pawn, "ours guarded f64", hand), AtMost(1.3));

        let work = "pawn ω, f32 batch";
        let raw = "Fidget raw f32";
        let textbook = "ours textbook f32";
        bar(work, "textbook / Fidget raw", self.ratio(pawn, textbook, raw), AtMost(1.15));
        bar(work, "guarded / textbook", self.ratio(pawn, "ours guarded f32", textbook), AtMost(1.3));
        bar(work, "stable / textbook", self.ratio(pawn, "ours stable f32", textbook), AtMost(2.6));
        let api = self.ratio(pawn, "ours stable f32", "Fidget Shape API f32");
        bar(work, "stable / Fidget Shape API", api, AtMost(1.0));

        let work = "pawn sign, batch";
        let hand32 = "hand textbook 128-bit f32";
        bar(work, "f32 / hand ω 128-bit f32", self.ratio(pawn, "ours sign f32", hand32), AtMost(0.65));
        bar(work, "f64 / hand ω 128-bit f64", self.ratio(pawn, "ours sign f64", hand), AtMost(0.40));

        let work = "pawn ω+∇ω, batch";
        let grad = "pawn: ω and ∇ω";
        bar(work, "Fidget / stable f32", self.ratio(grad, raw, "ours stable f32"), AtLeast(6.0));
        bar(work, "Fidget f32 / stable f64", self.ratio(grad, raw, "ours stable f64"), AtLeast(3.0));

        let work = "pawn, one point";
        let one = "pawn: one point";
        bar(work, "ω stable f64, ns", self.time(one, "ours ω stable f64"), AtMost(14.0));
        bar(
            work,
            "Fidget / ω stable f64",
            self.ratio(one, "Fidget ω f32", "ours ω stable f64"),
            AtLeast(3.0),
        );
        bar(work, "ω+∇ω stable f64, ns", self.time(one, "ours ω and ∇ω stable f64"), AtMost(25.0));

        let work = "64 spheres, f32 batch";
        for (order, title) in [("left", "64 spheres, left fold: ω"), ("balanced", "64 spheres, balanced: ω")]
        {
            let says = |form: &str| format!("Fidget / {form}, {order}");
            bar(work, &says("stable"), self.ratio(title, raw, "ours stable f32"), AtLeast(1.3));
            bar(work, &says("textbook"), self.ratio(title, raw, textbook), AtLeast(2.0));
        }

        let work = "500 primitives, cell map";
        let title = |n: usize| format!("{n} spheres, balanced: through");
        for (what, row) in [("sign", MAP_SIGN), ("contact", MAP_CONTACT)] {
            let few = self.time(&title(500), row);
            let many = self.time(&title(10_000), row);
            bar(work, &format!("Fidget / {what}"), self.ratio(&title(500), raw, row), AtLeast(20.0));
            let growth = many.zip(few).map(|(many, few)| many / few);
            bar(work, &format!("{what}, 10 000 / 500 primitives"), growth, AtMost(2.0));
        }

        let work = "range of boxes, pawn";
        let share =
            |name: &str| self.decided.iter().find(|(row, _)| row == name).map(|(_, share)| 100.0 * share);
        let range = "pawn: range";
        bar(work, "ω decides, % of 32³ cells", share("ours range f64"), AtLeast(98.0));
        bar(work, "twin decides, % of 32³ cells", share("ours range of the twin f64"), AtLeast(98.0));
        bar(work, "ω, ns", self.time(range, "ours range f64"), AtMost(30.0));
        bar(work, "twin, ns", self.time(range, "ours range of the twin f64"), AtMost(30.0));

        let work = "compile, ms";
        bar(work, "pawn, all programs", self.compile("pawn, all programs that a run needs"), AtMost(3.0));
        for (title, limit) in [("500 spheres, balanced", 30.0), ("10000 spheres, balanced", 500.0)] {
            for what in ["ω at one point", "ω, f32 batch", "sign, f64 batch", "contact, f64 batch"] {
                bar(
                    work,
                    &format!("{title}, {what}"),
                    self.compile(&format!("{title}, {what}")),
                    AtMost(limit),
                );
            }
        }

        let work = "errors";
        for precision in ["f64", "f32"] {
            let ulps = self.ulps(&format!("ours stable {precision}"));
            bar(
                work,
                &format!("value of one node, ulp {precision}"),
                ulps.map(|(value, _)| value),
                AtMost(2.0),
            );
            bar(
                work,
                &format!("weight of one node, ulp {precision}"),
                ulps.map(|(_, weight)| weight),
                AtMost(6.0),
            );
        }
        bar(work, "wrong signs of the sign programs", Some(self.wrong_signs()), AtMost(0.0));
        bar(work, "stable answers that are NaN", Some(self.nan_gradients()), AtMost(0.0));
        list
    }
}
