//! `rfm eval`: ω and related values at points, as CSV with 17 significant digits.

use std::cell::OnceCell;
use std::fmt::Write as _;
use std::io::{self, BufRead, BufWriter, Read, Write};
use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;

use super::args::{Eval, What};
use super::failure::{Failure, note};
use super::progress::{self, Progress};
use super::shared::Shared;
use super::{choose, input, output};
use crate::cli::output::Shown;
use rfm::field::Points;
use rfm::geom::direction;
use rfm::ir::Unary;
use rfm::solid::{CellMap, Chosen, Distance, Distances};
use rfm::{Field, Precision, Solid};

/// Points that are evaluated at a time, so that memory stays small for any number of points.
const CHUNK: usize = 1 << 15;

/// Points that one thread evaluates together.
const BLOCK: usize = 1 << 11;

/// Points that one thread evaluates together where each of them needs a search for the nearest point.
const SEARCHES: usize = 8;

/// From this number of points on, it pays to divide space into cells before asking for their signs.
const MANY_POINTS: usize = 1 << 12;

pub(super) fn run(shared: &Shared, options: &Eval) -> Result<(), Failure> {
    if options.at.is_empty() && options.points.is_none() {
        return Err(Failure::usage("no points: give --at X,Y,Z or --points FILE.csv"));
    }
    let stdin = Path::new("-");
    if options.file == stdin && options.points.as_deref() == Some(stdin) {
        return Err(Failure::usage("file and points cannot both be read from standard input"));
    }
    let program = input::program(shared, &options.file)?;
    let solid = choose::solid_at(shared, &program, options.solid.as_deref(), options.time)?;
    let chosen = match options.precision {
        None => choose::within_tolerance(&program, &solid)?,
        Some(_) => None, // the user chose the precision
    };
    let mut writer = Table::new(solid.clone(), chosen, options, shared.json);
    writer.rows(&options.at)?;
    if let Some(at) = options.at.iter().find(|p| solid.overflows_at(**p)) {
        let shown = at.to_array().map(|x| if x.abs() < 1e6 { x.to_string() } else { format!("{x:e}") });
        note(format!("numbers overflow at {}: ω and its gradient cannot be computed there", shown.join(",")));
    }
    if let Some(path) = &options.points {
        let name = if path == stdin { "<stdin>".to_string() } else { path.shown().to_string() };
        let reader: Box<dyn Read> = if path == stdin {
            Box::new(io::stdin().lock())
        } else {
            let file = std::fs::File::open(path);
            Box::new(file.map_err(|e| Failure::usage(format!("cannot read `{name}`: {e}")))?)
        };
        read_points(io::BufReader::new(reader), &name, |points| writer.rows(points))?;
    }
    writer.finish()
}

/// Reads CSV with the columns x, y and z, some thousand points at a time. Other columns are ignored.
fn read_points(
    mut reader: impl BufRead,
    name: &str,
    mut take: impl FnMut(&[DVec3]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut columns: Option<[usize; 3]> = None;
    let mut points = Vec::with_capacity(CHUNK);
    let (mut text, mut number) = (String::new(), 0);
    loop {
        text.clear();
        let length = reader.read_line(&mut text);
        if length.map_err(|e| Failure::usage(format!("cannot read `{name}`: {e}")))? == 0 {
            break;
        }
        number += 1;
        let line = text.trim_start_matches('\u{FEFF}').trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells = || line.split(',').map(str::trim);
        let bad = |what: String| Failure::usage(format!("{name}:{number}: {what}"));
        let Some(at) = columns else {
            let find = |axis: &str| cells().position(|cell| cell.trim_matches('"') == axis);
            columns = match (find("x"), find("y"), find("z")) {
                (Some(x), Some(y), Some(z)) => Some([x, y, z]),
                _ => return Err(bad(format!("expected the header `x,y,z`, found `{line}`"))),
            };
            continue;
        };
        let mut point = [0.0; 3];
        for (value, column) in point.iter_mut().zip(at) {
            let cell =
                cells().nth(column).ok_or_else(|| bad(format!("the row has {} cells", cells().count())))?;
            *value = cell.parse().map_err(|_| bad(format!("`{cell}` is not a number")))?;
        }
        points.push(DVec3::from_array(point));
        if points.len() == CHUNK {
            take(&points)?;
            points.clear();
        }
    }
    if columns.is_none() {
        return Err(Failure::usage(format!("`{name}` is empty; expected the header `x,y,z`")));
    }
    take(&points)
}

#[derive(serde::Serialize)]
struct Document {
    schema: u32,
    points: Vec<serde_json::Value>,
}

/// The table of results. Rows are written as soon as they are known.
struct Table {
    rows: Rows,
    /// The rows for JSON, which are collected because they are one document.
    json: Option<Vec<serde_json::Value>>,
    /// Whether the head of the table is written: not before there are points.
    has_head: bool,
    out: BufWriter<io::Stdout>,
}

/// How rows are computed.
struct Rows {
    solid: Solid,
    /// The program that keeps the file's tolerance. It computes ω where no gradient is needed.
    chosen: Option<Chosen>,
    what: Vec<What>,
    precision: Precision,
    names: Vec<&'static str>,
    /// Made when a distance is first asked for.
    distances: OnceLock<Distances>,
    /// Made when many signs are first asked for; `None` where the twin answers as fast.
    cells: OnceLock<Option<CellMap>>,
    /// The progress through the points that are evaluated now, if that takes long.
    progress: Option<Progress>,
}

/// Values that are computed for all points of a block together; columns that are not wanted are empty.
#[derive(Default)]
struct Columns {
    omega: Vec<f64>,
    gradient: [Vec<f64>; 3],
    sign: Vec<f64>,
}

impl Table {
    fn new(solid: Solid, chosen: Option<Chosen>, options: &Eval, json: bool) -> Self {
        let rows = Rows::new(solid, chosen, options);
        let out = BufWriter::new(io::stdout());
        Self { rows, json: json.then(Vec::new), has_head: json, out }
    }

    fn head(&mut self) -> io::Result<()> {
        if std::mem::replace(&mut self.has_head, true) {
            return Ok(());
        }
        writeln!(self.out, "{}", self.rows.names.join(","))
    }

    fn rows(&mut self, points: &[DVec3]) -> Result<(), Failure> {
        if points.is_empty() {
            return Ok(());
        }
        self.head()?;
        let Self { rows, json, out, has_head: _ } = self;
        if points.len() >= MANY_POINTS && rows.needs_only_signs() {
            rows.cells(); // not in a thread of the pool: others would wait for it
        }
        let is_slow = rows.asks_for_searches();
        rows.progress = is_slow.then(|| progress::bar(points.len() as u64, "distances"));
        let rows = &*rows;
        let blocks = points.par_chunks(if is_slow { SEARCHES } else { BLOCK });
        match json {
            None => {
                let texts: Vec<String> = blocks.map(|points| rows.as_csv(points)).collect();
                texts.iter().try_for_each(|text| out.write_all(text.as_bytes()))?;
            }
            Some(all) => {
                let found: Vec<Vec<serde_json::Value>> = blocks.map(|points| rows.as_json(points)).collect();
                all.extend(found.into_iter().flatten());
            }
        }
        rows.progress.iter().for_each(Progress::finish_and_clear);
        Ok(())
    }

    fn finish(mut self) -> Result<(), Failure> {
        self.head()?;
        self.out.flush()?;
        match self.json {
            Some(points) => output::json(&Document { schema: 1, points }),
            None => Ok(()),
        }
    }
}

impl Rows {
    fn new(solid: Solid, chosen: Option<Chosen>, options: &Eval) -> Self {
        let mut what: Vec<What> = Vec::new();
        // each column once, in the order in which they are asked for
        for &asked in &options.what {
            if !what.contains(&asked) {
                what.push(asked);
            }
        }
        let mut names = vec!["x", "y", "z"];
        for what in &what {
            names.extend(match what {
                What::Value => &["omega"][..],
                What::Gradient => &["gx", "gy", "gz"],
                What::Sign => &["sign"],
                What::Distance => &["distance"],
                What::Clearance => &["clearance"],
                What::Normal => &["nx", "ny", "nz"],
            });
        }
        let precision = options.precision.unwrap_or(Precision::F64);
        let (distances, cells) = (OnceLock::new(), OnceLock::new());
        Self { solid, chosen, what, precision, names, distances, cells, progress: None }
    }

    fn as_csv(&self, points: &[DVec3]) -> String {
        let mut text = String::with_capacity(points.len() * self.names.len() * 24);
        self.each(points, |row| {
            for (i, &value) in row.iter().enumerate() {
                if i > 0 {
                    text.push(',');
                }
                push_number(&mut text, value);
            }
            text.push('\n');
        });
        text
    }

    fn as_json(&self, points: &[DVec3]) -> Vec<serde_json::Value> {
        let mut rows = Vec::with_capacity(points.len());
        self.each(points, |row| {
            let row: serde_json::Map<String, serde_json::Value> = std::iter::zip(&self.names, row)
                .map(|(name, &value)| ((*name).to_string(), serde_json::Value::from(value)))
                .collect();
            rows.push(row.into());
        });
        rows
    }

    /// Visits the rows of some points.
    fn each(&self, points: &[DVec3], mut visit: impl FnMut(&[f64])) {
        let columns = self.columns(points);
        let mut row = Vec::with_capacity(self.names.len());
        for (i, &p) in points.iter().enumerate() {
            row.clear();
            row.extend(p.to_array());
            self.push_row(p, &columns, i, &mut row);
            visit(&row);
            self.progress.iter().for_each(|progress| progress.inc(1));
        }
    }

    fn push_row(&self, p: DVec3, columns: &Columns, i: usize, row: &mut Vec<f64>) {
        let found = OnceCell::new();
        let distance = || *found.get_or_init(|| self.distances().at(p));
        let gradient = || DVec3::from_array(columns.gradient.each_ref().map(|column| column[i]));
        for what in &self.what {
            match what {
                What::Value => row.push(columns.omega[i]),
                What::Gradient => row.extend(gradient().to_array()),
                What::Sign => row.push(columns.sign[i]),
                What::Distance => row.push(match self.precision {
                    Precision::F64 => distance().estimate,
                    Precision::F32 => self.solid.distance_f32(p.as_vec3()).into(),
                }),
                What::Clearance => row.push(distance().clearance),
                What::Normal => row.extend(self.normal(p, gradient()).to_array()),
            }
        }
    }

    fn asks_for(&self, any: &[What]) -> bool {
        self.what.iter().any(|what| any.contains(what))
    }

    /// Whether the nearest point of the surface is searched for, which takes some milliseconds for each point.
    fn asks_for_searches(&self) -> bool {
        self.asks_for(&[What::Clearance])
            || self.asks_for(&[What::Distance]) && self.precision == Precision::F64
    }

    /// Whether signs are asked for, and nothing from which they follow.
    fn needs_only_signs(&self) -> bool {
        let has_omega = self.asks_for(&[What::Value, What::Gradient, What::Normal]);
        // a tolerance holds for values only; the sign comes from the twin
        let by_twin = self.chosen.is_some() || self.precision == Precision::F64 && !has_omega;
        self.asks_for(&[What::Sign]) && by_twin
    }

    fn columns(&self, points: &[DVec3]) -> Columns {
        let axes: [Vec<f64>; 3] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect());
        let at = axes.each_ref().map(|column| &column[..]);
        let mut columns = Columns::default();
        let by_twin = self.needs_only_signs();
        if self.asks_for(&[What::Gradient, What::Normal]) {
            self.fill_gradients(at, &mut columns);
        } else if self.asks_for(&[What::Value]) || self.asks_for(&[What::Sign]) && !by_twin {
            columns.omega = self.values(at, points);
        }
        if by_twin {
            columns.sign = self.signs(at, points);
        } else if self.asks_for(&[What::Sign]) {
            columns.sign = columns.omega.iter().map(|&omega| Unary::Sign.eval(omega)).collect();
        }
        columns
    }

    fn values(&self, at: [&[f64]; 3], points: &[DVec3]) -> Vec<f64> {
        if let (Some(chosen), Precision::F64) = (&self.chosen, self.precision) {
            return points.iter().map(|&p| chosen.omega(p)).collect();
        }
        match self.precision {
            Precision::F64 => {
                let mut omega = vec![0.0; points.len()];
                self.solid.omega_many(at, &mut omega);
                omega
            }
            Precision::F32 => {
                let single = at.map(in_single);
                let mut omega = vec![0.0; points.len()];
                self.solid.omega_many(single.each_ref().map(|column| &column[..]), &mut omega);
                in_double(&omega)
            }
        }
    }

    fn fill_gradients(&self, at: [&[f64]; 3], columns: &mut Columns) {
        let count = at[0].len();
        let [omega, x, y, z] = match self.precision {
            Precision::F64 => {
                let mut found = [(); 4].map(|()| vec![0.0; count]);
                self.solid.omega_grad_many(at, found.each_mut().map(|column| &mut column[..]));
                found
            }
            Precision::F32 => {
                let single = at.map(in_single);
                let mut found = [(); 4].map(|()| vec![0.0_f32; count]);
                let out = found.each_mut().map(|column| &mut column[..]);
                self.solid.omega_grad_many(single.each_ref().map(|column| &column[..]), out);
                found.map(|column| in_double(&column))
            }
        };
        (columns.omega, columns.gradient) = (omega, [x, y, z]);
    }

    /// The signs of the solid, through its cells if there are some.
    fn signs(&self, at: [&[f64]; 3], points: &[DVec3]) -> Vec<f64> {
        let mut sign = vec![0.0; points.len()];
        match self.cells.get() {
            Some(Some(cells)) => cells.sign_many(Points::new(at[0], at[1], at[2]), &mut sign),
            Some(None) | None => self.solid.sign_many(at, &mut sign),
        }
        if self.chosen.is_none() {
            // so far from the origin that the twin has no answer, ω may still have one
            let unknown = std::iter::zip(&mut sign, points).filter(|(sign, _)| sign.is_nan());
            unknown.for_each(|(sign, &p)| *sign = Unary::Sign.eval(self.solid.omega(p)));
        }
        sign
    }

    /// Divides the space in and around the solid into cells, if it has many parts.
    fn cells(&self) -> Option<&CellMap> {
        let make = || {
            let bounds = self.solid.bounds().aabb()?;
            let around = bounds.grown(0.25 * bounds.size().max_element());
            self.solid.has_many_leaves().then(|| CellMap::new(&self.solid, around)).flatten()
        };
        self.cells.get_or_init(make).as_ref()
    }

    /// The outward unit normal. Where ω has no gradient, as at centres, it points away from the nearest point of
    /// the surface, or towards it from inside; NaN where surfaces touch.
    fn normal(&self, p: DVec3, gradient: DVec3) -> DVec3 {
        if let Some(inward) = direction(gradient) {
            return -inward;
        }
        let Distance { estimate, nearest, .. } = self.distances().at(p);
        (p - nearest) / estimate
    }

    fn distances(&self) -> &Distances {
        self.distances.get_or_init(|| Distances::new(&self.solid))
    }
}

fn in_single(column: &[f64]) -> Vec<f32> {
    column.iter().map(|&value| value as f32).collect()
}

fn in_double(column: &[f32]) -> Vec<f64> {
    column.iter().map(|&value| value.into()).collect()
}

/// Appends a number with 17 significant digits, which read back to the same number. NaN is `nan`, infinities are
/// `inf` and `-inf`.
fn push_number(text: &mut String, value: f64) {
    if value.is_nan() {
        return text.push_str("nan");
    }
    if value.is_infinite() {
        return text.push_str(if value > 0.0 { "inf" } else { "-inf" });
    }
    if value == 0.0 {
        return text.push('0');
    }
    if value < 0.0 {
        text.push('-');
    }
    let magnitude = value.abs();
    if !(1e-5..1e16).contains(&magnitude) {
        let _ = write!(text, "{magnitude:.16e}"); // writing to a string does not fail
        return;
    }
    let (number, exponent) = digits(magnitude);
    let written = in_decimal(number);
    let before = usize::try_from(exponent + 1).unwrap_or(0);
    let (whole, part) = written.split_at(before);
    let [whole, part] = [whole, part].map(|digits| std::str::from_utf8(digits).unwrap_or_default());
    if exponent < 0 {
        text.push_str(&"0.0000"[..1 + exponent.unsigned_abs() as usize]);
    } else {
        text.push_str(whole);
        text.push('.');
    }
    text.push_str(part);
}

/// A number below 10¹⁷ with all of its 17 digits.
fn in_decimal(number: u64) -> [u8; 17] {
    const PART: u64 = 100_000_000;
    let mut written = [b'0'; 17];
    // numbers of 32 bits are divided faster
    let parts = [(number / PART / PART) as u32, (number / PART % PART) as u32, (number % PART) as u32];
    for (mut rest, place) in parts.into_iter().zip([0..1, 1..9, 9..17]) {
        for digit in written[place].iter_mut().rev() {
            *digit += (rest % 10) as u8;
            rest /= 10;
        }
    }
    written
}

/// The first 17 digits of a number between 1e-5 and 1e16, and its decimal exponent: d·10ᵏ⁻¹⁶ with 10¹⁶ ≤ d < 10¹⁷. The
/// arithmetic is exact, and halves go to the even digit, as the formats of the standard library have it.
fn digits(magnitude: f64) -> (u64, i32) {
    const LEAST: u128 = 10_u128.pow(16);
    const POWERS: [u128; 23] = {
        let mut powers = [1; 23];
        let mut i = 1;
        while i < powers.len() {
            powers[i] = 10 * powers[i - 1];
            i += 1;
        }
        powers
    };
    let bits = magnitude.to_bits();
    // m·2ᵉ
    let m = u128::from(bits & ((1 << 52) - 1) | 1 << 52);
    let e = (bits >> 52) as i32 - 1075;
    // the power of ten below it or the one below that, by log₁₀ 2 ≈ 1233/4096
    let mut k = ((e + 52) * 1233) >> 12;
    loop {
        // below 2⁵³·10²² < 2¹²⁷
        let scaled = m * POWERS[(16 - k) as usize];
        let d = match u32::try_from(-e) {
            Ok(0) | Err(_) => scaled << e,
            Ok(shift) => {
                let (down, rest, half) = (scaled >> shift, scaled & ((1 << shift) - 1), 1 << (shift - 1));
                down + u128::from(rest > half || rest == half && down % 2 == 1)
            }
        };
        if d < LEAST {
            k -= 1;
        } else if d >= 10 * LEAST {
            k += 1;
        } else {
            return (d as u64, k);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of a ball with these columns.
    fn table(what: Vec<What>) -> Table {
        let program = rfm::Program::from_source("ball", "rfm 1\nsolid s = sphere(1)\n").unwrap();
        let options = Eval {
            file: "ball".into(),
            solid: None,
            at: Vec::new(),
            points: None,
            time: 0.0,
            what,
            precision: None,
        };
        Table::new(program.solid("s").unwrap(), None, &options, true)
    }

    #[test]
    fn columns_stand_in_the_order_in_which_they_are_asked_for() {
        let table = table(vec![What::Sign, What::Distance, What::Value, What::Sign]);
        assert_eq!(table.rows.names, ["x", "y", "z", "sign", "distance", "omega"]);
    }

    #[test]
    fn searches_for_distances_tell_how_far_they_are() {
        let points: Vec<DVec3> = (0..20).map(|i| DVec3::new(0.1 * f64::from(i), 0.2, 0.0)).collect();
        let mut slow = table(vec![What::Clearance]);
        slow.rows(&points).unwrap();
        assert_eq!(slow.rows.progress.unwrap().position(), 20);
        let mut quick = table(vec![What::Value]);
        quick.rows(&points).unwrap();
        assert!(quick.rows.progress.is_none());
    }

    fn number(value: f64) -> String {
        let mut text = String::new();
        push_number(&mut text, value);
        text
    }

    #[test]
    fn numbers_have_seventeen_digits_and_read_back() {
        assert_eq!(number(0.1), "0.10000000000000001");
        assert_eq!(number(-1.5), "-1.5000000000000000");
        assert_eq!(number(f64::NAN), "nan");
        assert_eq!(number(-0.000012345), format!("{:.21}", -0.000012345));
        assert_eq!(number(1234567890123456.0), "1234567890123456.0");
        for value in
            [1.0 / 3.0, 1e-5, 9.9e-6, 1e15, 1e16, -12.5, 1e-300, -2.5e17, 123456.789, 5e-324, f64::MAX]
        {
            assert_eq!(number(value).parse::<f64>(), Ok(value));
        }
    }

    #[test]
    fn digits_are_those_of_the_standard_library() {
        let check = |value: f64| {
            let expected = format!("{value:.16e}");
            let (head, exponent) = expected.split_once('e').unwrap();
            let expected = (head.replace('.', "").parse::<u64>().unwrap(), exponent.parse::<i32>().unwrap());
            assert_eq!(digits(value), expected, "{value:e}");
        };
        let mut seed = 5_u64;
        for i in 0..20_000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // 2⁻¹⁶ to 2⁵³
            let power = 1023 - 16 + i % 69;
            check(f64::from_bits(power << 52 | seed >> 12));
            // a few bits after the point: the digit after the last is a five, and nothing follows
            check(1.0 + (2 * i + 1) as f64 / 131_072.0);
        }
        for k in -5..16 {
            let power: f64 = format!("1e{k}").parse().unwrap();
            [power, power.next_up()].into_iter().for_each(check);
            if k > -5 {
                check(power.next_down());
            }
        }
    }
}
