//! The values of flags: numbers with units, places, ranges.

use std::num::NonZeroUsize;

use glam::DVec3;

use super::scenery::Viewpoint;
use rfm::diagnostic::{Diagnostic, explain};
use rfm::geom::Aabb;
use rfm::lower::Picture;
use rfm::quantity::{Dimension, parse_quantity};
use rfm::render::Projection;
use rfm::slice::{Axis, Plane};

/// How far a simplified mesh may be from the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Tolerance {
    /// A length, m.
    Length(f64),
    /// A part of the diagonal of the mesh's bounds.
    OfDiagonal(f64),
}

/// A range of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Frames {
    /// The first frame.
    pub first: usize,
    /// The first frame that is left out; `None`: all frames from `first` on.
    pub end: Option<usize>,
}

/// What is cut away of obstacles in pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CutFlag {
    /// The front half of those that hide much of the fluid.
    Auto,
    /// Nothing.
    None,
    /// What lies between this plane and the eye.
    Plane(Plane),
}

/// A param that the command line sets.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Definition {
    pub name: String,
    /// The value in SI units.
    pub value: f64,
    /// The dimension of the value; `None` if it was given without a unit.
    pub dimension: Option<Dimension>,
    /// The file of params that sets it and the line, such as `params.toml:3`; `None` for `-D`.
    pub place: Option<String>,
}

/// `NAME=VALUE`, the value with or without a unit.
pub(super) fn definition(text: &str) -> Result<Definition, String> {
    let Some((name, value)) = text.split_once('=') else {
        let (name, value) = text.split_once([':', ' ']).unwrap_or((text, ""));
        let (name, value) = (name.trim(), value.trim());
        let is_value = parse_quantity(value).is_ok();
        return Err(format!("expected NAME=VALUE, as in {name}={}", if is_value { value } else { "1.2" }));
    };
    let (value, dimension) = parse_quantity(value).map_err(|reason| match value.contains(',') {
        true => format!(
            "{reason}: decimals have a point, as in 1.2, and several values are those of --sweep {}={}",
            name.trim(),
            value.trim()
        ),
        false => reason,
    })?;
    Ok(Definition { name: name.trim().to_string(), value, dimension, place: None })
}

/// Which warnings count as errors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Deny {
    /// All.
    Warnings,
    /// Those with a code.
    Code(String),
}

impl Deny {
    pub fn covers(&self, diagnostic: &Diagnostic) -> bool {
        match self {
            Self::Warnings => true,
            Self::Code(code) => diagnostic.code.0 == code,
        }
    }
}

/// Reads `warnings`, or the code of a message.
pub(super) fn deny(text: &str) -> Result<Deny, String> {
    match text {
        "warnings" => Ok(Deny::Warnings),
        code if explain(code).is_some() => Ok(Deny::Code(code.to_uppercase())),
        _ => Err("write `warnings` for all, or a code such as W0401".to_string()),
    }
}

/// Most threads. A larger number is a typing error, and starting the threads would take minutes.
const MOST_THREADS: usize = 1024;

pub(super) fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let number = text.trim().parse().ok().filter(|n: &NonZeroUsize| n.get() <= MOST_THREADS);
    number.ok_or_else(|| format!("expected a whole number from 1 to {MOST_THREADS}"))
}

pub(super) fn count(text: &str) -> Result<usize, String> {
    let number = text.trim().parse().ok().filter(|&n: &usize| n > 0);
    number.ok_or_else(|| "expected a whole number above 0".to_string())
}

/// A number of cells along the longest side of a box.
pub(super) fn cells(text: &str) -> Result<usize, String> {
    const MOST: f64 = 1e9;
    let text = text.trim();
    text.parse().map_err(|_| {
        let expected = "expected a whole number of cells along the longest side";
        let first = text.split(['x', '×', ',']).next().unwrap_or_default();
        match text.parse::<f64>() {
            Ok(number) if (1.0..=MOST).contains(&number) => format!("{expected}: write {}", number.round()),
            Err(_) if first != text && first.parse::<usize>().is_ok() => {
                format!("{expected}, from which the others follow: write {first}")
            }
            Ok(_) | Err(_) => format!("{expected}, as in 128"),
        }
    })
}

/// Coordinates in metres or with units, separated by commas.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let values: Result<Vec<f64>, String> = text.split(',').map(length).collect();
    values?.try_into().map_err(|v: Vec<f64>| format!("expected {N} numbers, found {}", v.len()))
}

/// A number in SI units, or with a unit of the dimension. `what` names what is read.
fn measured(text: &str, dimension: Dimension, what: &str, units: &str) -> Result<f64, String> {
    let (value, found) =
        parse_quantity(text).map_err(|reason| format!("{reason}; expected {what}, as in {units}"))?;
    match found {
        Some(found) if found != dimension => Err(format!("`{}` is not {what}, as in {units}", text.trim())),
        _ => Ok(value),
    }
}

/// A number of seconds, or a time with a unit.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let value = measured(text, Dimension::TIME, "a time", "0.5, 500ms or 2min")?;
    if value.is_finite() { Ok(value) } else { Err("the time must be finite".into()) }
}

/// A number of steps.
pub(super) fn steps(text: &str) -> Result<u64, String> {
    text.trim().parse().map_err(|_| "a whole number that is not negative, as in 100".to_string())
}

/// A number of metres, or a length with a unit.
pub(super) fn length(text: &str) -> Result<f64, String> {
    measured(text, Dimension::LENGTH, "a length", "0.5, 8mm or 2cm")
}

/// A length, or a percentage.
pub(super) fn tolerance(text: &str) -> Result<Tolerance, String> {
    let found = match text.trim().strip_suffix('%') {
        None => length(text).map(|length| (length, Tolerance::Length(length))),
        Some(number) => number
            .trim()
            .parse::<f64>()
            .map(|percent| (percent, Tolerance::OfDiagonal(percent / 100.0)))
            .map_err(|_| format!("`{text}` is neither a length nor a percentage")),
    };
    match found? {
        (size, tolerance) if size.is_finite() && size > 0.0 => Ok(tolerance),
        _ => Err("expected a length or a percentage above 0".into()),
    }
}

/// `A..B`, `A..`, `..B`, or one number.
pub(super) fn frames(text: &str) -> Result<Frames, String> {
    let whole = |text: &str| {
        text.trim()
            .parse::<usize>()
            .map_err(|_| format!("`{text}` is not the number of a frame; expected A..B"))
    };
    let Some((first, end)) = text.split_once("..") else {
        let first = whole(text)?;
        return Ok(Frames { first, end: first.checked_add(1) });
    };
    Ok(Frames {
        first: if first.trim().is_empty() { 0 } else { whole(first)? },
        end: if end.trim().is_empty() { None } else { Some(whole(end)?) },
    })
}

pub(super) fn point(text: &str) -> Result<DVec3, String> {
    let place = numbers::<3>(text).map(DVec3::from_array)?;
    if place.is_finite() {
        Ok(place)
    } else {
        Err("the coordinates of a point are finite numbers".to_string())
    }
}

/// Three numbers that are not all zero; or what a scene states and the viewer copies:
/// `picture { camera: [0.5, -1, 0.4], look_at: [1, 1, 0.5], zoom: 2, projection: parallel }`.
pub(super) fn camera(text: &str) -> Result<Viewpoint, String> {
    const KEYS: &str = "expected camera, look_at, zoom or projection";
    let bare = |text: &str| {
        let text = text.trim();
        point(text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(text))
    };
    let (mut towards_eye, mut look_at, mut zoomed, mut projected) = (None, None, None, None);
    if text.contains(':') {
        let entries = text.trim().strip_prefix("picture").map_or(text, str::trim);
        let entries = entries.strip_prefix('{').and_then(|rest| rest.strip_suffix('}')).unwrap_or(entries);
        let mut rest = entries.trim();
        while let Some((key, after)) = rest.split_once(':') {
            let after = after.trim_start();
            let end = match after.strip_prefix('[') {
                Some(vector) => vector.find(']').ok_or("`[` is not closed")? + 2,
                None => after.find(',').unwrap_or(after.len()),
            };
            let (value, next) = after.split_at(end);
            let key = key.trim();
            let is_repeated = match key {
                "camera" => towards_eye.replace(bare(value)?).is_some(),
                "look_at" => look_at.replace(bare(value)?).is_some(),
                "zoom" => zoomed.replace(zoom(value)?).is_some(),
                "projection" => projected.replace(projection(value)?).is_some(),
                other => return Err(format!("`{other}` is no key of a camera; {KEYS}")),
            };
            if is_repeated {
                return Err(format!("`{key}` is stated twice"));
            }
            rest = next.trim_start().strip_prefix(',').unwrap_or(next).trim_start();
        }
        if !rest.trim().is_empty() {
            return Err(format!("`{}` has no key; {KEYS}", rest.trim()));
        }
    } else {
        towards_eye = Some(bare(text)?);
    }
    let towards_eye =
        towards_eye.ok_or("the direction to the eye is missing, as in camera: [0.5, -1, 0.4]")?;
    if !towards_eye.is_finite() || towards_eye == DVec3::ZERO {
        return Err("the direction has no length".into());
    }
    if look_at.is_some_and(|at: DVec3| !at.is_finite()) {
        return Err("`look_at` must be finite".into());
    }
    let projection = projected.unwrap_or_default();
    Ok(Viewpoint { towards_eye: Some(towards_eye), look_at, zoom: zoomed, projection })
}

/// The word for a projection, as a scene states it.
fn projection(text: &str) -> Result<Projection, String> {
    match text.trim() {
        "perspective" => Ok(Projection::Perspective),
        "parallel" => Ok(Projection::Parallel),
        other => Err(format!("`{other}` is no projection; expected perspective or parallel")),
    }
}

/// Width and height in pixels: `1280x720`.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.trim().parse::<u32>().ok().filter(|n| (16..=8192).contains(n));
    let sides = text.split_once(['x', '×', 'X']).and_then(|(w, h)| Some((side(w)?, side(h)?)));
    sides.ok_or_else(|| {
        format!("`{text}` is not a size; expected WIDTHxHEIGHT with 16 to 8192 pixels each way")
    })
}

/// How many times as large: above 0.
pub(super) fn zoom(text: &str) -> Result<f64, String> {
    let found = text.trim().parse().ok().filter(|zoom| Picture::ZOOMS.contains(zoom));
    found.ok_or_else(|| {
        format!("expected a number from {} to {}", Picture::ZOOMS.start(), Picture::ZOOMS.end())
    })
}

/// Two numbers in SI units, the lower one first: `0..2.5`.
pub(super) fn range(text: &str) -> Result<(f64, f64), String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let ends = text.split_once("..").and_then(|(low, high)| Some((number(low)?, number(high)?)));
    let (low, high) =
        ends.ok_or_else(|| format!("`{text}` is not a range of numbers; expected LOW..HIGH"))?;
    if low < high { Ok((low, high)) } else { Err("the first number must be the lower one".into()) }
}

/// `A..B`, `A..` or `..B` in seconds or with units; an end that is not stated is infinite.
pub(super) fn times(text: &str) -> Result<(f64, f64), String> {
    let (from, to) = text.split_once("..").ok_or("expected A..B, as in 0.5..2 or 500ms..")?;
    let end = |text: &str, open: f64| if text.trim().is_empty() { Ok(open) } else { seconds(text) };
    let (from, to) = (end(from, f64::NEG_INFINITY)?, end(to, f64::INFINITY)?);
    if from <= to { Ok((from, to)) } else { Err("the first time must be the earlier one".into()) }
}

/// A plane, `auto` or `none`.
pub(super) fn cut(text: &str) -> Result<CutFlag, String> {
    match text.trim() {
        "auto" => Ok(CutFlag::Auto),
        "none" => Ok(CutFlag::None),
        other => plane(other).map(CutFlag::Plane).map_err(|reason| format!("{reason}; or `auto`, or `none`")),
    }
}

pub(super) fn window(text: &str) -> Result<[f64; 4], String> {
    numbers::<4>(text)
}

pub(super) fn aabb(text: &str) -> Result<Aabb, String> {
    let [x0, y0, z0, x1, y1, z1] = numbers::<6>(text)?;
    Ok(Aabb::new(DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1)))
}

pub(super) fn plane(text: &str) -> Result<Plane, String> {
    let (axis, value) = text.split_once('=').ok_or("expected x=…, y=… or z=…")?;
    let axis = match axis.trim() {
        "x" => Axis::X,
        "y" => Axis::Y,
        "z" => Axis::Z,
        other => return Err(format!("`{other}` is not an axis; expected x, y or z")),
    };
    let value = length(value)?;
    if !value.is_finite() {
        return Err("the plane must be at a finite place".into());
    }
    Ok(Plane::new(axis, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_units_or_are_metres() {
        for (text, expected) in
            [("0.5", 0.5), ("2 mm", 2e-3), ("2e-1cm", 2e-3), ("-1m", -1.0), ("1E3um", 1e-3)]
        {
            let found = length(text).unwrap();
            assert!((found - expected).abs() < 1e-15, "{text}: {found}");
        }
        for text in ["", "mm", "2 kg", "2 furlong", "1,5"] {
            assert!(length(text).is_err(), "{text}");
        }
    }

    #[test]
    fn every_number_takes_a_unit() {
        let found = definition("alpha = 10 deg").unwrap();
        assert_eq!((found.name.as_str(), found.dimension), ("alpha", Some(Dimension::ANGLE)));
        assert!((found.value - 10f64.to_radians()).abs() < 1e-15);
        assert_eq!(definition("n=3").unwrap().dimension, None);
        assert_eq!(seconds("500ms"), Ok(0.5));
        assert_eq!(point("1cm,2mm,0.5"), Ok(DVec3::new(0.01, 0.002, 0.5)));
        assert_eq!(plane("z=5mm").unwrap(), Plane::new(Axis::Z, 0.005));
        for text in ["500 kg", "soon", "inf", ""] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }

    #[test]
    fn tolerances_are_lengths_or_percentages() {
        assert_eq!(tolerance("2mm"), Ok(Tolerance::Length(2e-3)));
        assert_eq!(tolerance("0.5 %"), Ok(Tolerance::OfDiagonal(5e-3)));
        for text in ["0", "-1mm", "%", "0%", "nan", "inf%", "1e400", "few"] {
            assert!(tolerance(text).is_err(), "{text}");
        }
    }

    #[test]
    fn cameras_are_read_as_the_viewer_copies_them() {
        let towards_eye = Some(DVec3::new(0.42, -0.9, 0.1));
        let expected = Ok(Viewpoint { towards_eye, ..Viewpoint::default() });
        for text in ["0.42,-0.9,0.1", "[0.42, -0.9, 0.1]", "picture { camera: [0.42, -0.9, 0.1] }"] {
            assert_eq!(camera(text), expected, "{text}");
        }
        let whole = "picture { camera: [0.42, -0.9, 0.1], look_at: [1, 2, -3], zoom: 2.5 }";
        let look_at = Some(DVec3::new(1.0, 2.0, -3.0));
        let seen = Viewpoint { towards_eye, look_at, zoom: Some(2.5), projection: Projection::Perspective };
        assert_eq!(camera(whole), Ok(seen));
        let parallel = whole.replace(" }", ", projection: parallel }");
        assert_eq!(camera(&parallel), Ok(Viewpoint { projection: Projection::Parallel, ..seen }));
        for text in [
            "0,0,0",
            "cut: [1, 0, 0]",
            "camera: [1, 0]",
            "camera: [1, 0, 0",
            "look_at: [1, 0, 0]",
            "camera: [1, 0, 0], zoom: 0",
            "camera: [1, 0, 0], look_at: 3",
            "camera: [1, 0, 0], look_at: [nan, 0, 0]",
            "camera: [1, 0, 0] zoom",
            "camera: [1, 0, 0], camera: [0, 1, 0]",
            "camera: [1, 0, 0], projection: flat",
        ] {
            assert!(camera(text).is_err(), "{text}");
        }
    }

    #[test]
    fn sizes_ranges_and_times() {
        assert_eq!((size("1280x720"), size("640×480")), (Ok((1280, 720)), Ok((640, 480))));
        assert_eq!((range("0..2.5"), range("-1e3..-5")), (Ok((0.0, 2.5)), Ok((-1000.0, -5.0))));
        assert_eq!((times("500ms..2"), times("..1")), (Ok((0.5, 2.0)), Ok((f64::NEG_INFINITY, 1.0))));
        for text in ["", "12", "1280", "9000x9000", "2..1", "a..b", "1..1", "nan..2"] {
            assert!(size(text).is_err() && range(text).is_err(), "{text}");
        }
        assert!(times("2..1").is_err() && times("2").is_err() && times("2 kg..").is_err());
        assert!(zoom("2").is_ok() && zoom("0").is_err() && zoom("nan").is_err());
    }

    #[test]
    fn ranges_of_frames() {
        let range = |first, end| Ok(Frames { first, end });
        assert_eq!(frames("3..5"), range(3, Some(5)));
        assert_eq!(
            (frames("3.."), frames("..5"), frames("..")),
            (range(3, None), range(0, Some(5)), range(0, None))
        );
        assert_eq!(frames("7"), range(7, Some(8)));
        assert!(frames("a..b").is_err() && frames("-1..2").is_err() && frames("").is_err());
    }
}
