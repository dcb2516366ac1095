//! The state from which a run continues bit for bit, and its form in bytes.
//!
//! ```text
//! "rfm run\n" │ version u32 │ fingerprint [u8; 32] │ steps u64 │ time f64 │ particles u64, their ids u32 …
//!             │ columns u32 │ name: length u32, UTF-8 │ length u64, f64 … │ … │ BLAKE3 of all that [u8; 32]
//! ```
//!
//! Numbers are little-endian and keep all their digits. Particles stand in the solver's order, because the
//! order of sums decides their last digit. Columns have names, so each method keeps only what it needs, and a
//! caller can add its own.
//!
//! Invariant: bytes that were cut off or changed are never taken for a checkpoint.

use std::io::{self, Write};
use std::{error, fmt};

use super::particles::{Particles, Vectors};

const MAGIC: [u8; 8] = *b"rfm run\n";

/// Version of the layout above and of the meaning of the columns.
const VERSION: u32 = 6;

/// Names of the columns that hold components of vectors.
pub(super) const VECTORS: [&str; 9] = [
    "position x",
    "position y",
    "position z",
    "velocity x",
    "velocity y",
    "velocity z",
    "acceleration x",
    "acceleration y",
    "acceleration z",
];

/// The state of a simulation between two steps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Checkpoint {
    /// Fingerprint of everything that must not change when a run is continued. The caller sets and compares
    /// it.
    pub fingerprint: [u8; 32],
    /// Number of steps taken.
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Numbers of the particles, in the solver's order.
    pub ids: Vec<u32>,
    columns: Vec<(String, Vec<f64>)>,
}

/// Why bytes are not a checkpoint, or not one for this simulation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CheckpointError {
    /// The bytes do not begin like a checkpoint.
    Foreign,
    /// A program with another version of the format wrote it.
    Version(u32),
    /// It was cut off or changed: the checksum does not fit.
    Damaged,
    /// A column that the method needs, with this name, is missing or does not have a number for each
    /// particle.
    Column(String),
}

impl fmt::Display for CheckpointError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Foreign => write!(f, "it is no checkpoint of a run"),
            Self::Version(found) => {
                write!(f, "it has version {found} of the format, this program reads version {VERSION}")
            }
            Self::Damaged => write!(f, "it is damaged: its checksum does not fit"),
            Self::Column(name) => write!(f, "it has no `{name}` for this method"),
        }
    }
}

impl error::Error for CheckpointError {}

impl Checkpoint {
    /// The name of the file for the checkpoint after this many steps.
    pub fn file_name(steps: u64) -> String {
        format!("step_{steps:010}.checkpoint")
    }

    /// The number of steps in the [name of a file](Self::file_name); `None` if it is no checkpoint's name.
    pub fn steps_of_file(name: &str) -> Option<u64> {
        name.strip_prefix("step_")?.strip_suffix(".checkpoint")?.parse().ok()
    }

    /// Stores numbers under a name. They replace those that had the name before.
    pub fn set(&mut self, name: &str, values: Vec<f64>) {
        self.columns.retain(|(other, _)| other != name);
        self.columns.push((name.to_string(), values));
    }

    /// The numbers with a name.
    ///
    /// # Errors
    /// [`CheckpointError::Column`] if there are none with this name.
    pub fn get(&self, name: &str) -> Result<&[f64], CheckpointError> {
        let found = self.columns.iter().find(|(other, _)| other == name);
        found.map(|(_, values)| &values[..]).ok_or_else(|| CheckpointError::Column(name.to_string()))
    }

    /// All names, each with its numbers.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.columns.iter().map(|(name, values)| (&**name, &**values))
    }

    /// The numbers with a name, one for each particle.
    pub(super) fn of_particles(&self, name: &str) -> Result<Vec<f64>, CheckpointError> {
        let values = self.get(name)?;
        if values.len() == self.ids.len() {
            Ok(values.to_vec())
        } else {
            Err(CheckpointError::Column(name.to_string()))
        }
    }

    pub(super) fn particles(&self) -> Result<Particles, CheckpointError> {
        let mut particles = Particles {
            id: self.ids.clone(),
            density: self.of_particles("density")?,
            pressure: self.of_particles("pressure")?,
            ..Particles::default()
        };
        let vectors = [&mut particles.position, &mut particles.velocity];
        for (name, column) in VECTORS.iter().zip(vectors.into_iter().flat_map(Vectors::components_mut)) {
            *column = self.of_particles(name)?;
        }
        Ok(particles)
    }

    /// Writes the checkpoint in the format above.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let mut out = Hashed { out, hasher: blake3::Hasher::new() };
        out.write_all(&MAGIC)?;
        out.write_all(&VERSION.to_le_bytes())?;
        out.write_all(&self.fingerprint)?;
        out.write_all(&self.steps.to_le_bytes())?;
        out.write_all(&self.time.to_le_bytes())?;
        out.write_all(&(self.ids.len() as u64).to_le_bytes())?;
        out.numbers(&self.ids, |id| id.to_le_bytes())?;
        out.write_all(&(self.columns.len() as u32).to_le_bytes())?;
        for (name, values) in &self.columns {
            out.write_all(&(name.len() as u32).to_le_bytes())?;
            out.write_all(name.as_bytes())?;
            out.write_all(&(values.len() as u64).to_le_bytes())?;
            out.numbers(values, |x| x.to_le_bytes())?;
        }
        let hash = out.hasher.finalize();
        out.out.write_all(hash.as_bytes())
    }

    /// Reads a checkpoint.
    ///
    /// # Errors
    /// [`CheckpointError`] says why the bytes are not one.
    pub fn read(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(CheckpointError::Foreign)?;
        // check the version first: other versions may have other checksums
        let version = rest.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
        if let Some(version) = version.filter(|version| *version != VERSION) {
            return Err(CheckpointError::Version(version));
        }
        let (body, hash) = bytes.split_last_chunk::<32>().ok_or(CheckpointError::Damaged)?;
        if blake3::hash(body) != *hash {
            return Err(CheckpointError::Damaged);
        }
        Self::read_body(&mut Reader(&body[MAGIC.len() + 4..])).ok_or(CheckpointError::Damaged)
    }

    /// Reads what stands between version and checksum; `None` if it is not complete.
    fn read_body(from: &mut Reader<'_>) -> Option<Self> {
        let fingerprint = from.take()?;
        let (steps, time) = (u64::from_le_bytes(from.take()?), f64::from_le_bytes(from.take()?));
        let ids = from.numbers(u32::from_le_bytes)?;
        let mut columns = Vec::new();
        for _ in 0..u32::from_le_bytes(from.take()?) {
            let length = u32::from_le_bytes(from.take()?) as usize;
            let name = std::str::from_utf8(from.split(length)?).ok()?.to_string();
            columns.push((name, from.numbers(f64::from_le_bytes)?));
        }
        from.0.is_empty().then_some(Self { fingerprint, steps, time, ids, columns })
    }
}

/// A writer that hashes all bytes that it passes on.
struct Hashed<'a, W> {
    out: &'a mut W,
    hasher: blake3::Hasher,
}

impl<W: Write> Hashed<'_, W> {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.out.write_all(bytes)
    }

    /// Writes many numbers at a time, so that neither the hash nor the writer handles single ones.
    fn numbers<T: Copy, const N: usize>(&mut self, values: &[T], bytes: fn(T) -> [u8; N]) -> io::Result<()> {
        let mut buffer = Vec::with_capacity(N * 4096);
        for chunk in values.chunks(4096) {
            buffer.clear();
            buffer.extend(chunk.iter().flat_map(|&x| bytes(x)));
            self.write_all(&buffer)?;
        }
        Ok(())
    }
}

/// The bytes that remain to be read. All lengths are checked against them.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*taken)
    }

    fn split(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    /// Reads a count and that many numbers.
    fn numbers<T, const N: usize>(&mut self, number: fn([u8; N]) -> T) -> Option<Vec<T>> {
        let count = usize::try_from(u64::from_le_bytes(self.take()?)).ok()?;
        let bytes = self.split(count.checked_mul(N)?)?;
        Some(bytes.as_chunks::<N>().0.iter().map(|bytes| number(*bytes)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::{Dfsph, Method, Parameters, Precision, SetupError, Simulation, Slip, Wcsph, scenes};

    fn methods() -> [Parameters; 3] {
        let water = Parameters {
            particle_mass: 0.05,
            viscosity: 0.5,
            surface_tension: 0.0,
            slip: Slip::No,
            adaptive: true,
            precision: Precision::F32,
            ..Parameters::paper()
        };
        let wcsph = Wcsph { sound_speed: Some(30.0), ..Wcsph::default() };
        [
            Parameters::paper(),
            Parameters { method: Method::Wcsph(wcsph), ..water.clone() },
            Parameters { method: Method::Dfsph(Dfsph::default()), ..water },
        ]
    }

    #[test]
    fn a_resumed_run_has_the_bits_of_one_that_never_stopped() {
        let pawn = scenes::pawn();
        for parameters in methods() {
            let name = parameters.method.name();
            let mut straight = scenes::drop_on(&pawn, parameters.clone(), 1500);
            let mut first = scenes::drop_on(&pawn, parameters.clone(), 1500);
            // long enough that the drop lies on the pawn when it is cut
            for _ in 0..300 {
                straight.step().unwrap();
            }
            for _ in 0..150 {
                first.step().unwrap();
            }
            let mut bytes = Vec::new();
            first.checkpoint().write(&mut bytes).unwrap();
            drop(first);
            let read = Checkpoint::read(&bytes).unwrap();
            let obstacles = vec![scenes::obstacle(&pawn)];
            let mut second = Simulation::resume(parameters, &read, scenes::BOX, obstacles).unwrap();
            assert_eq!(second.checkpoint(), read, "{name}");
            for _ in 0..150 {
                second.step().unwrap();
            }
            assert!(second.checkpoint() == straight.checkpoint(), "{name}");
        }
    }

    #[test]
    fn a_method_saves_what_it_declares() {
        let pawn = scenes::pawn();
        let names = |parameters: &Parameters| {
            let checkpoint = scenes::drop_on(&pawn, parameters.clone(), 50).checkpoint();
            checkpoint.columns.into_iter().map(|(name, _)| name).collect::<Vec<_>>()
        };
        let [paper, ..] = &methods();
        let of_all_methods = names(paper);
        for parameters in methods() {
            let own: Vec<String> =
                names(&parameters).into_iter().filter(|name| !of_all_methods.contains(name)).collect();
            assert_eq!(own, parameters.method.info().saves, "{}", parameters.method.name());
        }
    }

    #[test]
    fn a_checkpoint_of_another_method_is_refused() {
        let pawn = scenes::pawn();
        let [paper, wcsph, dfsph] = methods();
        let of_paper = scenes::drop_on(&pawn, paper, 50).checkpoint();
        for (parameters, column) in [(wcsph, "places"), (dfsph, "specific pressure")] {
            let resumed = Simulation::resume(parameters, &of_paper, scenes::BOX, Vec::new());
            let error = SetupError::Checkpoint(CheckpointError::Column(column.into()));
            assert_eq!(resumed.err(), Some(error));
        }
    }

    fn example() -> (Checkpoint, Vec<u8>) {
        let mut checkpoint = Checkpoint {
            fingerprint: [7; 32],
            steps: 12,
            time: 0.1 + 0.2,
            ids: vec![2, 0, 1],
            ..Checkpoint::default()
        };
        checkpoint.set("x", vec![1.0, f64::MIN_POSITIVE, -0.0]);
        checkpoint.set("own", vec![]);
        let mut bytes = Vec::new();
        checkpoint.write(&mut bytes).unwrap();
        (checkpoint, bytes)
    }

    #[test]
    fn files_are_named_after_their_steps() {
        for steps in [0, 7, 12_345_678_901] {
            assert_eq!(Checkpoint::steps_of_file(&Checkpoint::file_name(steps)), Some(steps));
        }
        for foreign in ["step_.checkpoint", "step_12.vtp", "notes.checkpoint"] {
            assert_eq!(Checkpoint::steps_of_file(foreign), None, "{foreign}");
        }
    }

    #[test]
    fn what_was_written_is_read() {
        let (checkpoint, bytes) = example();
        assert_eq!(Checkpoint::read(&bytes), Ok(checkpoint.clone()));
        assert_eq!(checkpoint.get("y"), Err(CheckpointError::Column("y".into())));
        assert_eq!(checkpoint.of_particles("own"), Err(CheckpointError::Column("own".into())));
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_noticed() {
        let (_, bytes) = example();
        for end in 0..bytes.len() {
            assert!(Checkpoint::read(&bytes[..end]).is_err(), "cut off at {end}");
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 1 << (at % 8);
            let error = Checkpoint::read(&changed).unwrap_err();
            let expected = match at {
                0..8 => CheckpointError::Foreign,
                8..12 => CheckpointError::Version(VERSION ^ (1 << (8 * (at - 8) + at % 8))),
                _ => CheckpointError::Damaged,
            };
            assert_eq!(error, expected, "byte {at}");
        }
        let longer = [&bytes[..], &[0]].concat();
        assert_eq!(Checkpoint::read(&longer), Err(CheckpointError::Damaged));
    }

    #[test]
    fn lengths_beyond_the_end_are_damage_even_under_a_sound_checksum() {
        let (_, bytes) = example();
        let count = MAGIC.len() + 4 + 32 + 8 + 8;
        for length in [4u64, u64::MAX, u64::MAX / 4] {
            let mut changed = bytes[..bytes.len() - 32].to_vec();
            changed[count..count + 8].copy_from_slice(&length.to_le_bytes());
            let hash = blake3::hash(&changed);
            changed.extend(hash.as_bytes());
            assert_eq!(Checkpoint::read(&changed), Err(CheckpointError::Damaged));
        }
    }
}
