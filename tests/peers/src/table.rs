//! Tables in plain text, and all results in JSON.

use serde_json::{Value, json};

use crate::bars::{Bar, Found, Limit};
use crate::measure::{Asks, Group, Row};

/// Sets columns as wide as their widest cell; the first `left` of them are aligned to the left.
fn columns(rows: &[Vec<String>], left: usize) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..count).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(c, (cell, &width))| {
            if c < left { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        text += cells.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

fn number(x: f64) -> String {
    match x {
        x if x.abs() >= 1000.0 => format!("{x:.0}"),
        x if x.abs() >= 100.0 => format!("{x:.1}"),
        x => format!("{x:.2}"),
    }
}

fn maybe(x: Option<f64>, show: impl Fn(f64) -> String) -> String {
    x.map_or_else(|| "–".into(), show)
}

fn ratio(group: &Group, row: &Row, which: usize) -> Option<f64> {
    row.against[which].and_then(|name| group.ratio(&row.name, name))
}

pub fn print_group(group: &Group) {
    let heads =
        ["", "ns", "/ hand", "/ Fidget", "largest relative error", "wrong signs", "NaN", "NaN at corners"];
    let mut rows = vec![heads.map(String::from).to_vec()];
    for row in &group.rows {
        let share = |s: Option<(usize, usize)>| s.map_or_else(|| "–".into(), |(k, n)| format!("{k} of {n}"));
        rows.push(vec![
            row.name.clone(),
            number(row.median()),
            maybe(ratio(group, row, 0), number),
            maybe(ratio(group, row, 1), number),
            maybe(row.errors.relative, |e| format!("{e:.1e}")),
            share(row.errors.wrong_signs),
            if row.asks == Asks::Other { "–".into() } else { row.errors.nan.to_string() },
            share(row.errors.nan_at_corners),
        ]);
    }
    println!("{}\n{}", group.title, columns(&rows, 1));
}

pub fn print_rest(found: &Found) {
    let mut rows = vec![["range decides of all 32³ cells", ""].map(String::from).to_vec()];
    rows.extend(
        found.decided.iter().map(|(name, share)| vec![name.clone(), format!("{:.2} %", 100.0 * share)]),
    );
    println!("{}", columns(&rows, 1));

    let mut rows = vec![["largest error of one node, ulp", "value", "weight"].map(String::from).to_vec()];
    let show = |x: f64| if x < 1e6 { format!("{x:.2}") } else { format!("{x:.1e}") };
    rows.extend(
        found.ulps.iter().map(|(name, value, weight)| vec![name.clone(), show(*value), show(*weight)]),
    );
    println!("{}", columns(&rows, 1));

    let heads = ["from the text to the first answer, ms", "ours", "Fidget", "ours / Fidget"];
    let mut rows = vec![heads.map(String::from).to_vec()];
    for time in &found.compile {
        let quotient = time.fidget.map(|fidget| time.ours / fidget);
        let small = |x: f64| if x < 1.0 { format!("{x:.3}") } else { number(x) };
        rows.push(vec![
            time.what.clone(),
            small(time.ours),
            maybe(time.fidget, small),
            maybe(quotient, number),
        ]);
    }
    println!("{}", columns(&rows, 1));
}

pub fn print_bars(bars: &[Bar]) {
    let mut rows = vec![["promise", "", "bar", "found", ""].map(String::from).to_vec()];
    for bar in bars {
        let limit = match bar.bar {
            Limit::AtMost(x) => format!("≤ {x}"),
            Limit::AtLeast(x) => format!("≥ {x}"),
        };
        let verdict = match bar.found {
            None => "missed: not there",
            Some(_) if bar.passes() => "passed",
            Some(_) => "missed",
        };
        let found = maybe(bar.found, number);
        rows.push(vec![bar.work.into(), bar.says.clone(), limit, found, format!("  {verdict}")]);
    }
    println!("{}", columns(&rows, 2));
}

/// Gives all results to other programs.
pub fn json(found: &Found, bars: &[Bar]) -> Value {
    let row = |group: &Group, row: &Row| {
        json!({
            "name": row.name,
            "ns": row.median(),
            "to_hand": ratio(group, row, 0),
            "to_fidget": ratio(group, row, 1),
            // JSON has no infinity, so such an error is null.
            "relative_error": row.errors.relative,
            "nan": row.errors.nan,
            "nan_at_corners": row.errors.nan_at_corners,
            "wrong_signs": row.errors.wrong_signs,
        })
    };
    let group = |group: &Group| json!({ "title": group.title, "rows": group.rows.iter().map(|r| row(group, r)).collect::<Vec<_>>() });
    let bar = |bar: &Bar| {
        let (at_most, at_least) = match bar.bar {
            Limit::AtMost(x) => (Some(x), None),
            Limit::AtLeast(x) => (None, Some(x)),
        };
        json!({
            "work": bar.work, "says": bar.says, "at_most": at_most, "at_least": at_least,
            "found": bar.found, "passed": bar.passes(),
        })
    };
    let time = |time: &crate::compile::Time| json!({ "what": time.what, "ours_ms": time.ours, "fidget_ms": time.fidget });
    json!({
        "schema": 1,
        "groups": found.groups.iter().map(group).collect::<Vec<_>>(),
        "decided": found.decided.iter().map(|(n, s)| json!({ "name": n, "share": s })).collect::<Vec<_>>(),
        "ulps": found.ulps.iter().map(|(n, v, w)| json!({ "name": n, "value": v, "weight": w })).collect::<Vec<_>>(),
        "compile": found.compile.iter().map(time).collect::<Vec<_>>(),
        "bars": bars.iter().map(bar).collect::<Vec<_>>(),
    })
}
