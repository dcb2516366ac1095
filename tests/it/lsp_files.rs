//! `rfm lsp` with several files, and how it is begun, kept busy and ended.

use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::lsp::{Editor, edited};

const LIBRARY: &str = "rfm 1
param w = 0.5
# a post on the ground
fn post(r, h = w) = cylinder(r, h)
solid p = post(w)
";
const MAIN: &str = "rfm 1
import \"imp/lib.rfm\" as lib
solid q = lib.post(0.2, h = lib.w) or lib.p
";
const OTHER: &str = "rfm 1
import \"lib.rfm\" as parts
solid a = parts.post(1)
fn post(r) = sphere(r)
solid b = post(1)
";

/// Files in a folder, and an editor that has opened some of them.
struct Desk {
    editor: Editor,
    folder: tempfile::TempDir,
}

impl Desk {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("imp")).unwrap();
        for (name, text) in [("main.rfm", MAIN), ("imp/lib.rfm", LIBRARY), ("imp/other.rfm", OTHER)] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let mut desk = Self { editor: Editor::new(&[]), folder };
        desk.open("main.rfm", MAIN);
        desk
    }

    fn uri(&self, name: &str) -> String {
        format!("file://{}/{name}", self.folder.path().display())
    }

    fn open(&mut self, name: &str, text: &str) {
        let file = json!({ "uri": self.uri(name), "languageId": "rfm", "version": 1, "text": text });
        self.editor.tell("textDocument/didOpen", json!({ "textDocument": file }));
    }

    fn change(&mut self, name: &str, version: i64, text: &str) {
        let file = json!({ "uri": self.uri(name), "version": version });
        let change = json!({ "textDocument": file, "contentChanges": [{ "text": text }] });
        self.editor.tell("textDocument/didChange", change);
    }

    /// The messages about a file after all that the server was told, if they were sent since the last such question.
    ///
    /// Texts that are opened and changed at once may be read together or one after the other, so the number of
    /// publications says nothing. A question is answered only after everything before it was read and published.
    fn messages(&mut self, name: &str) -> Vec<Value> {
        self.at("hover", name, (0, 0), json!({}));
        let uri = self.uri(name);
        self.editor.of_files.remove(&uri).unwrap_or_else(|| panic!("no messages about {name}"))
    }

    fn at(&mut self, method: &str, name: &str, (line, character): (u32, u32), more: Value) -> Value {
        let position = json!({ "line": line, "character": character });
        let mut asked = json!({ "textDocument": { "uri": self.uri(name) }, "position": position });
        for (key, value) in more.as_object().unwrap() {
            asked[key] = value.clone();
        }
        self.editor.ask(&format!("textDocument/{method}"), asked)
    }

    /// Where something is, as `name:line:character`.
    fn place(&self, location: &Value) -> String {
        let start = &location["range"]["start"];
        let uri = location["uri"].as_str().unwrap();
        let name = uri.strip_prefix(&self.uri("")).unwrap_or(uri);
        format!("{name}:{}:{}", start["line"], start["character"])
    }
}

/// The byte of a word in a line, as a position.
fn of(text: &str, line: u32, word: &str) -> (u32, u32) {
    (line, text.lines().nth(line as usize).unwrap().find(word).unwrap() as u32)
}

#[test]
fn names_of_imported_files_are_explained_and_found() {
    let mut desk = Desk::new();
    let at_post = of(MAIN, 2, "post");
    let found = desk.at("definition", "main.rfm", at_post, json!({}));
    assert_eq!(desk.place(&found), "imp/lib.rfm:3:3");
    let found = desk.at("definition", "main.rfm", of(MAIN, 2, "w)"), json!({}));
    assert_eq!(desk.place(&found), "imp/lib.rfm:1:6");
    let found = desk.at("definition", "main.rfm", of(MAIN, 1, "lib.rfm"), json!({}));
    assert_eq!(desk.place(&found), "imp/lib.rfm:0:0", "the path of an import");

    let words = desk.at("hover", "main.rfm", at_post, json!({}))["contents"].to_string();
    for part in ["fn post(r, h = w) = cylinder(r, h)", "a post on the ground", "in `imp/lib.rfm`"] {
        assert!(words.contains(part), "{words}");
    }

    // uses in files that are open, and in one that is not; another `post` is none
    let declared = json!({ "context": { "includeDeclaration": true } });
    let uses = desk.at("references", "main.rfm", at_post, declared.clone());
    let places: Vec<String> = uses.as_array().unwrap().iter().map(|found| desk.place(found)).collect();
    let all = ["imp/lib.rfm:3:3", "imp/lib.rfm:4:10", "main.rfm:2:14", "imp/other.rfm:2:16"];
    assert_eq!(places, all);
    desk.open("imp/lib.rfm", LIBRARY);
    let uses =
        desk.at("references", "imp/lib.rfm", (3, 4), json!({ "context": { "includeDeclaration": false } }));
    let mut places: Vec<String> = uses.as_array().unwrap().iter().map(|found| desk.place(found)).collect();
    places.sort();
    assert_eq!(places, ["imp/lib.rfm:4:10", "imp/other.rfm:2:16", "main.rfm:2:14"]);
    // a parameter is named in calls
    let found = desk.at("definition", "main.rfm", of(MAIN, 2, "h ="), json!({}));
    assert_eq!(desk.place(&found), "imp/lib.rfm:3:11");
    let uses = desk.at("references", "imp/lib.rfm", (3, 11), declared.clone());
    let places: Vec<String> = uses.as_array().unwrap().iter().map(|found| desk.place(found)).collect();
    assert_eq!(places, ["imp/lib.rfm:3:11", "imp/lib.rfm:3:32", "main.rfm:2:24"]);
    let uses = desk.at("references", "imp/lib.rfm", (3, 8), declared);
    assert_eq!(uses.as_array().unwrap().len(), 2, "one that no call names");
    desk.editor.end();
}

#[test]
fn names_are_changed_in_all_files() {
    let mut desk = Desk::new();
    let at_post = of(MAIN, 2, "post");
    let range = desk.at("prepareRename", "main.rfm", at_post, json!({}));
    assert_eq!(range["start"]["character"], 14);
    let edits = desk.at("rename", "main.rfm", at_post, json!({ "newName": "pole" }));
    let changed = |name: &str, text: &str| edited(text, &edits["changes"][desk.uri(name)]);
    assert_eq!(changed("main.rfm", MAIN), MAIN.replace("post", "pole"));
    assert_eq!(changed("imp/lib.rfm", LIBRARY), LIBRARY.replace("post(", "pole("));
    assert_eq!(changed("imp/other.rfm", OTHER), OTHER.replace("parts.post", "parts.pole"));
    // names that are taken in the file that defines it, or that would hide something
    for (name, why) in
        [("p", "used in the file already"), ("sphere", "would be hidden"), ("sin", "would be hidden")]
    {
        let refused = desk.at("rename", "main.rfm", at_post, json!({ "newName": name }));
        assert_eq!(refused["code"], -32602, "{name}");
        assert!(refused["message"].as_str().unwrap().contains(why), "{refused}");
    }
    desk.editor.end();
}

#[test]
fn open_texts_count_and_not_those_of_the_disk() {
    let mut desk = Desk::new();
    assert!(desk.messages("main.rfm").is_empty());
    // the editor changes the library, and does not save it
    desk.open("imp/lib.rfm", LIBRARY);
    desk.change("imp/lib.rfm", 2, &LIBRARY.replace("solid p", "solid pole"));
    let messages = desk.messages("main.rfm");
    let told = messages[0]["message"].as_str().unwrap();
    assert!(told.contains("`lib` has no `p`"), "{messages:?}");
    let place = desk.at("definition", "main.rfm", of(MAIN, 2, "lib.p"), json!({}));
    assert!(!place.is_null());
    desk.change("main.rfm", 2, &MAIN.replace("lib.p\n", "lib.pole\n"));
    assert!(desk.messages("main.rfm").is_empty());
    // without the editor's text the disk counts again
    let uri = desk.uri("imp/lib.rfm");
    desk.editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": uri } }));
    assert!(desk.messages("main.rfm")[0]["message"].as_str().unwrap().contains("`lib` has no `pole`"));
    // a file that is nowhere but in the editor
    desk.open("imp/new.rfm", "rfm 1\nsolid n = sphere(1)\n");
    desk.open("main.rfm", "rfm 1\nimport \"imp/new.rfm\" as fresh\nsolid q = fresh.n\n");
    assert!(desk.messages("main.rfm").is_empty());
    desk.editor.end();
}

/// If many changes come together, only the last one is read.
#[test]
fn changes_that_come_together_are_read_once() {
    let mut text = String::from("rfm 1\n");
    (0..600).for_each(|i| {
        text += &format!("let d{i} = x^2 + (y - {i})^2\nsolid s{i} = d{i} <= 1 and 0 <= z <= 1\n")
    });
    let mut desk = Desk::new();
    desk.messages("main.rfm");
    let started = Instant::now();
    desk.open("main.rfm", &text);
    desk.messages("main.rfm");
    let once = started.elapsed();
    let (count, started) = (60, Instant::now());
    for version in 2..2 + count {
        desk.change("main.rfm", version, &format!("{text}# {version}\n"));
    }
    let words = desk.at("hover", "main.rfm", (2, 8), json!({}))["contents"].to_string();
    assert!(words.contains("solid s0"), "{words}");
    let spent = started.elapsed();
    println!("one text: {once:?}; {count} that come together: {spent:?}");
    // each of them alone would take as long as the first; texts are also sent, and read from the pipe
    assert!(spent < once * 10 + Duration::from_millis(500), "{spent:?}, {once:?}");
    desk.editor.end();
}

#[test]
fn keys_and_methods_of_scenes_are_explained() {
    let text = "rfm 1
scene s {
  box { max: [1, 1, 1] }
  fluid water { shape: sphere(1), sound_speed: 10, density: 1000 }
  gravity: [0, 0, -9.81]
  method: wcsph
  run { until: 1 s }
}
";
    let mut editor = Editor::with(text);
    for ((line, word), parts) in [
        ((6, "until"), &["key `until`", "in s; by default 5"][..]),
        ((4, "gravity"), &["in m/s²; by default [0, 0, -9.81]"]),
        ((3, "density"), &["in kg/m³; by default 998.29"]),
        ((3, "sound_speed"), &["in m/s", "by default ten times the greatest expected speed"]),
        ((2, "box"), &["the room of the simulation"]),
        ((5, "wcsph"), &["## `wcsph`", "| `sound_speed` | m/s |"]),
    ] {
        let (line, character) = of(text, line, word);
        let words = editor.hover(line, character + 1);
        for part in parts {
            assert!(words.contains(part), "{word}: {words}");
        }
    }
    editor.end();
}

#[test]
fn a_command_says_what_it_takes() {
    let mut editor = Editor::with("rfm 1\nsolid s = sphere(1)\n");
    for arguments in [json!([]), json!([{}]), json!([1, 2])] {
        let asked = json!({ "command": "rfm.slice", "arguments": arguments });
        let refused = editor.ask("workspace/executeCommand", asked);
        assert_eq!(refused["code"], -32602, "{refused}");
        assert!(refused["message"].as_str().unwrap().contains("rfm.slice takes one object"), "{refused}");
    }
    let refused = editor.ask("workspace/executeCommand", json!({ "command": "rfm.saw" }));
    assert!(refused["message"].as_str().unwrap().contains("no such command"), "{refused}");
    editor.end();
}

#[test]
fn a_server_is_begun_and_ended_in_order() {
    let hello = r#"{"jsonrpc":"2.0","id":1,"method":"initialize","params":{"capabilities":{}}}"#;
    let early = r#"{"jsonrpc":"2.0","id":9,"method":"textDocument/hover","params":{}}"#;
    let hover = r#"{"jsonrpc":"2.0","id":2,"method":"textDocument/hover","params":{}}"#;
    let shutdown = r#"{"jsonrpc":"2.0","id":3,"method":"shutdown"}"#;
    let exit = r#"{"jsonrpc":"2.0","method":"exit"}"#;
    let senseless = r#"{"jsonrpc":"2.0","id":4,"method":"initialize","params":[]}"#;
    let check = |messages: &[&str], code: i32, parts: &[&str]| {
        let mut input = String::new();
        messages.iter().for_each(|text| input += &format!("Content-Length: {}\r\n\r\n{text}", text.len()));
        let ended = crate::tool::rfm_reading(Path::new("."), &["lsp"], input.as_bytes()).expect(code);
        assert_eq!(ended.stderr, "");
        for part in parts {
            assert!(ended.stdout.contains(part), "{part}: {}", ended.stdout);
        }
    };
    check(&[hello, shutdown, exit], 0, &[r#""id":3,"result":null"#]);
    check(&[hello, exit], 1, &[]);
    check(&[exit], 1, &[]);
    // after a shutdown requests are refused, and the server waits for the end
    check(&[hello, shutdown, hover, exit], 0, &[r#""id":2"#, "-32600"]);
    check(
        &[early, senseless, hello, shutdown, exit],
        0,
        &["-32002", r#""id":4"#, "-32602", r#""id":3,"result":null"#],
    );
}
