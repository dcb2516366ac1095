//! Writes `include/rfm.h` from the source of the bindings; with `--check`, says whether the file is that.

use std::path::Path;
use std::process::ExitCode;

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml"))?;
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in ["lib", "error", "program", "solid", "columns", "mathematics"] {
        builder = builder.with_src(folder.join("src").join(file).with_extension("rs"));
    }
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
