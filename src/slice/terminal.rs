//! A slice in characters: half blocks with 24-bit colours, or `.:-=+*#` without colour.
//!
//! Invariant: the caller decides about width and colour. Nothing here queries the terminal.

use std::io::{self, Write};

use super::{
    Plane, SliceError, Window,
    colour::{Scale, UNDEFINED},
    sample::{Samples, sample_grid},
};
use crate::field::Field;

/// Characters from near the surface to far from it, on each side. `=` is where the sign changes.
const OUTSIDE: [char; 3] = ['-', ':', '.'];
const INSIDE: [char; 3] = ['+', '*', '#'];
const SURFACE: char = '=';
const NO_VALUE: char = '?';

/// Draws a slice `columns` characters wide, at most 1000. The number of rows is such that lengths look equal
/// both ways.
///
/// # Errors
/// Those of [`super::sample`] and of `out`.
pub fn draw(
    field: &dyn Field,
    name: &str,
    plane: Plane,
    window: Window,
    columns: usize,
    colour: bool,
    out: &mut impl Write,
) -> Result<(), SliceError> {
    window.grid(columns)?;
    let columns = columns.clamp(2, 1000);
    // a character is about twice as high as wide
    let size = window.size();
    let lines = ((columns as f64 * size.y / size.x / 2.0).round() as usize).clamp(2, 500);
    let samples = sample_grid(field, plane, window, columns, if colour { 2 * lines } else { lines });
    let scale = Scale::for_samples(&samples);
    let (right, up) = plane.axis.right_and_up();
    let Window { min, max } = window;
    // four digits behind the point are enough for a caption, without trailing zeros
    let short = |x: f64| (1e4 * x).round() / 1e4 + 0.0;
    writeln!(
        out,
        "{name}, {plane}   {} {} .. {} to the right, {} {} .. {} upwards",
        right.name(),
        short(min.x),
        short(max.x),
        up.name(),
        short(min.y),
        short(max.y)
    )?;
    if colour {
        blocks(&samples, &scale, out)?
    } else {
        characters(&samples, &scale, out)?
    }
    Ok(())
}

/// Draws two samples with each character: the upper one in the colour of the block, the lower one in that of
/// the ground.
fn blocks(samples: &Samples, scale: &Scale, out: &mut impl Write) -> io::Result<()> {
    for line in (0..samples.rows / 2).rev() {
        let mut last = None;
        for column in 0..samples.columns {
            let [upper, lower] = [2 * line + 1, 2 * line].map(|row| scale.colour(samples.get(column, row)));
            // most neighbours have the same colours, and repeating the codes would make the output ten
            // times longer
            if last.replace((upper, lower)) != Some((upper, lower)) {
                let ([r, g, b], [s, h, c]) = (upper, lower);
                write!(out, "\x1b[38;2;{r};{g};{b};48;2;{s};{h};{c}m")?;
            }
            write!(out, "▀")?;
        }
        writeln!(out, "\x1b[0m")?;
    }
    let sign = |omega: f64| {
        let [r, g, b] = scale.colour(omega);
        format!("\x1b[48;2;{r};{g};{b}m  \x1b[0m")
    };
    write!(out, "{} ω > 0, inside   {} ω < 0, outside", sign(f64::INFINITY), sign(f64::NEG_INFINITY))?;
    if samples.undefined() > 0 {
        let [r, g, b] = UNDEFINED;
        write!(out, "   \x1b[48;2;{r};{g};{b}m  \x1b[0m undefined")?;
    }
    writeln!(out)
}

fn characters(samples: &Samples, scale: &Scale, out: &mut impl Write) -> io::Result<()> {
    for row in (0..samples.rows).rev() {
        let line: String =
            (0..samples.columns).map(|column| character(samples, scale, column, row)).collect();
        writeln!(out, "{line}")?;
    }
    let text = |set: [char; 3]| set.iter().collect::<String>();
    write!(out, "{SURFACE} surface   {} inside   {} outside", text(INSIDE), text(OUTSIDE))?;
    writeln!(out, "{}", if samples.undefined() > 0 { "   ? undefined" } else { "" })
}

fn character(samples: &Samples, scale: &Scale, column: usize, row: usize) -> char {
    let omega = samples.get(column, row);
    let Some(band) = scale.band(omega) else { return NO_VALUE };
    // an inside sample with an outside neighbour; the line is one character thick
    let neighbours =
        [(column.wrapping_sub(1), row), (column + 1, row), (column, row.wrapping_sub(1)), (column, row + 1)];
    let outside = |(i, j): (usize, usize)| i < samples.columns && j < samples.rows && samples.get(i, j) < 0.0;
    let (inside, depth) = scale.depth(band);
    if inside && neighbours.into_iter().any(outside) {
        return SURFACE;
    }
    let set = if inside { INSIDE } else { OUTSIDE };
    set[((depth * 3.0) as usize).min(2)]
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::{
        super::tests::{field, pawn},
        *,
    };
    use crate::slice::Axis;

    fn text(field: &dyn Field, name: &str, colour: bool) -> String {
        let window = Window::new(DVec2::new(0.8, 0.0), DVec2::new(2.2, 1.6));
        let mut out = Vec::new();
        draw(field, name, Plane::new(Axis::Y, 1.5), window, 43, colour, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn the_pawn_in_plain_characters() {
        insta::assert_snapshot!(text(&pawn(), "pawn", false), @r"
        pawn, y = 1.5   x 0.8 .. 2.2 to the right, z 0 .. 1.6 upwards
        .:::::::::::::::-----------:::::::::::::::.
        :::::::::::::-----------------:::::::::::::
        ::::::::::::--------===--------::::::::::::
        :::::::::::------===***===------:::::::::::
        ::::::::::-----==*********==-----::::::::::
        :::::::::------=***********=------:::::::::
        :::::::::------=***********=------:::::::::
        ::::::::::------=*********=------::::::::::
        ::::::::--------=**#####**=--------::::::::
        ::::::-----=====###########=====-----::::::
        :::::::::-----=*###########*=-----:::::::::
        ::::::::::::::=*###########*=::::::::::::::
        ::::::::::::::-=###########=-::::::::::::::
        ..::::::::::::-=###########=-::::::::::::..
        .....:::::::::-=###########=-:::::::::.....
        ........::::::=#############=::::::........
        ..........:::=###############=:::..........
        ...........:=#################=:...........
        ..........:=###################=:..........
        ..........=*###################*=..........
        .........=**###################**=.........
        .......:=****#################****=:.......
        ......:=***************************=:......
        .....:=*****************************=:.....
        ....:-=+++++++++++++++++++++++++++++=-:....
        = surface   +*# inside   -:. outside
        ");
    }

    #[test]
    fn colour_codes_end_with_every_line() {
        let text = text(&pawn(), "pawn", true);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 2 + 25);
        assert!(lines[1..26].iter().all(|line| line.ends_with("\x1b[0m") && line.matches('▀').count() == 43));
    }

    #[test]
    fn undefined_places_are_marked_and_explained() {
        let half = field(|p: DVec3| (p.x - 1.5).sqrt() - 0.2);
        let text = text(&half, "root", false);
        assert!(text.contains("??") && text.ends_with("? undefined\n"), "{text}");
    }

    #[test]
    fn odd_widths_do_not_panic() {
        let window = Window::new(DVec2::ZERO, DVec2::new(1.0, 1e6));
        let plane = Plane::new(Axis::Z, 0.0);
        assert!(draw(&pawn(), "pawn", plane, window, 0, true, &mut Vec::new()).is_err());
        draw(&pawn(), "pawn", plane, window, 2, true, &mut Vec::new()).unwrap();
    }
}
