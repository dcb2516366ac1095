//! Writes `include/rfm.h` from the source of the bindings; with `--check`, says whether the file is that.

use std::path::Path;
use std::process::ExitCode;

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml"))?;
    // the modules that it names are read with it
    let library = folder.join("src/lib.rs");
    let builder = cbindgen::Builder::new().with_config(config).with_src(library);
    let mut header = Vec::new();
    builder.generate()?.write(&mut header);
    let path = folder.join("include/rfm.h");
    if std::env::args().any(|argument| argument == "--check") {
        if std::fs::read(&path)? == header {
            return Ok(ExitCode::SUCCESS);
        }
        eprintln!("include/rfm.h is not what the source says: run `cargo run -p rfm-header`");
        return Ok(ExitCode::FAILURE);
    }
    std::fs::write(path, header)?;
    Ok(ExitCode::SUCCESS)
}
