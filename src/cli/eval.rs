//! `rfm eval`: ω and related values at points, as CSV with 17 significant digits.

use std::cell::OnceCell;
use std::io::{self, BufRead, BufWriter, Read, Write};
use std::path::Path;

use glam::DVec3;

use super::args::{Eval, Shared, What};
use super::failure::Failure;
use super::{choose, input, output};
use crate::cli::output::Shown;
use rfm::ir::Unary;
use rfm::solid::{Chosen, Distance, Distances};
use rfm::{Field, Precision, Solid};

/// Points that are evaluated at a time, so that memory stays small for any number of points.
const CHUNK: usize = 4096;

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
    let mut writer = Table::new(solid, chosen, options, shared.json)?;
    writer.rows(&options.at)?;
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
    reader: impl BufRead,
    name: &str,
    mut take: impl FnMut(&[DVec3]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut columns: Option<[usize; 3]> = None;
    let mut points = Vec::with_capacity(CHUNK);
    for (number, line) in reader.lines().enumerate() {
        let line = line.map_err(|e| Failure::usage(format!("cannot read `{name}`: {e}")))?;
        let line = line.trim_start_matches('\u{FEFF}').trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let bad = |what: String| Failure::usage(format!("{name}:{}: {what}", number + 1));
        let Some(at) = columns else {
            let find = |axis: &str| cells.iter().position(|cell| cell.trim_matches('"') == axis);
            columns = match (find("x"), find("y"), find("z")) {
                (Some(x), Some(y), Some(z)) => Some([x, y, z]),
                _ => return Err(bad(format!("expected the header `x,y,z`, found `{line}`"))),
            };
            continue;
        };
        let mut point = [0.0; 3];
        for (value, column) in point.iter_mut().zip(at) {
            let cell = cells.get(column).ok_or_else(|| bad(format!("the row has {} cells", cells.len())))?;
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
    solid: Solid,
    /// The program that keeps the file's tolerance. It computes ω where no gradient is needed.
    chosen: Option<Chosen>,
    what: Vec<What>,
    precision: Precision,
    /// The rows for JSON, which are collected because they are one document.
    json: Option<Vec<serde_json::Value>>,
    names: Vec<&'static str>,
    /// Made when a distance is first asked for.
    distances: OnceCell<Distances>,
    out: BufWriter<io::Stdout>,
}

impl Table {
    fn new(solid: Solid, chosen: Option<Chosen>, options: &Eval, json: bool) -> Result<Self, Failure> {
        let mut asked = options.what.clone();
        asked.sort_unstable();
        asked.dedup();
        let mut names = vec!["x", "y", "z"];
        for what in &asked {
            names.extend(match what {
                What::Value => &["omega"][..],
                What::Gradient => &["gx", "gy", "gz"],
                What::Sign => &["sign"],
                What::Distance => &["distance"],
                What::Clearance => &["clearance"],
                What::Normal => &["nx", "ny", "nz"],
            });
        }
        let mut out = BufWriter::new(io::stdout());
        if !json {
            writeln!(out, "{}", names.join(","))?;
        }
        let precision = options.precision.unwrap_or(Precision::F64);
        Ok(Self {
            solid,
            chosen,
            what: asked,
            precision,
            json: json.then(Vec::new),
            names,
            distances: OnceCell::new(),
            out,
        })
    }

    fn rows(&mut self, points: &[DVec3]) -> Result<(), Failure> {
        for &p in points {
            let values = self.values(p);
            match &mut self.json {
                None => {
                    let cells: Vec<String> = values.iter().map(|&v| number(v)).collect();
                    writeln!(self.out, "{}", cells.join(","))?;
                }
                Some(rows) => {
                    let row: serde_json::Map<String, serde_json::Value> = std::iter::zip(&self.names, values)
                        .map(|(name, value)| ((*name).to_string(), serde_json::Value::from(value)))
                        .collect();
                    rows.push(row.into());
                }
            }
        }
        Ok(())
    }

    fn values(&self, p: DVec3) -> Vec<f64> {
        let needs_gradient = self.what.iter().any(|w| matches!(w, What::Gradient | What::Normal));
        let (omega, gradient) = match (self.precision, needs_gradient) {
            (Precision::F64, true) => self.solid.omega_grad(p),
            (Precision::F64, false) => {
                let omega = self.chosen.as_ref().map_or_else(|| self.solid.omega(p), |c| c.omega(p));
                (omega, DVec3::NAN)
            }
            (Precision::F32, true) => {
                let (omega, gradient) = self.solid.omega_grad_f32(p.as_vec3());
                (omega.into(), gradient.as_dvec3())
            }
            (Precision::F32, false) => (self.solid.omega_f32(p.as_vec3()).into(), DVec3::NAN),
        };
        let found = OnceCell::new();
        let distance = || *found.get_or_init(|| self.distances().at(p));
        let mut row = p.to_array().to_vec();
        for what in &self.what {
            match what {
                What::Value => row.push(omega),
                What::Gradient => row.extend(gradient.to_array()),
                // a tolerance holds for values only; the sign comes from the twin
                What::Sign if self.chosen.is_some() => row.push(self.solid.sign(p)),
                What::Sign => row.push(Unary::Sign.eval(omega)),
                What::Distance => row.push(match self.precision {
                    Precision::F64 => distance().estimate,
                    Precision::F32 => self.solid.distance_f32(p.as_vec3()).into(),
                }),
                What::Clearance => row.push(distance().clearance),
                What::Normal => row.extend(self.normal(p, gradient).to_array()),
            }
        }
        row
    }

    /// The outward unit normal. Where ω has no gradient, as at centres, it points away from the nearest point of
    /// the surface, or towards it from inside; NaN where surfaces touch.
    fn normal(&self, p: DVec3, gradient: DVec3) -> DVec3 {
        let length = gradient.length();
        if length > 0.0 {
            return -gradient / length;
        }
        let Distance { estimate, nearest, .. } = self.distances().at(p);
        (p - nearest) / estimate
    }

    fn distances(&self) -> &Distances {
        self.distances.get_or_init(|| Distances::new(&self.solid))
    }

    fn finish(mut self) -> Result<(), Failure> {
        self.out.flush()?;
        match self.json {
            Some(points) => output::json(&Document { schema: 1, points }),
            None => Ok(()),
        }
    }
}

/// The number with 17 significant digits, which read back to the same number. NaN is `nan`, infinities are
/// `inf` and `-inf`.
fn number(value: f64) -> String {
    if value.is_nan() {
        return "nan".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "inf".into() } else { "-inf".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let scientific = format!("{value:.16e}");
    let exponent: i32 = scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    if (-5..16).contains(&exponent) { format!("{value:.*}", (16 - exponent) as usize) } else { scientific }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_seventeen_digits_and_read_back() {
        assert_eq!(number(0.1), "0.10000000000000001");
        assert_eq!(number(-1.5), "-1.5000000000000000");
        assert_eq!(number(f64::NAN), "nan");
        for value in [1.0 / 3.0, 1e-300, -2.5e17, 123456.789, 5e-324, f64::MAX] {
            assert_eq!(number(value).parse::<f64>(), Ok(value));
        }
    }
}
