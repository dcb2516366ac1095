//! Params from files: `-P`.

use crate::tool::rfm;

const FILE: &str = "rfm 1\nparam r = 0.5 in 0.01 .. 2\nparam h = 1 m\nparam d = 20 mm\nsolid post = cylinder(r, h)\nsolid ball = sphere(d)\n";

#[test]
fn params_come_from_files_and_flags_go_before_them() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a.rfm", FILE);
    write("a.toml", "# sizes\nr = 0.25\nh = \"80 mm\"\n");
    write("b.json", "{ \"r\": 1 }");
    let bounds = |arguments: &[&str]| {
        let all: Vec<&str> = ["check", "a.rfm", "--json"].iter().chain(arguments).copied().collect();
        let max = rfm(folder.path(), &all).expect(0).json()["solids"][0]["bounds"]["max"].clone();
        [0, 2].map(|i| (1e3 * max[i].as_f64().unwrap()).round() / 1e3)
    };
    assert_eq!(bounds(&[]), [0.5, 1.0]);
    assert_eq!(bounds(&["-P", "a.toml"]), [0.25, 0.08]);
    assert_eq!(bounds(&["-P", "a.toml", "-P", "b.json"]), [1.0, 0.08]);
    assert_eq!(bounds(&["-D", "h=2m", "-P", "a.toml"]), [0.25, 2.0]);

    for (text, expected) in [
        ("\nq = 1", "bad.toml:2: `q` is set, but the file declares no such param"),
        ("\ndensity = 1", "and set `p` here"),
        ("# 3\nr = 3", "bad.toml:2: `r` is set to 3, outside its range 0.01 .. 2"),
        ("h = 1 # it was, r = 3\nr = 3", "bad.toml:2: `r` is set to 3"),
        ("d = 8", "bad.toml:1: `d` = 8 means 8 m, and the file writes it in mm"),
        ("d = 8", "write d = \"8000 mm\", or d = \"8 mm\" if that is meant"),
        ("h = \"8 kg\"", "bad.toml:1: the unit that `h` is given in does not fit"),
        ("h = \"8 kg\"", "write h = \"1 m\" at bad.toml:1"),
        ("\nr = [1]", "bad.toml:2: `r` is no number"),
        ("r = \"8 kg/\"", "bad.toml:1: `r`: "),
        ("h = 1\nr = = 1", "cannot read the params of `bad.toml`: line 2: "),
    ] {
        write("bad.toml", text);
        let outcome = rfm(folder.path(), &["check", "a.rfm", "-P", "bad.toml"]);
        assert!(outcome.stderr.contains(expected), "{text}: {}", outcome.stderr);
        assert!(!outcome.stderr.contains("-D "), "{text}: {}", outcome.stderr);
    }
    rfm(folder.path(), &["check", "a.rfm", "-P", "missing.toml"]).expect(2);
    // what a flag sets in place of a file is the flag's
    write("bad.toml", "r = 3");
    let outcome = rfm(folder.path(), &["check", "a.rfm", "-P", "bad.toml", "-D", "r=4"]).expect(2);
    assert!(outcome.stderr.contains("error[E0211]: `r` is set to 4"), "{}", outcome.stderr);
    write("bad.toml", "d = \"8 mm\"");
    let outcome = rfm(folder.path(), &["check", "a.rfm", "-P", "bad.toml", "-D", "d=8"]).expect(0);
    assert!(outcome.stderr.contains("`d` = 8 means 8 m"), "{}", outcome.stderr);
}

#[test]
fn a_number_that_may_be_in_either_unit_is_asked_about() {
    let folder = tempfile::tempdir().unwrap();
    for (param, given, is_asked) in [
        ("d = 20 mm in 1 mm .. 100 m", "d=30", true),
        ("d = 20 mm in 1 mm .. 100 mm", "d=0.03", false),
        ("d = 20 mm in 1 .. 100", "d=30", true),
        ("d = 45 deg in 0 deg .. 90 deg", "d=1", true),
        ("d = 45 deg in 0 .. 90", "d=30", true),
        ("d = 45 deg in 0 deg .. 90 deg", "d=0", false),
        ("d = 2 m in 1 .. 3", "d=3", false),
    ] {
        let moved = if param.contains("deg") { "rotate_z(d)" } else { "move([d, 0, 0])" };
        let text = format!("rfm 1\nparam {param}\nsolid s = box().{moved}\n");
        std::fs::write(folder.path().join("a.rfm"), text).unwrap();
        let found =
            rfm(folder.path(), &["check", "a.rfm", "--budget", "100ms", "-D", given]).expect(0).stderr;
        assert_eq!(found.contains("W0214"), is_asked, "{param}, {given}: {found}");
    }
}
