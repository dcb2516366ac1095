//! A script that opens the folder of a run in ParaView.

use std::path::Path;

use super::super::failure::Failure;
use super::super::output;
use rfm::Experiment;

/// The name of the script in the folder of a run. One named `paraview.py` would hide the package that it imports.
pub(super) const NAME: &str = "open_in_paraview.py";

const SCRIPT: &str = include_str!("open_in_paraview.py");

/// Writes the script into the folder of a run. Its colours end at a speed, m/s, as those of the pictures do.
pub(super) fn write(folder: &Path, experiment: &Experiment, fastest: f64) -> Result<(), Failure> {
    let domain = experiment.domain();
    let whole = std::path::absolute(folder)?;
    let number = |x: f64| format!("{x:?}");
    let corner = |p: [f64; 3]| format!("{p:?}");
    // the text of a string is one in Python, too: both have the escapes of JSON
    let path = serde_json::to_string(&whole.to_string_lossy()).map_err(std::io::Error::other)?;
    let script = SCRIPT
        .replace("{radius}", &number(0.5 * experiment.parameters().spacing()))
        .replace("{fastest}", &number(fastest))
        .replace("{low}", &corner(domain.min.to_array()))
        .replace("{high}", &corner(domain.max.to_array()))
        .replace("{folder}", &path);
    output::write(&folder.join(NAME), |out| out.write_all(script.as_bytes()))
}
