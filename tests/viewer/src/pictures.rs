//! Pictures of pages: how much two of them differ, and those that are kept to compare with.

use std::path::{Path, PathBuf};

/// The largest mean difference of a channel from a kept picture, of 255. The same browser gives 0; without
/// the obstacle the picture of the pawn differs by 1.
const TOLERANCE: f64 = 0.5;

/// A picture: width, height and the bytes of red, green and blue.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<u8>,
}

impl Picture {
    pub fn of(png: &[u8]) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        let channels = info.color_type.samples();
        assert!(channels >= 3, "{:?}", info.color_type);
        let rgb = bytes.chunks_exact(channels).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        Self { width: info.width as usize, height: info.height as usize, rgb }
    }

    /// The mean difference of a channel, 0 … 255.
    pub fn difference(&self, other: &Self) -> f64 {
        assert_eq!((self.width, self.height), (other.width, other.height));
        let pairs = self.rgb.iter().zip(&other.rgb);
        pairs.map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / self.rgb.len() as f64
    }

    /// The part of the pixels for which something holds.
    pub fn part(&self, holds: impl Fn([u8; 3]) -> bool) -> f64 {
        let pixels = self.rgb.chunks_exact(3);
        pixels.filter(|p| holds([p[0], p[1], p[2]])).count() as f64 / (self.width * self.height) as f64
    }
}

/// Compares with the picture of this name that is kept, or keeps it if RFM_KEEP is set.
pub fn compare(name: &str, png: &[u8], shots: &Path) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("pictures").join(format!("{name}.png"));
    std::fs::write(shots.join(format!("{name}.png")), png).unwrap();
    if std::env::var_os("RFM_KEEP").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, png).unwrap();
        return;
    }
    let kept = Picture::of(&std::fs::read(&path).unwrap());
    let difference = Picture::of(png).difference(&kept);
    println!("  {name}: differs from the kept picture by {difference:.2} of 255");
    assert!(difference <= TOLERANCE, "{name} is in {}", shots.display());
}
