//! Params from files: `-P`.

use crate::tool::rfm;

const FILE: &str = "rfm 1\nparam r = 0.5 in 0.01 .. 2\nparam h = 1 m\nsolid post = cylinder(r, h)\n";

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
        ("q = 1", "no such param"),
        ("r = [1]", "`r` in `bad.toml` is no number"),
        ("r = \"8 kg/\"", "`r` in `bad.toml`"),
        ("r = = 1", "cannot read the params of `bad.toml`"),
    ] {
        write("bad.toml", text);
        let outcome = rfm(folder.path(), &["check", "a.rfm", "-P", "bad.toml"]).expect(2);
        assert!(outcome.stderr.contains(expected), "{text}: {}", outcome.stderr);
    }
    rfm(folder.path(), &["check", "a.rfm", "-P", "missing.toml"]).expect(2);
}
