//! Milliseconds per step against N, both axes logarithmic, as SVG and as PNG.

use std::fmt::Write as _;
use std::path::Path;

pub struct Curve {
    pub name: String,
    /// N and ms per step.
    pub points: Vec<(f64, f64)>,
    pub settled: bool,
    pub single: bool,
}

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 480.0;
/// Left, top, right, bottom of the axes.
const FRAME: [f64; 4] = [66.0, 46.0, 740.0, 428.0];
const X: [f64; 2] = [800.0, 130_000.0];
const Y: [f64; 2] = [0.15, 1_000.0];
const INK: &str = "#1c1c1c";
const COLOURS: [&str; 2] = ["#d0671e", "#2f6ea8"];

fn place((n, ms): (f64, f64)) -> (f64, f64) {
    let part = |v: f64, [low, high]: [f64; 2]| (v / low).ln() / (high / low).ln();
    let [left, top, right, bottom] = FRAME;
    (left + part(n, X) * (right - left), bottom - part(ms, Y) * (bottom - top))
}

pub fn svg(curves: &[Curve], paper: &[(f64, f64)]) -> String {
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="Ubuntu, 'Segoe UI', Arial, sans-serif" font-weight="300" font-size="13" fill="{INK}">
<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>
<text x="{}" y="28" font-size="17">Time of one SPH step, a drop on the pawn</text>
"##,
        FRAME[0]
    );
    axes(&mut out);
    for curve in curves {
        draw(&mut out, curve);
    }
    for &point in paper {
        cross(&mut out, place(point));
    }
    legend(&mut out, curves);
    out.push_str("</svg>\n");
    out
}

fn axes(out: &mut String) {
    let [left, top, right, bottom] = FRAME;
    for decade in [0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5] {
        for digit in 1..10 {
            let value = decade * f64::from(digit);
            let labelled = [1, 2, 5].contains(&digit);
            let colour = if digit == 1 { "#c4c4c4" } else { "#ebebeb" };
            if (X[0]..=X[1]).contains(&value) && decade >= 100.0 {
                let x = place((value, 1.0)).0;
                let _ = writeln!(out, r#"<path d="M{x:.1} {top}V{bottom}" stroke="{colour}"/>"#);
                if labelled {
                    let text = thousands(value);
                    let _ = writeln!(
                        out,
                        r#"<text x="{x:.1}" y="{}" text-anchor="middle">{text}</text>"#,
                        bottom + 19.0
                    );
                }
            }
            if (Y[0]..=Y[1]).contains(&value) {
                let y = place((1e3, value)).1;
                let _ = writeln!(out, r#"<path d="M{left} {y:.1}H{right}" stroke="{colour}"/>"#);
                if digit == 1 || digit == 2 {
                    let text = thousands(value);
                    let _ = writeln!(
                        out,
                        r#"<text x="{}" y="{:.1}" text-anchor="end">{text}</text>"#,
                        left - 7.0,
                        y + 4.5
                    );
                }
            }
        }
    }
    let _ = writeln!(
        out,
        r#"<rect x="{left}" y="{top}" width="{}" height="{}" fill="none" stroke="{INK}"/>
<text x="{}" y="{}" font-size="14" text-anchor="middle">particles N</text>
<text transform="translate(20 {}) rotate(-90)" font-size="14" text-anchor="middle">milliseconds per step</text>"#,
        right - left,
        bottom - top,
        0.5 * (left + right),
        bottom + 41.0,
        0.5 * (top + bottom)
    );
}

/// 20000 becomes 20 000, with a narrow space.
fn thousands(value: f64) -> String {
    if value < 1.0 {
        return format!("{value:.1}");
    }
    let digits = format!("{value:.0}");
    match digits.len() {
        0..=4 => digits,
        n => format!("{}\u{2009}{}", &digits[..n - 3], &digits[n - 3..]),
    }
}

fn draw(out: &mut String, curve: &Curve) {
    let (colour, dash) = style(curve);
    let mut path = String::new();
    for (i, &point) in curve.points.iter().enumerate() {
        let (x, y) = place(point);
        let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
        disc(out, (x, y), colour, curve.single);
    }
    let _ = writeln!(
        out,
        r#"<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.8" stroke-dasharray="{dash}"/>"#
    );
}

fn style(curve: &Curve) -> (&'static str, &'static str) {
    (COLOURS[usize::from(curve.settled)], if curve.single { "5 3" } else { "none" })
}

fn disc(out: &mut String, (x, y): (f64, f64), colour: &str, hollow: bool) {
    let fill = if hollow { "#fff" } else { colour };
    let _ = writeln!(
        out,
        r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.4" fill="{fill}" stroke="{colour}" stroke-width="1.6"/>"#
    );
}

fn cross(out: &mut String, (x, y): (f64, f64)) {
    let (l, r, t, b) = (x - 5.0, x + 5.0, y - 5.0, y + 5.0);
    let _ = writeln!(
        out,
        r##"<path d="M{l:.1} {t:.1}L{r:.1} {b:.1}M{l:.1} {b:.1}L{r:.1} {t:.1}" stroke="#111" stroke-width="2.2"/>"##
    );
}

fn legend(out: &mut String, curves: &[Curve]) {
    let (left, mut y) = (FRAME[0] + 16.0, FRAME[1] + 24.0);
    let height = 21.0 * (curves.len() + 1) as f64 + 6.0;
    let _ = writeln!(
        out,
        r##"<rect x="{}" y="{}" width="330" height="{height}" fill="#fff" stroke="#bbb"/>"##,
        left - 6.0,
        y - 15.0
    );
    for curve in curves {
        let (colour, dash) = style(curve);
        let _ = writeln!(
            out,
            r#"<path d="M{left} {y}h34" stroke="{colour}" stroke-width="1.8" stroke-dasharray="{dash}"/>"#
        );
        disc(out, (left + 17.0, y), colour, curve.single);
        let _ = writeln!(out, r#"<text x="{}" y="{}">{}</text>"#, left + 44.0, y + 4.5, curve.name);
        y += 21.0;
    }
    cross(out, (left + 17.0, y));
    let _ = writeln!(
        out,
        r#"<text x="{}" y="{}">the paper's code, elsewhere; 29 neighbours</text>"#,
        left + 44.0,
        y + 4.5
    );
}

/// Rasterises with the font that the slices use, at two pixels per unit.
pub fn write_png(svg: &str, path: &Path) {
    let file = std::fs::File::create(path).expect("target/ is writable");
    rfm::slice::rasterise(svg, 2.0, file).expect("our own drawing is valid");
}
