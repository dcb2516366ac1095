//! What runs write, compared with the page that describes it: every key, column and array, and the other way round.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::tool::{rfm, root};

/// A run with everything that a summary can tell of.
const ALL: &str = "rfm 1
solid post = cylinder(0.1, 0.3).move([0.5, 0.5 + 0.1*t, 0])
scene drop {
  box { max: [1, 1, 1] }
  fluid water { shape: ball([0.5, 0.52, 0.45], 0.14), fill: middle, spacing: 0.03 }
  obstacle { solid: post }
  truth { pressure: 1000*z, velocity: [0, 0, -9.81*t], front: 0.6 }
  run { until: 20 ms, save_every: 10 ms }
  probe level { height: [0.5, 0.52], every: 1 ms, from: 2 ms, known: 0.5 }
  probe head { pressure: [0.5, 0.52, 0.45] }
  probe wind { velocity: [0.5, 0.52, 0.45] }
  probe load { force: post }
  probe fall { flux { point: [0.5, 0.5, 0.4], normal: [0, 0, -1] } }
  probe balance { energy: water }
  probe check { audit: water }
}
";

/// A fluid without energy, which cannot be judged.
const AT_REST: &str = "rfm 1
scene still {
  box { max: [1, 1, 1] }
  fluid water { shape: ball([0.5, 0.5, 0.5], 0.2), spacing: 0.05, sound_speed: 10 m/s }
  gravity: [0, 0, 0]
  run { until: 2 ms, save_every: 1 ms }
}
";

/// The words in code at the beginning of entries, in the part of the page under a title.
fn listed(page: &str, title: &str) -> BTreeSet<String> {
    let (_, part) = page.split_once(&format!("## {title}\n")).unwrap_or_else(|| panic!("no {title}"));
    let part = part.split("\n## ").next().unwrap();
    let entries = part.lines().filter_map(|line| line.strip_prefix("- `"));
    entries.map(|entry| entry.split_once('`').unwrap().0.to_string()).collect()
}

fn keys(value: &Value, prefix: &str) -> BTreeSet<String> {
    value.as_object().unwrap().keys().map(|key| format!("{prefix}{key}")).collect()
}

/// The arrays of a file for ParaView, without those of its cells.
fn arrays(path: &Path) -> BTreeSet<String> {
    let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
    let names = text.split("Name=\"").skip(1).map(|part| part.split('"').next().unwrap().to_string());
    names.filter(|name| !["connectivity", "offsets"].contains(&name.as_str())).collect()
}

fn columns(path: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(path).unwrap();
    let (time, columns) = text.lines().next().unwrap().split_once(',').unwrap();
    assert_eq!(time, "time [s]");
    columns.split(',').map(String::from).collect()
}

#[test]
fn all_that_runs_write_is_described_and_nothing_else() {
    let page = std::fs::read_to_string(root().join("grammar/outputs.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = |name: &str, text: &str, flags: &[&str]| -> Value {
        let file = format!("{name}.rfm");
        std::fs::write(here.join(&file), text).unwrap();
        let always = ["run", &file, "--mesh-cells", "8", "--json", "-o", name];
        rfm(here, &[&always[..], flags].concat()).expect(0).json()
    };
    run("all", ALL, &["--until", "10ms"]);
    let out = here.join("all");
    let table = std::fs::read_to_string(out.join("probes/level.csv")).unwrap();
    let torn: Vec<&str> = table.lines().take(5).collect();
    std::fs::write(out.join("probes/level.csv"), torn.join("\n") + "\n").unwrap();
    let summary = run("all", ALL, &["--resume"]);
    let still = run("still", AT_REST, &[]);

    let mut written = keys(&summary, "");
    written.append(&mut keys(&still, ""));
    assert_eq!(written, listed(&page, "Keys of `summary.json`"));
    let means = keys(&summary["probes"][0], "probes[].");
    assert_eq!(means, listed(&page, "Keys of each of `probes` in it"));
    assert_eq!(
        summary,
        serde_json::from_slice::<Value>(&std::fs::read(out.join("summary.json")).unwrap()).unwrap()
    );

    let title = "Arrays of `particles_*.vtp`";
    assert_eq!(arrays(&out.join("frames/particles_000001.vtp")), listed(&page, title));
    let title = "Arrays of `obstacle.vtp` and `obstacle_*.vtp`";
    assert_eq!(arrays(&out.join("obstacle.vtp")), listed(&page, title));
    assert_eq!(arrays(&out.join("frames/obstacle_000001.vtp")), listed(&page, title));

    let probes = ["level", "head", "wind", "load", "fall", "balance", "check"];
    let probes = probes.map(|name| out.join(format!("probes/{name}.csv")));
    let own = ["energy", "audit"].map(|name| out.join(format!("history/{name}.csv")));
    let found = probes.iter().chain(&own).flat_map(|path| columns(path)).collect::<BTreeSet<_>>();
    assert_eq!(found, listed(&page, "Columns of tables"));
    assert_eq!(files(&out), listed(&page, "Files"));
}

/// The files of a run, with `*` in place of names that differ; without the lock, and plots of probes, which are told of
/// with their tables.
fn files(out: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(out).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_file() {
            found.insert(name);
            continue;
        }
        for file in std::fs::read_dir(entry.path()).unwrap() {
            let file = file.unwrap().file_name().to_string_lossy().into_owned();
            let shown = match (name.as_str(), file.rsplit_once('_')) {
                ("checkpoints", _) => "*".to_string(),
                ("probes", _) if !file.ends_with(".csv") => continue,
                ("probes", _) => "*.csv".to_string(),
                ("frames" | "pictures", Some((what, number))) => {
                    format!("{what}_*.{}", number.rsplit_once('.').unwrap().1)
                }
                (_, _) => file,
            };
            found.insert(format!("{name}/{shown}"));
        }
    }
    found.remove(".rfm.lock");
    found
}
