//! The contract of the commands: exit codes, what goes where, the keys of the documents, and complete files.

use std::path::Path;

use crate::tool::{rfm, rfm_reading, root, snapshot};

pub const PAWN: &str = "examples/pawn.rfm";

pub const SMALL: &str = "rfm 1
param r = 0.1 in 0.05 .. 0.2 \"radius of the post\"
solid post = cylinder(r, 0.3).move([0.5, 0.5, 0])
scene drop {
  box { max: [1, 1, 1] }
  fluid { shape: ball([0.5, 0.5, 0.7], 0.12), fill: middle, particles: 30, mass: 0.05, support_radius: 0.1 }
  obstacle { solid: post }
  method: paper
  run { dt: 1 ms, until: 10 ms, save_every: 5 ms }
}
";

fn keys(value: &serde_json::Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

/// All keys of the contract are there; `schema` is 1 and comes first in the text.
#[track_caller]
pub fn contract(text: &str, value: &serde_json::Value, expected: &[&str]) {
    assert!(text.trim_start().trim_start_matches('{').trim_start().starts_with("\"schema\": 1"), "{text}");
    let found = keys(value);
    for key in expected {
        assert!(found.contains(key), "no `{key}` in {found:?}");
    }
}

/// The names in a folder, sorted.
pub fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        // what a run locks stays in its folder
        .filter(|name| name != ".rfm.lock")
        .collect();
    names.sort();
    names
}

#[test]
fn help_and_usage() {
    for arguments in [
        &["--help"][..],
        &["check", "--help"],
        &["eval", "--help"],
        &["mesh", "--help"],
        &["build", "--help"],
        &["run", "--help"],
        &["report", "--help"],
        &["explain", "--help"],
    ] {
        let outcome = rfm(root(), arguments).expect(0);
        assert_eq!(outcome.stderr, "");
        snapshot("cli", &format!("help {}", arguments[0].trim_start_matches('-')), &outcome.stdout);
    }
    for (name, arguments) in [
        ("no command", &[][..]),
        ("unknown command", &["chekc", PAWN]),
        ("unknown flag", &["check", PAWN, "--slcie", "z=1"]),
        ("no file", &["check"]),
        ("missing file", &["check", "examples/none.rfm"]),
        ("folder as file", &["check", "examples"]),
        ("param that is no number", &["check", PAWN, "-D", "cx=wide"]),
        ("param without value", &["check", PAWN, "-D", "cx"]),
        ("unknown param", &["check", PAWN, "-D", "cxx=1"]),
        ("param out of range", &["check", PAWN, "-D", "cx=9"]),
        ("param not finite", &["check", PAWN, "-D", "particles=nan"]),
        ("unknown solid", &["mesh", PAWN, "-s", "pwan", "-o", "x.stl"]),
        ("unknown scene", &["run", PAWN, "--scene", "drpo"]),
        ("no scene", &["run", "tests/cases/stages/cube.rfm"]),
        ("mesh without output", &["mesh", PAWN]),
        ("mesh of an unknown format", &["mesh", PAWN, "-o", "pawn.3ds"]),
        ("mesh with no cells", &["mesh", PAWN, "--cells", "0", "-o", "pawn.stl"]),
        ("mesh with a cell of zero", &["mesh", PAWN, "--cell", "0", "-o", "pawn.stl"]),
        ("text of a format that has none", &["mesh", PAWN, "--ascii", "-o", "pawn.glb"]),
        ("mesh of an empty box", &["mesh", PAWN, "--box", "0,0,0,0,1,1", "-o", "pawn.stl"]),
        ("slice of an unknown axis", &["check", PAWN, "--slice", "w=1"]),
        ("slice of an unknown format", &["check", PAWN, "--slice", "z=1", "-o", "pawn.gif"]),
        ("point of two numbers", &["eval", PAWN, "--at", "1,2"]),
        ("no points", &["eval", PAWN]),
        ("file and points from stdin", &["eval", "-", "--points", "-"]),
        ("time before zero", &["run", PAWN, "--until", "-1"]),
        ("report of a flow that is not known", &["report", "examples/pawn.rfm:drop"]),
        ("report of an unknown name", &["report", "examples/pawn.rfm:dorp"]),
        ("report of a solid by methods", &["report", "examples/pawn.rfm:pawn", "--methods", "wcsph"]),
        ("report of no particles", &["report", "examples/pawn.rfm:drop", "--particles", "0"]),
        ("unknown message", &["explain", "E9999"]),
        ("unknown name to explain", &["explain", "examples/pawn.rfm:pwan"]),
    ] {
        let outcome = rfm(root(), arguments).expect(2);
        let data = &outcome.stdout;
        assert!(data.is_empty() || name == "slice of an unknown format", "{name}: {data}");
        assert!(!outcome.stderr.is_empty());
        snapshot(
            "cli",
            name,
            &format!("rfm {}\n{}exit {}\n", arguments.join(" "), outcome.stderr, outcome.code),
        );
    }
}

/// A file that is missing hides neither the messages of the others nor the document.
#[test]
fn other_files_are_checked_beside_one_that_is_missing() {
    let outcome =
        rfm(root(), &["check", PAWN, "none.rfm", "nor.rfm", "examples/cube.rfm", "--json"]).expect(2);
    let document: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(document["ok"], false);
    let names: Vec<_> = document["solids"].as_array().unwrap().iter().map(|solid| &solid["name"]).collect();
    assert_eq!(names, ["pawn", "cube"]);
    let reasons: Vec<_> = document["diagnostics"].as_array().unwrap().iter().collect();
    assert_eq!(reasons.len(), 2, "{reasons:?}");
    for (name, reason) in ["none.rfm", "nor.rfm"].into_iter().zip(reasons) {
        assert_eq!([&reason["code"], &reason["severity"], &reason["file"]], ["E0220", "error", name]);
        assert_eq!(reason["message"], format!("there is no file `{name}`"));
        assert!(outcome.stderr.contains(&format!("there is no file `{name}`")), "{}", outcome.stderr);
    }
}

/// `rfm explain` takes the name of a solid behind that of its file, and other commands by a flag.
#[test]
fn a_name_behind_that_of_a_file_leads_to_its_flag() {
    let outcome = rfm(root(), &["check", &format!("{PAWN}:pawn")]).expect(2);
    let hint = format!("a solid of `{PAWN}` is chosen by `--solid pawn`, and a scene by `--scene pawn`");
    assert!(outcome.stderr.contains(&hint), "{}", outcome.stderr);
}

/// Each file to begin with passes its check, and the one with a known outcome is near it.
#[test]
fn a_new_user_begins_with_a_file_that_works() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for template in ["obstacle", "experiment", "validation"] {
        let file = format!("{template}.rfm");
        let made = rfm(here, &["init", "--template", template]).expect(0);
        assert!(made.stdout.contains(&format!("written to {file}")), "{}", made.stdout);
        assert_eq!(rfm(here, &["check", &file, "--deny", "warnings"]).expect(0).stderr, "");
        assert!(!std::fs::read_to_string(here.join(&file)).unwrap().contains("FILE"), "{template}");
        let again = rfm(here, &["init", "--template", template]).expect(2);
        assert!(again.stderr.contains("--force"), "{}", again.stderr);
    }
    let run = rfm(here, &["run", "validation.rfm", "--json", "--no-frames"]).expect(0).json();
    assert!(run["pressure_error"].as_f64().unwrap() < 0.15, "{run}");
    rfm(here, &["run", "experiment.rfm", "--steps", "5", "--no-frames"]).expect(0);
}

#[test]
fn shells_and_man_know_every_command() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let text = rfm(folder.path(), &["completions", shell]).expect(0).stdout;
        assert!(text.contains("mesh-cells") && text.contains("init"), "{shell}");
    }
    let page = rfm(folder.path(), &["man"]).expect(0).stdout;
    assert!(page.starts_with(".ie"), "{page}");
    for part in
        ["[-D NAME=VALUE] … [-P|--params FILE] …", "[--max-nodes N]", "Operations that a file may unroll to"]
    {
        assert!(page.replace("\\-", "-").contains(part), "{part}: {page}");
    }
    rfm(folder.path(), &["man", "pages"]).expect(0);
    let of_man = std::fs::read_to_string(folder.path().join("pages/rfm-man.1")).unwrap();
    assert!(of_man.contains("[DIR]") && !of_man.contains("engine"), "{of_man}");
    for command in ["man", "completions", "lsp", "init"] {
        let help = rfm(folder.path(), &[command, "--help"]).expect(0).stdout;
        for option in ["-D", "--params", "--threads", "--json", "--engine", "--max-nodes", "--allow-outside"]
        {
            assert!(!help.contains(option), "{command} {option}: {help}");
        }
    }
    let help = rfm(folder.path(), &["init", "--help"]).expect(0).stdout;
    assert!(help.contains("--template") && help.contains("--help"), "{help}");
    // as an option of all commands it is still taken
    rfm(folder.path(), &["init", "-", "--threads", "2"]).expect(0);
    let page = std::fs::read_to_string(folder.path().join("pages/rfm-run.1")).unwrap();
    assert!(page.contains("Simulate"), "{page}");
}

#[test]
fn check_prints_facts() {
    snapshot("cli", "check", &rfm(root(), &["check", PAWN, "examples/cube.rfm"]).expect(0).transcript());
    let outcome = rfm_reading(root(), &["check", "-", "-D", "r=0.2"], SMALL.as_bytes()).expect(0);
    snapshot("cli", "check stdin", &outcome.transcript());
    snapshot("cli", "explain a code", &rfm(root(), &["explain", "e0106"]).expect(0).transcript());
    let list = rfm(root(), &["explain", "codes"]).expect(0).stdout;
    let codes: Vec<&str> = list.lines().map(|line| &line[..5]).collect();
    assert!(codes.len() > 50 && codes.contains(&"E0106") && codes.contains(&"W0408"), "{list}");
    assert!(
        list.lines().all(|line| line.len() > 20 && rfm::diagnostic::explain(&line[..5]).is_some()),
        "{list}"
    );
    snapshot(
        "cli",
        "explain a scene",
        &rfm(root(), &["explain", "examples/pawn.rfm:drop"]).expect(0).transcript(),
    );
}

/// Masks what depends on the processor: its name, and how many instructions it needs.
#[test]
fn explain_shows_what_was_dropped_and_why() {
    let solids = "rfm 1\nlet far = sphere(1).move([9, 0, 0])\nlet d = 0 - (x - 1)\n\
        solid s = ((-d <= 2 and not (not z >= -1) and z <= 1) or far) and abs(y) <= 0.5 and x^2 + y^2 + z^2 <= 200\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.rfm"), solids).unwrap();
    for (name, folder, subject) in [
        ("explain a solid", root(), "examples/pawn.rfm:pawn"),
        ("explain what is dropped", folder.path(), "s.rfm:s"),
    ] {
        let outcome = rfm(folder, &["explain", subject]).expect(0);
        let mask = |line: &str| match (line.find("operations"), line.contains("instructions")) {
            (Some(at), true) => format!("{}operations  # instructions\n", &line[..at]),
            _ if line.trim_start().starts_with("target:") => "  target: #\n".to_string(),
            _ => format!("{line}\n"),
        };
        let text: String = outcome.stdout.lines().map(mask).collect();
        let counts = outcome.stdout.matches(" instructions").count();
        assert_eq!(counts, 5, "{}", outcome.stdout);
        snapshot("cli", name, &text);
    }
}

#[test]
fn check_as_json() {
    let outcome = rfm(root(), &["check", "--json", PAWN]).expect(0);
    let document = outcome.json();
    contract(&outcome.stdout, &document, &["schema", "ok", "diagnostics", "solids"]);
    let solid = &document["solids"][0];
    for key in ["name", "empty", "bounds", "volume", "volume_error", "area", "components", "thin_cells"] {
        assert!(keys(solid).contains(&key), "{solid}");
    }
    assert_eq!(keys(&solid["bounds"]).len(), 2);
    // the paper's pawn: the fine reference is 0.44273 to 1e-3
    assert!((solid["volume"].as_f64().unwrap() - 0.4427).abs() < 2e-3, "{solid}");

    let outcome =
        rfm_reading(root(), &["check", "--json", "-"], "rfm 1\nlet α = 1\nsolid s = spere(α)".as_bytes());
    let document = outcome.expect(1).json();
    assert_eq!(document["ok"], false);
    let message = &document["diagnostics"][0];
    assert_eq!(message["code"], "E0201");
    assert_eq!(message["severity"], "error");
    assert_eq!(message["file"], "<stdin>");
    let place = ["line", "column", "end_line", "end_column"].map(|key| message[key].as_u64().unwrap());
    assert_eq!(place, [3, 11, 3, 16]);
    assert_eq!(message["help"], "did you mean `sphere`?");
    assert!(message["message"].as_str().unwrap().contains("spere"));
}

/// Plates along the grid, of which its usual cells or the coarser ones show nothing. The stated errors must hold.
#[test]
fn plates_between_the_nodes_are_measured_with_the_cells_that_they_need() {
    for thickness in [0.02, 0.025, 0.04] {
        let text = format!("rfm 1\nsolid s = box([0, 0, 0], [5, {thickness}, 1])\n");
        let outcome =
            rfm_reading(root(), &["check", "--json", "--budget", "60", "-"], text.as_bytes()).expect(0);
        let solid = outcome.json()["solids"][0].clone();
        let figure = |name: &str| solid[name].as_f64().unwrap_or_else(|| panic!("{name} of {solid}"));
        assert_eq!((&solid["resolved"], figure("components")), (&true.into(), 1.0), "{solid}");
        assert!((figure("volume") - 5.0 * thickness).abs() <= figure("volume_error") + 1e-12, "{solid}");
        assert!((figure("area") - 10.0 - 12.0 * thickness).abs() <= figure("area_error") + 1e-9, "{solid}");
        assert!(solid["no_volume"].is_null());
    }
}

#[test]
fn findings_and_denied_warnings() {
    let text = b"rfm 1\nlet spare = 1\nsolid s = sphere(1)";
    rfm_reading(root(), &["check", "-"], text).expect(0);
    rfm_reading(root(), &["check", "-", "--deny", "warnings"], text).expect(1);
    rfm_reading(root(), &["eval", "-", "--at", "0,0,0"], b"rfm 1\nsolid s = q").expect(1);
    rfm_reading(root(), &["mesh", "-", "--json"], b"rfm 1\nsolid s = q").expect(1);
    rfm_reading(root(), &["run", "-"], b"rfm 1\nsolid s = q").expect(1);
}

#[test]
fn slices_are_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let pawn = root().join(PAWN);
    let pawn = pawn.to_str().unwrap();
    rfm(folder.path(), &["check", pawn, "--slice", "y=1.5", "-o", "s.svg"]).expect(0);
    rfm(folder.path(), &["check", pawn, "--slice", "z=0.5", "-o", "s.png"]).expect(0);
    assert_eq!(files(folder.path()), ["s.png", "s.svg"]);
    let svg = std::fs::read_to_string(folder.path().join("s.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.contains("pawn"));
    let picture = std::fs::File::open(folder.path().join("s.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(picture)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    assert!(reader.next_frame(&mut pixels).unwrap().width > 300);
    // several planes and solids in one sheet, with one legend
    let sheet = |words: &[&str]| {
        let words = [&["check"][..], words, &["-o", "sheet.svg"]].concat();
        rfm(folder.path(), &words).expect(0);
        std::fs::read_to_string(folder.path().join("sheet.svg")).unwrap()
    };
    let planes = sheet(&[pawn, "--slice", "y=1.5,z=0.5,x=1.5"]);
    let once = ["y = 1.5 m<", "z = 0.5 m<", "x = 1.5 m<", "inside, ω"];
    assert_eq!(once.map(|text| planes.matches(text).count()), [1; 4]);
    let paddle = root().join("examples/paddle.rfm");
    let paddle = paddle.to_str().unwrap();
    let solids = sheet(&[paddle, "-s", "paddle,stirrer", "--slice", "z=0.2,y=0.05"]);
    for (text, count) in
        [(">paddle<", 1), (">stirrer<", 1), ("z = 0.2 m<", 1), ("fill=\"url(#hatch1-1)\"", 1)]
    {
        assert_eq!(solids.matches(text).count(), count, "{text}");
    }
    // distances are lengths: their levels are those of a ball, and arrows show the way out
    let ball = folder.path().join("ball.rfm");
    std::fs::write(&ball, "rfm 1\nsolid ball = sphere(0.5) and sphere(2)\n").unwrap();
    let ball = ball.to_str().unwrap();
    let distance =
        sheet(&[ball, "--slice", "z=0", "--plot", "distance", "--arrows", "--window", "-1,-1,1,1"]);
    assert!(
        distance.contains(">depth inside, m<")
            && distance.contains(">x, m<")
            && distance.contains(">z = 0 m<")
    );
    let numbers: Vec<f64> = distance
        .split("</text>")
        .filter_map(|part| part.rsplit_once('>')?.1.replace('−', "-").parse().ok())
        .collect();
    // half a metre to the middle, and √2 − ½ to the corners
    assert!(numbers.iter().all(|n| n.abs() <= 1.0), "{numbers:?}");
    assert!(numbers.contains(&0.4) && numbers.contains(&-0.6), "{numbers:?}");
    let heads = distance.matches('z').count();
    assert!(heads > 150, "{heads} arrow heads");
    for words in [
        &["check", paddle, "--slice", "z=0.2", "-s", "paddle,stirrer", "--plot", "distance"][..],
        &["check", pawn, "--slice", "y=1.5", "--arrows", "--term"],
        &["check", pawn, "--slice", "y=1.5,z=1", "--term"],
        &["check", pawn, "--slice", "y=1.5,z=1", "--window", "0,0,1,1"],
        &["check", paddle, "--slice", "z=0.2", "-s", "paddle,paddel"],
    ] {
        rfm(folder.path(), words).expect(2);
    }
    let term = rfm(folder.path(), &["check", pawn, "--slice", "y=1.5", "--term"]).expect(0);
    assert!(term.stdout.lines().count() > 10 && !term.stdout.contains('\x1b'));
}

#[test]
fn methods_are_explained_by_their_names() {
    let all = rfm(root(), &["explain", "--methods"]).expect(0).stdout;
    for method in ["wcsph", "dfsph", "paper"] {
        let one = rfm(root(), &["explain", method]).expect(0).stdout;
        assert!(one.starts_with(&format!("## `{method}`: ")) && all.contains(one.trim_end()), "{one}");
    }
}

#[test]
fn eval_prints_columns_in_the_order_asked_for() {
    let text = b"rfm 1\nsolid s = sphere(1)\n";
    let asked = ["eval", "-", "--at", "2,0,0", "--what", "distance,value,sign,distance"];
    let table = rfm_reading(root(), &asked, text).expect(0).stdout;
    assert!(table.starts_with("x,y,z,distance,omega,sign\n"), "{table}");
    let row: Vec<f64> = table.lines().nth(1).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    assert!((row[3] - 1.0).abs() < 1e-9 && row[5] == -1.0, "{table}");
}

#[test]
fn eval_reads_points_and_prints_seventeen_digits() {
    // a table may have rows without a place, and a flag is refused
    let points = b"x,y,z\n1.5,1.5,0.5\n-1e-3,0,nan\ninf,0,0\n";
    let outcome = rfm_reading(root(), &["eval", PAWN, "--points", "-"], points).expect(0);
    rfm(root(), &["eval", PAWN, "--at=-1e-3,0,nan"]).expect(2);
    rfm(root(), &["eval", PAWN, "--at", "inf,0,0"]).expect(2);
    snapshot("cli", "eval", &outcome.transcript());
    let all = ["eval", PAWN, "--at", "1.7,1.5,0.2", "--what", "value,gradient,sign,normal"];
    snapshot("cli", "eval everything", &rfm(root(), &all).expect(0).transcript());

    let folder = tempfile::tempdir().unwrap();
    let csv = "name,z,y,x\r\n# a remark\n a , 0.5,1.5,1.5\n\nb,0.2,1.5,1.7\n";
    std::fs::write(folder.path().join("p.csv"), csv).unwrap();
    let path = folder.path().join("p.csv");
    let from_file = rfm(root(), &["eval", PAWN, "--points", path.to_str().unwrap()]).expect(0);
    let from_stdin = rfm_reading(root(), &["eval", PAWN, "--points", "-"], csv.as_bytes()).expect(0);
    let from_flags = rfm(root(), &["eval", PAWN, "--at", "1.5,1.5,0.5", "--at", "1.7,1.5,0.2"]).expect(0);
    assert_eq!(from_file.stdout, from_flags.stdout);
    assert_eq!(from_stdin.stdout, from_flags.stdout);
    for (points, says) in [
        ("", "is empty"),
        ("a,b,c\n1,2,3\n", "<stdin>:1: expected the header"),
        ("x,y,z\n1,2\n", ":2: the row has 2 cells"),
        ("x,y,z\n1,2,three\n", ":2: `three` is not a number"),
    ] {
        let outcome = rfm_reading(root(), &["eval", PAWN, "--points", "-"], points.as_bytes()).expect(2);
        assert!(outcome.stderr.contains(says), "{}", outcome.stderr);
    }
    rfm(root(), &["eval", PAWN, "--points", "none.csv"]).expect(2);
}

#[test]
fn engines_and_precisions_print_the_same() {
    let points: String = (0..500)
        .map(|i| {
            format!("{},{},{}\n", 0.007 * f64::from(i), 3.0 - 0.006 * f64::from(i), 0.003 * f64::from(i))
        })
        .collect();
    let points = format!("x,y,z\n{points}");
    for precision in ["f64", "f32"] {
        let run = |engine| {
            let arguments = ["eval", PAWN, "--points", "-", "--precision", precision, "--engine", engine];
            rfm_reading(root(), &arguments, points.as_bytes()).expect(0).stdout
        };
        let jit = run("jit");
        assert_eq!(jit.lines().count(), 501);
        assert_eq!(jit, run("interp"), "{precision}");
        assert_eq!(jit, run("auto"), "{precision}");
    }
    let asked = ["eval", PAWN, "--json", "--points", "-"];
    let outcome = rfm_reading(root(), &asked, b"x,y,z\n0,0,nan\n").expect(0);
    contract(&outcome.stdout, &outcome.json(), &["schema", "points"]);
}

#[test]
fn commands_of_other_programs_lead_to_those_that_do_the_same() {
    let told = |command: &str| rfm(root(), &[command, PAWN]).expect(2).stderr;
    for (command, does) in [("slice", "check FILE --slice z=0.5"), ("simulate", "run FILE"), ("new", "init")]
    {
        let text = told(command);
        assert!(text.contains(&format!("`rfm {does}` does that")), "{text}");
        // what the message suggests is a command
        let name = does.split(' ').next().unwrap();
        rfm(root(), &[name, "--help"]).expect(0);
    }
    assert!(!told("xyzzy").contains("does that"));
}

const RUN_KEYS: [&str; 14] = [
    "schema",
    "steps",
    "simulated_seconds",
    "particles",
    "milliseconds_per_step",
    "neighbours_per_particle",
    "max_penetration",
    "inside",
    "lost",
    "non_finite",
    "max_density_error",
    "kinetic_energy",
    "potential_energy",
    "passes",
];

#[test]
fn runs_are_the_same_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("drop.rfm"), SMALL).unwrap();
    let mut summaries = Vec::new();
    for threads in ["1", "2"] {
        let out = format!("out{threads}");
        let outcome =
            rfm(folder.path(), &["run", "drop.rfm", "--threads", threads, "--json", "-o", &out]).expect(0);
        let mut summary = outcome.json();
        contract(&outcome.stdout, &summary, &RUN_KEYS);
        for key in ["milliseconds_per_step", "threads"] {
            summary.as_object_mut().unwrap().remove(key);
        }
        summaries.push(summary);
    }
    assert_eq!(summaries[0], summaries[1]);
    assert_eq!(summaries[0]["steps"], 10);
    for part in ["frames", "pictures"] {
        let names = files(&folder.path().join("out1").join(part));
        assert_eq!(names.len(), 3);
        for name in names {
            let bytes = |out: &str| std::fs::read(folder.path().join(out).join(part).join(&name)).unwrap();
            assert!(bytes("out1") == bytes("out2"), "{part}/{name}");
        }
    }
    let expected = [
        "checkpoints",
        "frames",
        "history",
        "obstacle.stl",
        "obstacle.vtp",
        "open_in_paraview.py",
        "particles.pvd",
        "pictures",
        "summary.json",
    ];
    assert_eq!(files(&folder.path().join("out1")), expected);
    // the script for ParaView knows the scene, and no place in it is left open
    let script = std::fs::read_to_string(folder.path().join("out1/open_in_paraview.py")).unwrap();
    for line in ["RADIUS = 0.", "FASTEST = ", "LOW, HIGH = [", "FOLDER = \"/"] {
        let found = script.lines().find(|written| written.starts_with(line));
        assert!(found.is_some_and(|written| !written.contains('{')), "{line}: {found:?}");
    }
}

#[test]
fn run_defaults_and_flags() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("drop.rfm"), SMALL).unwrap();
    let dry = rfm(folder.path(), &["run", "drop.rfm", "--dry-run"]).expect(0);
    assert!(
        dry.stdout.contains("particles     30") && dry.stdout.contains("steps         10"),
        "{}",
        dry.stdout
    );
    assert!(
        dry.stdout.contains("sound speed   ") && dry.stdout.contains("(the root of the stiffness)"),
        "{}",
        dry.stdout
    );
    assert_eq!(files(folder.path()), ["drop.rfm"]);
    rfm(folder.path(), &["run", "drop.rfm", "--steps", "2", "--no-pictures"]).expect(0);
    assert_eq!(files(folder.path()), ["drop.out", "drop.rfm"]);
    rfm(folder.path(), &["run", "drop.rfm", "--steps", "2", "--until", "1"]).expect(2);
    let none = rfm(folder.path(), &["run", "drop.rfm", "--steps", "0", "--no-frames", "--json", "-o", "z"])
        .expect(0);
    assert_eq!(none.json()["steps"], 0);
    assert!(none.json()["sound_speed"].as_f64() > Some(0.0) && none.json()["sound_speed_stated"] == false);
    assert_eq!(files(&folder.path().join("z")), ["history", "summary.json"]);
    // the start alone: a header and a line for each table
    for table in ["energy", "audit"] {
        let text = std::fs::read_to_string(folder.path().join(format!("z/history/{table}.csv"))).unwrap();
        assert_eq!(text.lines().count(), 2, "{table}: {text}");
    }
}

#[test]
fn one_document_or_none() {
    let run = |arguments: &[&str]| rfm_reading(root(), arguments, SMALL.as_bytes());
    let dry = run(&["run", "-", "--dry-run", "--json"]).expect(0);
    contract(&dry.stdout, &dry.json(), &["schema", "particles", "steps", "time_step", "passes", "seconds"]);
    run(&["check", "-", "--json", "--slice", "z=0.1", "--term"]).expect(2);
    run(&["explain", "E0201", "--json"]).expect(2);
    run(&["check", "-", "-s", "pots"]).expect(2);
    run(&["check", "-", "--threads", "1025"]).expect(2);
    let mixed =
        rfm_reading(root(), &["check", "-"], b"rfm 1\nsolid s = box([0, 0, 0], [10 mm, 20 mm, 5])").expect(0);
    assert!(mixed.stdout.contains("along z it is 500 times as long as along x"), "{}", mixed.stdout);
    // a thread that neither cells nor lines meet
    let thin = b"rfm 1\nsolid s = box([0, 0, 0], [10, 1e-7, 1e-7]).rotate_z(0.5).rotate_x(0.4)";
    let thin = rfm_reading(root(), &["check", "-", "--json"], thin).expect(0).json();
    assert_eq!((&thin["solids"][0]["empty"], &thin["solids"][0]["volume"]), (&false.into(), &().into()));
}

#[test]
fn a_closed_pipe_is_no_error() {
    use std::process::{Command, Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_rfm"))
        .args(["explain", PAWN, "--show", "ast,ir,clif,asm"])
        .current_dir(root())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked") && output.status.code() != Some(101), "{text}");
}

#[test]
fn explain_shows_every_stage() {
    let outcome = rfm(root(), &["explain", "examples/cube.rfm:cube", "--show", "ast,ir,clif,asm"]).expect(0);
    for part in ["solid cube", "compare", "r0_and", "function", "block0", "ret"] {
        assert!(outcome.stdout.contains(part), "no `{part}`");
    }
}
