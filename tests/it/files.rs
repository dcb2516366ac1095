//! Files that name others: what they take from them, what is refused, and where messages point.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use rfm::diagnostic::{Code, Diagnostics, Source, SourceId};
use rfm::files::{Files, Reader, Unread};
use rfm::glam::DVec3;
use rfm::lower::Options;
use rfm::{Error, Program};

use crate::tool::{rfm, rfm_reading};

/// Files that are kept in memory.
struct Shelf(HashMap<&'static str, String>);

impl Reader for Shelf {
    fn read(&self, name: &str) -> Result<Vec<u8>, Unread> {
        match self.0.get(name) {
            Some(text) => Ok(text.clone().into_bytes()),
            None => Err(Unread::Failed("there is none".into())),
        }
    }
}

const CHESS: &str = "rfm 1
import \"base.rfm\" as base
param height = 1 in 0.5 .. 2 \"of a piece\"
let wide = 2*base.foot
fn post(r, h = height) = base.round(r) and 0 <= z <= h
solid pawn = post(0.25) or ball([0, 0, height], 0.3)
solid _spare = sphere(1)
scene unread { }
";

const BASE: &str = "rfm 1
param foot = 0.5
fn round(r) = x^2 + y^2 <= r^2
";

fn check(
    text: &str,
    files: &[(&'static str, &str)],
    overrides: &[(&str, f64)],
) -> Result<Program, Diagnostics> {
    let shelf = Shelf(files.iter().map(|&(name, text)| (name, text.to_string())).collect());
    let overrides = overrides.iter().map(|&(name, value)| (name.to_string(), value)).collect();
    let options = Options { files: Files::new(Arc::new(shelf)), overrides, ..Options::default() };
    Program::check(Source::file("main.rfm", text), options)
}

fn fits(text: &str, files: &[(&'static str, &str)]) -> Program {
    check(text, files, &[]).unwrap_or_else(|messages| panic!("{messages}"))
}

/// The only message.
fn refused(text: &str, files: &[(&'static str, &str)]) -> (Code, SourceId, String) {
    let messages = check(text, files, &[]).unwrap_err();
    let [message] = &messages.list[..] else { panic!("{messages}") };
    (message.code, message.primary.span.source, messages.to_string())
}

const FILES: [(&str, &str); 2] = [("chess.rfm", CHESS), ("base.rfm", BASE)];

#[test]
fn a_file_takes_solids_functions_params_and_names_from_another() {
    let text = "rfm 1
import \"chess.rfm\" as chess
let height = 5
solid pawn = chess.pawn.move([1, 0, 0])
solid post = chess.post(chess.wide) and z <= chess.height/2
";
    let program = fits(text, &FILES);
    let names: Vec<&str> = program.module().solids.iter().map(|solid| &solid.name[..]).collect();
    assert_eq!(names, ["pawn", "post"]);
    let params: Vec<&str> = program.module().params.iter().map(|param| &param.name[..]).collect();
    assert_eq!(params, ["chess.base.foot", "chess.height"]);
    let same = "rfm 1
solid pawn = (x^2 + y^2 <= 0.25^2 and 0 <= z <= 1 or ball([0, 0, 1], 0.3)).move([1, 0, 0])
solid post = (x^2 + y^2 <= 1^2 and 0 <= z <= 1) and z <= 1/2
";
    let same = Program::from_source("same.rfm", same).unwrap();
    for solid in ["pawn", "post"] {
        let [a, b] = [&program, &same].map(|program| program.solid(solid).unwrap());
        for i in 0..500 {
            let p = DVec3::new(
                f64::from(i % 10) * 0.2,
                f64::from(i / 10 % 10) * 0.11 - 0.4,
                f64::from(i / 100) * 0.3,
            );
            assert_eq!(a.omega(p), b.omega(p), "{solid} at {p}");
        }
    }
    let taller = check(text, &FILES, &[("chess.height", 2.0), ("chess.base.foot", 0.1)]).unwrap();
    let (pawn, post) = (taller.solid("pawn").unwrap(), taller.solid("post").unwrap());
    assert!(pawn.omega(DVec3::new(1.0, 0.0, 2.2)) > 0.0 && pawn.omega(DVec3::new(1.0, 0.0, 2.4)) < 0.0);
    assert_eq!(post.omega(DVec3::new(0.2, 0.0, 0.5)), 0.0);
    let again = program.with("chess.height", 2.0).unwrap().solid("pawn").unwrap();
    assert_eq!(again.omega(DVec3::splat(0.5)), pawn.omega(DVec3::splat(0.5)));
}

#[test]
fn a_file_that_two_others_import_is_one_file() {
    let left = "rfm 1\nimport \"base.rfm\" as b\nlet r = b.foot";
    let right = "rfm 1\nimport \"./x/../base.rfm\" as b\nlet r = b.foot";
    let text = "rfm 1\nimport \"l.rfm\" as l\nimport \"r.rfm\" as r\nsolid s = sphere(l.r) or sphere(r.r)";
    let files = [("l.rfm", left), ("r.rfm", right), ("base.rfm", BASE)];
    let program = check(text, &files, &[("l.b.foot", 2.0)]).unwrap_or_else(|messages| panic!("{messages}"));
    assert_eq!(program.module().params.len(), 1);
    assert!(program.solid("s").unwrap().omega(DVec3::X * 1.9) > 0.0);
}

#[test]
fn what_cannot_be_imported_is_said_where_it_stands() {
    let text = |body: &str| format!("rfm 1\nimport \"chess.rfm\" as chess\nsolid s = {body}");
    let (code, source, shown) = refused(&text("chess.pwan"), &FILES);
    assert_eq!((code, source), (Code::UNKNOWN_NAME, SourceId::File));
    assert!(shown.contains("`chess` has no `pwan`") && shown.contains("did you mean `pawn`?"), "{shown}");
    for (body, words) in [
        ("chess.post", "`chess.post` is a function"),
        ("chess.pawn(1)", "`chess.pawn` is not a function"),
        ("chess.base", "does not hand on its import"),
        ("chess.unread", "`chess` has no `unread`"),
        ("chess", "`chess` is a file"),
        ("chess.post(1, 2, 3)", "takes at most 2 arguments"),
        ("sphere(1).twisted", "a method is called with brackets"),
    ] {
        let (_, source, shown) = refused(&text(body), &FILES);
        assert!(shown.contains(words) && source == SourceId::File, "{body}: {shown}");
    }
    let (code, source, shown) = refused(&text("sphere(1)"), &[]);
    assert_eq!((code, source), (Code::FILE, SourceId::File));
    assert!(shown.contains("`chess.rfm` cannot be read: there is none"), "{shown}");
    let mesh = "rfm 1\nimport \"part.STL\" as part\nsolid s = sphere(1)";
    assert!(refused(mesh, &[]).2.contains("mesh(\"part.STL\")"));
}

#[test]
fn a_mistake_in_an_imported_file_is_shown_there_and_at_the_import() {
    let text = "rfm 1\nimport \"a.rfm\" as a\nsolid s = a.ball";
    for (other, words) in [
        ("rfm 1\nsolid ball = spere(1)\n", "did you mean `sphere`?"),
        ("rfm 1\nsolid ball = sphere(\n", "`(` is not closed"),
        ("rfm 1\nsolid ball = sphere(-1)\n", "must be positive"),
    ] {
        let messages = check(text, &[("a.rfm", other)], &[]).unwrap_err();
        let first = &messages.list[0];
        assert_eq!(first.primary.span.source, SourceId::Import(0), "{messages}");
        let shown = messages.to_string();
        assert!(shown.contains("a.rfm:2:") && shown.contains("main.rfm:2:8"), "{shown}");
        assert!(shown.contains(words) && shown.contains("imported here"), "{shown}");
        // the solid that failed is not reported again
        assert_eq!(messages.list.len(), 1, "{messages}");
    }
}

#[test]
fn files_cannot_import_one_another_in_a_circle() {
    let text = "rfm 1\nimport \"a.rfm\" as a\nsolid s = a.ball";
    let a = "rfm 1\nimport \"main.rfm\" as m\nsolid ball = sphere(1)";
    let (code, source, shown) = refused(text, &[("a.rfm", a)]);
    assert_eq!((code, source), (Code::IMPORT, SourceId::Import(0)));
    assert!(shown.contains("main.rfm → a.rfm → main.rfm"), "{shown}");
    let own = "rfm 1\nimport \"main.rfm\" as m\nsolid ball = sphere(1)";
    assert_eq!(refused(own, &[]).0, Code::IMPORT);
}

#[test]
fn a_text_alone_names_no_files() {
    for text in ["rfm 1\nimport \"a.rfm\" as a\nsolid s = sphere(1)", "rfm 1\nsolid s = mesh(\"a.stl\")"] {
        let Err(Error::Diagnostics(messages)) = Program::from_source("t.rfm", text) else {
            panic!("accepted")
        };
        assert_eq!(messages.list[0].code, Code::FILE);
        assert!(messages.to_string().contains("other files cannot be read here"), "{messages}");
    }
}

fn write(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

#[test]
fn the_commands_read_files_of_the_folder_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write(root, "work/pieces/chess.rfm", CHESS);
    write(root, "work/pieces/base.rfm", BASE);
    write(root, "outside.rfm", "rfm 1\nsolid ball = sphere(1)");
    write(root, "work/main.rfm", "rfm 1\nimport \"pieces/chess.rfm\" as chess\nsolid pawn = chess.pawn\n");
    write(root, "work/out.rfm", "rfm 1\nimport \"../outside.rfm\" as o\nsolid s = o.ball\n");
    let value = |arguments: &[&str]| rfm(root, arguments).expect(0).stdout;
    let at = |define: &str| value(&["eval", "work/main.rfm", "--at", "0,0,1.5", "-D", define]);
    assert_ne!(at("chess.height=1"), at("chess.height=2"));
    for command in [
        &["check", "work/main.rfm"][..],
        &["mesh", "work/main.rfm", "--cells", "16", "-o", "pawn.stl"],
        &["build", "work/main.rfm", "-o", "pawn.c"],
        &["explain", "work/main.rfm", "--show", "ast"],
    ] {
        rfm(root, command).expect(0);
    }
    let text = std::fs::read(root.join("work/main.rfm")).unwrap();
    rfm_reading(&root.join("work"), &["check", "-"], &text).expect(0);
    let refused = rfm(root, &["check", "work/out.rfm"]).expect(1).stderr;
    assert!(refused.contains("E0216") && refused.contains("outside of the folder"), "{refused}");
    assert!(refused.contains("--allow-outside"), "{refused}");
    rfm(root, &["check", "work/out.rfm", "--allow-outside"]).expect(0);
    let unknown = rfm(root, &["check", "work/main.rfm", "-D", "chess.heigth=1"]).expect(2).stderr;
    assert!(unknown.contains("did you mean `chess.height`?"), "{unknown}");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(root.join("outside.rfm"), root.join("work/link.rfm")).unwrap();
        write(root, "work/linked.rfm", "rfm 1\nimport \"link.rfm\" as o\nsolid s = o.ball\n");
        assert!(rfm(root, &["check", "work/linked.rfm"]).expect(1).stderr.contains("outside of the folder"));
    }
    assert!(Program::from_path(root.join("work/main.rfm")).is_ok());
}

/// No output takes the place of a file that the command has read, however its path is spelt.
#[test]
fn outputs_do_not_replace_inputs() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::copy(crate::tool::root().join("examples/parts/bracket.stl"), at("b.stl")).unwrap();
    std::fs::write(at("lib.rfm"), "rfm 1\nsolid a = sphere(1)\n").unwrap();
    std::fs::write(at("main.c"), "rfm 1\nimport \"lib.rfm\" as lib\nsolid b = lib.a\n").unwrap();
    std::fs::write(at("b.rfm"), "rfm 1\nsolid b = mesh(\"b.stl\", 1 mm)\n").unwrap();
    std::fs::create_dir(at("sub")).unwrap();
    let original: Vec<Vec<u8>> = ["b.stl", "main.c"].map(|name| std::fs::read(at(name)).unwrap()).into();
    #[cfg(unix)]
    std::os::unix::fs::symlink(at("b.stl"), at("link.stl")).unwrap();
    for arguments in [
        &["mesh", "b.rfm", "--cells", "10", "-o", "b.stl"][..],
        &["mesh", "b.rfm", "--cells", "10", "-o", "sub/../b.stl"],
        #[cfg(unix)]
        &["mesh", "b.rfm", "--cells", "10", "-o", "link.stl"],
        &["build", "main.c", "-o", "main.c"],
        &["build", "main.c", "-o", "./main.c"],
    ] {
        let outcome = rfm(folder.path(), arguments).expect(2);
        assert!(outcome.stderr.contains("is one of the files that this command reads"), "{}", outcome.stderr);
    }
    let now: Vec<Vec<u8>> = ["b.stl", "main.c"].map(|name| std::fs::read(at(name)).unwrap()).into();
    assert!(original == now, "a file has changed");
    // a second output of one name is no input
    for _ in 0..2 {
        rfm(folder.path(), &["mesh", "b.rfm", "--cells", "10", "-o", "new.stl"]).expect(0);
    }
}
