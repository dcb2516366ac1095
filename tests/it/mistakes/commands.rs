//! Commands with one mistake each, and their exit codes.

use crate::tool::{rfm, snapshot};

const POST: &str = "rfm 1
param d = 8 mm in 1 mm .. 5 cm \"width of the post\"
param alpha = 10 deg
param rate = 30 rpm
solid post = cylinder(d, 0.3).move([0.5, 0.5, 0]).rotate_z(alpha*0)
solid nothing = post and z <= -1
scene drop {
  box { max: [1, 1, 1] }
  fluid { shape: ball([0.5, 0.5, 0.7], 0.2), spacing: 5 cm, velocity: [0, 0, -rate] }
  obstacle { solid: post }
  run { until: 20 ms, save_every: 10 ms }
}
";

/// Commands with one mistake, and their exit codes.
const COMMANDS: &[(&[&str], i32)] = &[
    (&["check", "post.rfm"], 0),
    (&["check", "post.rfm", "-D", "d=9mm", "-D", "alpha=20 deg", "-D", "rate=60rpm"], 0),
    (&["check", "post.rfm", "-D", "d=0.009"], 0),
    (&["check", "post.rfm", "-D", "d=8"], 2),
    (&["check", "post.rfm", "-D", "d=8 kg"], 2),
    (&["check", "post.rfm", "-D", "d=8 furlong"], 2),
    (&["check", "post.rfm", "-D", "d=80 mm"], 2),
    (&["check", "post.rfm", "-D", "alpha=ten"], 2),
    (&["mesh", "post.rfm", "--resolution", "50"], 2),
    (&["export", "post.rfm"], 2),
    (&["eval", "post.rfm", "--points", "nofile.csv"], 2),
    (&["check", "tiny.rfm"], 0),
    (&["check", "empty.rfm"], 1),
    (&["check", "post.rfm", "-s", "post", "--slice", "z=5", "-o", "s.svg"], 0),
    (&["check", "post.rfm", "-s", "post", "--slice", "z=5", "-o", "s.svg", "--deny", "warnings"], 1),
    (&["check", "post.rfm", "-s", "post", "--slice", "z=10 kg", "-o", "s.svg"], 2),
    (&["check", "post.rfm", "-s", "post", "--slice", "z=50mm", "-o", "s.svg"], 0),
    (&["mesh", "post.rfm", "-s", "post", "--cells", "100000", "-o", "p.stl"], 2),
    (&["mesh", "post.rfm", "-s", "post", "--cells", "1", "-o", "p.stl"], 2),
    (&["mesh", "post.rfm", "-s", "post", "--cell", "1nm", "-o", "p.stl"], 2),
    (&["mesh", "post.rfm", "-s", "post", "--cell", "10 deg", "-o", "p.stl"], 2),
    (&["mesh", "post.rfm", "-s", "post", "--unit", "furlong", "-o", "p.stl"], 2),
    (&["mesh", "post.rfm", "-s", "post", "--unit", "mm", "-o", "p.glb"], 2),
    (&["mesh", "post.rfm", "-s", "nothing", "-o", "p.stl"], 1),
    (&["mesh", "post.rfm", "-s", "post", "--box", "2,2,2,3,3,3", "-o", "p.stl"], 1),
    (&["mesh", "post.rfm", "-s", "nothing", "--json"], 1),
    (&["run", "post.rfm", "--until", "5 kg"], 2),
    (&["run", "post.rfm", "--until", "soon"], 2),
    (&["run", "post.rfm", "--steps", "-5"], 2),
    (&["run", "post.rfm", "--steps", "1", "-o", "-"], 2),
    (&["run", "post.rfm", "--camera", "0,0,0"], 2),
    (&["run", "post.rfm", "--camera", "above"], 2),
    (&["run", "post.rfm", "--cut", "0.5"], 2),
    (&["run", "post.rfm", "--cut", "half"], 2),
    (&["run", "post.rfm", "--hide", "pots", "-o", "hidden"], 2),
    (&["check", "post.rfm", "-s", "post", "--slice", "z=0", "-o", "s.svg"], 0),
    (&["run", "post.rfm", "--until", "10ms", "--no-pictures"], 0),
    (&["run", "post.rfm", "--until", "20ms", "--no-pictures"], 2),
    (&["run", "post.rfm", "--until", "20ms", "--no-pictures", "--force", "--resume"], 2),
    (&["run", "post.rfm", "--until", "0.02 s", "--no-pictures", "--force"], 0),
    (&["run", "post.rfm", "--until", "0.04 s", "--no-pictures", "--resume"], 0),
    (&["check", "no\u{1b}[31m\nsuch\u{202e}.rfm"], 2),
    (&["check", "post.rfm", "--colour\u{9b}31m"], 2),
    (&["mesh", "post.rfm", "-o", "a\u{202e}b/p.stl"], 2),
    (&["explain", "\u{1b}]0;title\u{7}"], 2),
    (&["check", "red.rfm"], 0),
    (&["post.rfm"], 2),
    (&["mesh", "post.rfm", "-s", "post", "--cells", "5mm", "-o", "p.stl"], 2),
    (&["eval", "post.rfm", "--what", "omega", "--at", "0,0,0"], 2),
    (&["eval", "post.rfm", "--at", "1", "2", "3"], 2),
    (&["run", "post.rfm", "--save-every", "0.1"], 2),
    (&["check", "post.rfm", "-D", "particles=1000"], 2),
    (&["check", "post.rfm", "-s", "post", "--slice", "z=0.1,z=5", "-o", "s.svg"], 0),
    (&["run", "post.rfm", "--until", "1", "s"], 2),
    (&["run", "post.rfm", "--rate", "20rpm"], 2),
    (&["render", "post.out", "--time", "0.5"], 2),
    (&["mesh", "post.rfm", "-s", "post", "--simplify", "-1mm", "-o", "p.stl"], 2),
    (&["run", "post.rfm", "-s", "drop"], 2),
    (&["run", "post.rfm", "--until", "-1", "-o", "fresh"], 2),
    (&["eval", "post.rfm", "--sweep", "d=1mm..2mm:2"], 2),
    (&["check", "post"], 2),
    (&["run", "empty.rfm", "--json"], 1),
    (&["run", "post.rfm", "--json", "-D", "d=80 mm"], 2),
    (&["mesh", "nofile.rfm", "--json"], 2),
    (&["check", "nofile.rfm", "--json"], 2),
    (&["check", "tiny.rfm", "-s", "post", "--json"], 2),
    (&["fmt", "nofile.rfm", "--json"], 2),
    (&["mesh", "post.rfm", "post"], 2),
    (&["run", "post.rfm", "drop"], 2),
    (&["check", "post.rfm", "post"], 2),
    (&["check", "post.rfm", "--sweep", "d=4..8:3"], 2),
    (&["eval", "tiny.rfm", "--at", "1mm,0,nan"], 2),
    (&["eval", "tiny.rfm", "--at", "1e308,0,0"], 0),
    (&["run", "post.rfm", "--steps", "1", "--cut", "x=9", "-o", "uncut"], 0),
];

#[test]
fn commands_with_one_mistake() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("post.rfm", POST);
    write("tiny.rfm", "rfm 1\nsolid dust = sphere(1 mm)\n");
    write("empty.rfm", "");
    write("red.rfm", "rfm 1\nparam r = 1 \"\u{1b}[31mred\u{9b}0m\u{202e}\"\nsolid ball = sphere(r)\n");
    let mut all = String::new();
    for (arguments, code) in COMMANDS {
        let outcome = rfm(folder.path(), arguments).expect(*code);
        for (what, text) in [("output", &outcome.stdout), ("messages", &outcome.stderr)] {
            assert!(
                !text.contains(rfm::diagnostic::is_hidden),
                "{arguments:?}: hidden characters in the {what}"
            );
        }
        let told: String = outcome.transcript().lines().map(|line| without_times(line) + "\n").collect();
        let line: String = arguments.join(" ").chars().flat_map(char::escape_debug).collect();
        all += &format!("──── rfm {line}\n{told}\n");
    }
    snapshot("mistakes", "commands", &all);
}

/// A line with `#` for the figures that differ from run to run.
fn without_times(line: &str) -> String {
    let is_timed =
        ["milliseconds", " ms per step", "evaluations of ω"].iter().any(|word| line.contains(word));
    if !is_timed {
        return line.to_string();
    }
    let words =
        line.split(' ').map(|word| if word.contains(|c: char| c.is_ascii_digit()) { "#" } else { word });
    words.collect::<Vec<_>>().join(" ")
}
