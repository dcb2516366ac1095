//! The viewer in a real browser: saved pages, live ones, what a person does with them. Pictures are left in a
//! folder and compared with those in `pictures/`.
//!
//! `cargo run` runs all cases; names as arguments choose some. Without a browser it says so and ends with 77.

mod browser;
mod cases;
mod exact;
mod live;
mod looks;
mod pictures;
mod program;
mod shaders;

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(program) = browser::installed() else {
        eprintln!("no browser is installed: the viewer is not tested in one");
        return ExitCode::from(77);
    };
    let chosen: Vec<String> = std::env::args().skip(1).collect();
    let shots =
        std::env::var_os("RFM_SHOTS").map_or_else(|| std::env::temp_dir().join("rfm-viewer"), PathBuf::from);
    std::fs::create_dir_all(&shots).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut room = cases::Room::prepare(&program, folder.path(), &shots);
    for (name, case) in cases::ALL {
        if chosen.is_empty() || chosen.iter().any(|part| name.contains(part.as_str())) {
            println!("{name}");
            case(&mut room);
            let complaints = room.browser.complaints();
            assert!(complaints.is_empty(), "{name}: {complaints:#?}");
        }
    }
    println!("all is well; the pictures are in {}", shots.display());
    ExitCode::SUCCESS
}
