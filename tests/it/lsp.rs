//! `rfm lsp` over real pipes, by a small client. What an editor shows is tested, not how the messages are written.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use serde_json::{Value, json};

use crate::tool::root;

pub const URI: &str = "file:///files/test.rfm";

/// An editor with one file.
pub struct Editor {
    server: Child,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
    last: i64,
    /// Messages about the file, as they came last.
    pub messages: Vec<Value>,
    /// Messages about each file by its address, as they came last.
    pub of_files: HashMap<String, Vec<Value>>,
}

impl Editor {
    pub fn new(encodings: &[&str]) -> Self {
        Self::able(encodings, json!({}))
    }

    /// An editor that can apply to texts what the server sends.
    pub fn able(encodings: &[&str], text: Value) -> Self {
        let mut server = Command::new(env!("CARGO_BIN_EXE_rfm"))
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (to, from) = (server.stdin.take(), BufReader::new(server.stdout.take().unwrap()));
        let mut editor = Self { server, to, from, last: 0, messages: Vec::new(), of_files: HashMap::new() };
        let capabilities = json!({ "general": { "positionEncodings": encodings }, "textDocument": text });
        let answer = editor
            .ask("initialize", json!({ "capabilities": capabilities, "processId": null, "rootUri": null }));
        assert_eq!(answer["serverInfo"]["name"], "rfm");
        let expected = if encodings.contains(&"utf-8") { "utf-8" } else { "utf-16" };
        assert_eq!(answer["capabilities"]["positionEncoding"], expected);
        assert_eq!(answer["capabilities"]["colorProvider"], true);
        editor.tell("initialized", json!({}));
        editor
    }

    /// An editor that counts in UTF-16, with a file open.
    pub fn with(text: &str) -> Self {
        let mut editor = Self::new(&[]);
        editor.open(text);
        editor
    }

    /// The number of the process that answers.
    pub fn server(&self) -> u32 {
        self.server.id()
    }

    pub fn write(&mut self, message: &Value) {
        let text = message.to_string();
        let to = self.to.as_mut().unwrap();
        write!(to, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        to.flush().unwrap();
    }

    pub fn read(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            self.from.read_line(&mut line).unwrap();
            assert!(!line.is_empty(), "the server ended");
            match line.trim_end().split_once(": ") {
                Some(("Content-Length", number)) => length = number.parse().unwrap(),
                Some(_) => {}
                None => break,
            }
        }
        let mut bytes = vec![0; length];
        self.from.read_exact(&mut bytes).unwrap();
        serde_json::from_slice(&bytes).unwrap()
    }

    pub fn tell(&mut self, method: &str, params: Value) {
        self.write(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// The answer to a request: its result, or an object with the key `code` if it was refused.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        self.last += 1;
        self.write(&json!({ "jsonrpc": "2.0", "id": self.last, "method": method, "params": params }));
        loop {
            let message = self.read();
            if message["method"] == "textDocument/publishDiagnostics" {
                self.keep(&message["params"]);
            } else if message["id"] == self.last {
                let error = &message["error"];
                assert_ne!(error["code"], -32603, "{method}: {error}");
                return if error.is_null() { message["result"].clone() } else { error.clone() };
            }
        }
    }

    pub fn await_messages(&mut self) -> &[Value] {
        loop {
            let message = self.read();
            if message["method"] == "textDocument/publishDiagnostics" {
                self.keep(&message["params"]);
                return &self.messages;
            }
        }
    }

    fn keep(&mut self, published: &Value) {
        self.messages = published["diagnostics"].as_array().unwrap().clone();
        self.of_files.insert(published["uri"].as_str().unwrap().to_string(), self.messages.clone());
    }

    pub fn open(&mut self, text: &str) -> &[Value] {
        self.give(text);
        self.await_messages()
    }

    /// Opens a text, or another one in its place, without waiting for its messages.
    pub fn give(&mut self, text: &str) {
        let file = json!({ "uri": URI, "languageId": "rfm", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": file }));
    }

    fn change(&mut self, text: &str) -> &[Value] {
        let file = json!({ "uri": URI, "version": 2 });
        self.tell(
            "textDocument/didChange",
            json!({ "textDocument": file, "contentChanges": [{ "text": text }] }),
        );
        self.await_messages()
    }

    /// Asks about the place of a file.
    pub fn at(&mut self, method: &str, line: u32, character: u32) -> Value {
        let position = json!({ "line": line, "character": character });
        let mut more = json!({ "textDocument": { "uri": URI }, "position": position });
        match method {
            "references" => more["context"] = json!({ "includeDeclaration": true }),
            "rename" => more["newName"] = json!("other"),
            _ => {}
        }
        self.ask(&format!("textDocument/{method}"), more)
    }

    /// Asks about the whole file.
    pub fn about(&mut self, method: &str) -> Value {
        let options = json!({ "tabSize": 4, "insertSpaces": true });
        let file = json!({ "textDocument": { "uri": URI }, "options": options });
        self.ask(&format!("textDocument/{method}"), file)
    }

    fn labels(&mut self, line: u32, character: u32) -> Vec<String> {
        let items = self.at("completion", line, character);
        items.as_array().unwrap().iter().map(|item| item["label"].as_str().unwrap().to_string()).collect()
    }

    pub fn hover(&mut self, line: u32, character: u32) -> String {
        self.at("hover", line, character)["contents"]["value"].as_str().unwrap_or("").to_string()
    }

    pub fn end(mut self) {
        assert!(self.ask("shutdown", Value::Null).is_null());
        self.end_after_shutdown();
    }

    pub fn end_after_shutdown(mut self) {
        self.tell("exit", Value::Null);
        drop(self.to.take());
        assert!(self.server.wait().unwrap().success());
    }
}

/// The text after edits, which must not overlap. Positions are those of UTF-16.
pub fn edited(text: &str, edits: &Value) -> String {
    let byte = |position: &Value| {
        let line = position["line"].as_u64().unwrap() as usize;
        let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
        let mut units = 0;
        let wanted = position["character"].as_u64().unwrap() as usize;
        let within = text[start..].char_indices().find(|(_, c)| {
            let here = units;
            units += c.len_utf16();
            here >= wanted
        });
        within.map_or(text.len(), |(at, _)| start + at)
    };
    let mut edits: Vec<_> = edits.as_array().unwrap().iter().collect();
    edits.sort_by_key(|edit| std::cmp::Reverse(byte(&edit["range"]["start"])));
    let mut out = text.to_string();
    for edit in edits {
        let range = byte(&edit["range"]["start"])..byte(&edit["range"]["end"]);
        out.replace_range(range, edit["newText"].as_str().unwrap());
    }
    out
}

#[test]
fn messages_come_with_their_place_and_their_fix() {
    let text = "rfm 1\n# α𝄞\nsolid s = spere(1)\n";
    let mut editor = Editor::with(text);
    let message = editor.messages[0].clone();
    assert_eq!((&message["code"], &message["severity"]), (&json!("E0201"), &json!(1)));
    assert_eq!(message["range"]["start"], json!({ "line": 2, "character": 10 }));
    assert!(message["message"].as_str().unwrap().contains("did you mean `sphere`?"), "{message}");

    let range = message["range"].clone();
    let asked = json!({ "textDocument": { "uri": URI }, "range": range, "context": { "diagnostics": [] } });
    let actions = editor.ask("textDocument/codeAction", asked);
    assert_eq!(actions[0]["title"], "Replace `spere` by `sphere`");
    let fixed = edited(text, &actions[0]["edit"]["changes"][URI]);
    assert_eq!(fixed, text.replace("spere", "sphere"));
    assert!(editor.change(&fixed).is_empty());

    // a missing version and a strict comparison have fixes too
    let text = "solid s = x < 1\n";
    editor.change(text);
    let everywhere = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 9, "character": 0 } });
    let asked =
        json!({ "textDocument": { "uri": URI }, "range": everywhere, "context": { "diagnostics": [] } });
    let actions = editor.ask("textDocument/codeAction", asked);
    let mut fixed = text.to_string();
    for action in actions.as_array().unwrap().iter().rev() {
        fixed = edited(&fixed, &action["edit"]["changes"][URI]);
    }
    assert_eq!(fixed, "rfm 1\nsolid s = x <= 1\n");
    editor.end();
}

#[test]
fn positions_are_counted_as_the_editor_counts() {
    let text = "rfm 1\nlet 𝛼é = 2 let b = spere(1)\n";
    for (encoding, character) in [("utf-16", 20), ("utf-8", 23)] {
        let mut editor = Editor::new(&[encoding]);
        let messages = editor.open(text);
        let found = messages.iter().find(|message| message["code"] == "E0201");
        let start = &found.unwrap_or_else(|| panic!("{messages:?}"))["range"]["start"];
        assert_eq!(*start, json!({ "line": 1, "character": character }), "{encoding}");
        editor.end();
    }
}

#[test]
fn names_are_explained_found_and_renamed() {
    let text = "rfm 1
# how wide it is
param r = 5 mm in 1 mm .. 1 \"radius of the post\"
fn post(at, h = 1) = cylinder(r, h).move([at, 0, 0])
let low = (x - r)/2
solid pair = post(-1) or post(at = 1, h = 2) or low and z <= (r) # r
scene drop {
  box { max: [1, 1, 1] }
  fluid water { shape: pair, fill: middle }
  probe sum { energy: water }
}
";
    let mut editor = Editor::with(text);
    let words = editor.hover(3, 30);
    assert!(words.contains("param r = 5 mm in 1 mm .. 1") && words.contains("radius of the post"), "{words}");
    assert!(words.contains("how wide it is") && words.contains("in m"), "{words}");
    let words = editor.hover(4, 5);
    assert!(
        words.contains("let low = (x - r)/2")
            && words.contains("-0.0025 … 0.4975 m for (0, 0, 0) … (1, 1, 1) m"),
        "{words}"
    );
    let words = editor.hover(5, 8);
    assert!(words.contains("solid pair = post(-1)") && words.contains("ω has no unit"), "{words}");
    assert!(editor.hover(3, 24).contains("cylinder(r = 1, h = 1)"));
    assert!(editor.hover(3, 38).contains("move(by)"));
    assert!(editor.hover(8, 31).contains("key `fill`"));
    assert_eq!(editor.at("hover", 0, 1), Value::Null);
    assert_eq!(editor.hover(2, 13), "1 mm = 0.001 m");
    assert_eq!(editor.hover(3, 9), "`at`: a parameter of the function `post`");
    assert_eq!(editor.hover(3, 12), "`h`: a parameter of the function `post`, 1 if it is left out");
    assert_eq!(editor.hover(8, 9), "`water`: the fluid of the scene `drop`");
    assert!(editor.hover(9, 9).contains("`probes/sum.csv`"));
    editor.change("rfm 1\nsolid s = any i in 0..3: sphere(1).move([3*i, 0, 0])\n");
    let words = editor.hover(1, 11);
    assert!(words.starts_with("a fold by `or`"), "{words}");
    assert_eq!(editor.hover(1, 14), "`i`: the variable of a fold by `any`");
    assert!(editor.at("rename", 1, 11)["code"].is_number());
    editor.change(text);

    let found = editor.at("definition", 5, 62);
    assert_eq!(found["range"]["start"], json!({ "line": 2, "character": 6 }));
    let found = editor.at("definition", 5, 31);
    assert_eq!(found["range"]["start"], json!({ "line": 3, "character": 8 }), "a named argument");
    let found = editor.at("definition", 9, 23);
    assert_eq!(found["range"]["start"], json!({ "line": 8, "character": 8 }), "a fluid");
    assert_eq!(editor.at("references", 2, 6).as_array().unwrap().len(), 4);

    let edits = editor.at("rename", 5, 62);
    let renamed = edited(text, &edits["changes"][URI]);
    let expected = text.replace("param r", "param other").replace("cylinder(r,", "cylinder(other,");
    let expected = expected.replace("x - r", "x - other").replace("(r) #", "(other) #");
    assert_eq!(renamed, expected);
    assert!(editor.change(&renamed).is_empty(), "{:?}", editor.messages);
    editor.change(text);
    let edits = editor.at("rename", 3, 8);
    assert_eq!(
        edited(text, &edits["changes"][URI]),
        text.replace("post(at", "post(other").replace("[at,", "[other,")
    );

    let asked = |name: &str| json!({ "textDocument": { "uri": URI }, "position": { "line": 2, "character": 6 }, "newName": name });
    for name in ["low", "in", "x", "sphere-2", "", "post"] {
        let refused = editor.ask("textDocument/rename", asked(name));
        assert!(refused["code"].is_number(), "{name}: {refused}");
    }
    assert_eq!(editor.at("prepareRename", 3, 38), Value::Null, "a word of the language has no other name");

    let symbols = editor.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": URI } }));
    let names: Vec<&str> =
        symbols.as_array().unwrap().iter().map(|symbol| symbol["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["r", "post", "low", "pair", "drop"]);
    assert_eq!(symbols[4]["children"][1]["name"], "fluid");
    editor.end();
}

#[test]
fn what_fits_is_offered() {
    let mut editor = Editor::with("rfm 1\nlet a = sphere(1).\n");
    let labels = editor.labels(1, 18);
    assert!(
        labels.contains(&"move".into())
            && labels.contains(&"twist".into())
            && !labels.contains(&"sphere".into())
    );

    editor.change("rfm 1\nfn twin(shape, by) = shape or shape.move(by)\nlet a = ");
    let labels = editor.labels(2, 8);
    assert!(
        labels.contains(&"sphere".into())
            && labels.contains(&"twin".into())
            && labels.contains(&"sqrt".into())
    );
    editor.change("rfm 1\nlet a = 1\nso");
    assert!(editor.labels(2, 2).contains(&"solid".into()));
    editor.change("rfm 1\nfn twin(shape, by) = shape or shape.move(by)\nlet a = sphere(1).tw\n");
    assert!(editor.labels(2, 20).contains(&"twin".into()));
    editor.change("rfm 1\nfn f(width, b) = wi");
    assert!(editor.labels(1, 19).contains(&"width".into()));

    editor.change("rfm 1\nscene s {\n  method: \n  fluid water {\n    \n  }\n}\n");
    assert_eq!(editor.labels(2, 10), ["wcsph", "dfsph", "paper"]);
    editor.change("rfm 1\nscene s {\n  method: dfsph\n  fluid water { den");
    let of_dfsph = editor.labels(3, 19);
    assert!(
        of_dfsph.contains(&"density".into()) && !of_dfsph.contains(&"sound_speed".into()),
        "{of_dfsph:?}"
    );
    editor.change("rfm 1\nscene s {\n  method: wcsph\n  fluid water { den");
    assert!(editor.labels(3, 19).contains(&"sound_speed".into()));
    editor.change("rfm 1\nlet a = 1 # sph");
    assert!(editor.labels(1, 15).is_empty());

    editor.change("rfm 1\nlet a = cylinder(0.5, ");
    let help = editor.at("signatureHelp", 1, 22);
    assert_eq!(
        (&help["signatures"][0]["label"], &help["activeParameter"]),
        (&json!("cylinder(r = 1, h = 1)"), &json!(1))
    );
    editor.change("rfm 1\nlet a = sphere(1).rotate([0, 0, 1], ");
    let help = editor.at("signatureHelp", 1, 36);
    assert_eq!(
        (&help["signatures"][0]["label"], &help["activeParameter"]),
        (&json!("rotate(axis, angle, about)"), &json!(1))
    );
    editor.end();
}

#[test]
fn a_file_is_laid_out_and_previewed() {
    let text = "rfm 1\nsolid  ω=sphere( 1 )";
    let mut editor = Editor::with(text);
    let asked = json!({ "textDocument": { "uri": URI }, "options": { "tabSize": 2, "insertSpaces": true } });
    let edits = editor.ask("textDocument/formatting", asked.clone());
    assert_eq!(edited(text, &edits), "rfm 1\nsolid ω = sphere(1)\n");
    let wanted = json!({ "command": "rfm.slice", "arguments": [{ "uri": URI, "axis": "z", "at": 0.5 }] });
    let slice = editor.ask("workspace/executeCommand", wanted);
    assert!(slice["svg"].as_str().unwrap().starts_with("<svg"), "{slice}");
    assert_eq!((&slice["axis"], &slice["at"], &slice["solids"]), (&json!("z"), &json!(0.5), &json!(["ω"])));

    editor.change("rfm 1\nsolid  a = = 1");
    assert_eq!(editor.ask("textDocument/formatting", asked), json!([]));
    let wanted = json!({ "command": "rfm.slice", "arguments": [{ "uri": URI }] });
    assert_eq!(editor.ask("workspace/executeCommand", wanted)["message"], "the file has errors");
    // what is not served is refused, and the server goes on
    assert_eq!(editor.ask("textDocument/semanticTokens/full", json!({}))["code"], -32601);
    assert_eq!(editor.ask("textDocument/hover", json!({}))["code"], -32602);
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": URI } }));
    assert!(editor.await_messages().is_empty());
    editor.end();
}

/// Every prefix of an example, as if it were typed: each is answered, and none is a mistake of the program.
#[test]
fn text_that_is_being_typed_is_answered() {
    let text = std::fs::read_to_string(root().join("tests/cases/stages/scene.rfm")).unwrap();
    let text = format!(
        "{text}fn f(a, b = 2) = any i in 0..3: sphere(a).move([i, b, 0]) # ω\nsolid s = f(1, b = \"t\")²\n"
    );
    let mut editor = Editor::with("");
    for (at, _) in text.char_indices() {
        let prefix = &text[..at];
        editor.change(prefix);
        let line = prefix.matches('\n').count() as u32;
        let character = prefix.rsplit('\n').next().unwrap().encode_utf16().count() as u32;
        for method in ["completion", "hover", "signatureHelp", "definition", "prepareRename"] {
            editor.at(method, line, character);
        }
        editor.ask("textDocument/documentSymbol", json!({ "textDocument": { "uri": URI } }));
        editor.ask(
            "textDocument/formatting",
            json!({ "textDocument": { "uri": URI }, "options": { "tabSize": 2, "insertSpaces": true } }),
        );
    }
    editor.end();
}

/// How long messages take in a file of 500 lines is printed; a slow machine is no mistake.
#[test]
fn a_keystroke_in_500_lines() {
    let item = |i: usize| {
        format!(
            "param r{i} = 0.1 in 0.01 .. 1  \"radius\"\nlet d{i} = x^2 + (y - {i})^2\nfn f{i}(a) = a*d{i} <= r{i}^2\nsolid s{i} = f{i}(2) and 0 <= z <= 1\n"
        )
    };
    let mut text = String::from("rfm 1\n");
    (0..125).for_each(|i| text += &item(i));
    let mut editor = Editor::with(&text);
    assert!(editor.messages.is_empty(), "{:?}", editor.messages);
    let mut times: Vec<f64> = (0..10)
        .map(|i| {
            let changed = format!("{text}# {i}\n");
            let start = Instant::now();
            editor.change(&changed);
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!(
        "500 lines: messages {:.1} ms after a keystroke (median of 10, {:.1} … {:.1})",
        times[5], times[0], times[9]
    );
    editor.end();
}

#[test]
fn behind_an_import_stands_what_it_defines() {
    let folder = tempfile::tempdir().unwrap();
    let pieces = "rfm 1\nimport \"base.rfm\" as base\nparam high = 2   \"height of a piece\"\n\
                  # a piece without a head\nsolid pawn = sphere(1)\nfn rook(width, walls = 4) = sphere(width)\n\
                  scene s { box { max: [1, 1, 1] } }\n";
    std::fs::write(folder.path().join("chess.rfm"), pieces).unwrap();
    let uri = format!("file://{}/game.rfm", folder.path().display());
    let mut editor = Editor::new(&[]);
    let mut labels = |text: &str| -> Vec<(String, String)> {
        let file = json!({ "uri": uri, "languageId": "rfm", "version": 1, "text": text });
        editor.tell("textDocument/didOpen", json!({ "textDocument": file }));
        let position = json!({ "line": 2, "character": text.lines().nth(2).unwrap().len() });
        let found = editor
            .ask("textDocument/completion", json!({ "textDocument": { "uri": uri }, "position": position }));
        let part = |item: &Value, key: &str| item[key].as_str().unwrap_or_default().to_string();
        found
            .as_array()
            .unwrap()
            .iter()
            .map(|item| (part(item, "label"), part(item, "documentation")))
            .collect()
    };
    let head = "rfm 1\nimport \"chess.rfm\" as chess\n";
    let wanted = [("high", "height of a piece"), ("pawn", "a piece without a head"), ("rook", "")];
    let wanted: Vec<_> = wanted.iter().map(|(name, about)| (name.to_string(), about.to_string())).collect();
    assert_eq!(labels(&format!("{head}solid s = chess.")), wanted);
    assert_eq!(labels(&format!("{head}solid s = sphere(1) or chess.pa")), wanted);
    // behind a shape, and behind the name of something else, methods stand
    for text in ["solid s = chess.pawn.", "solid s = sphere(1).", "let a = chess "] {
        let found = labels(&format!("{head}{text}"));
        assert!(found.iter().any(|(name, _)| name == "move" || name == "sphere"), "{text}: {found:?}");
        assert!(!found.iter().any(|(name, _)| name == "pawn"), "{text}");
    }
    // a file that cannot be read has no names
    let found = labels("rfm 1\nimport \"none.rfm\" as chess\nsolid s = chess.");
    assert!(found.iter().any(|(name, _)| name == "move"), "{found:?}");
    // a function of the import has its own parameters, and only behind its name
    let mut help = |line: &str| {
        let file = json!({ "uri": uri, "languageId": "rfm", "version": 1, "text": format!("{head}{line}") });
        editor.tell("textDocument/didOpen", json!({ "textDocument": file }));
        let position = json!({ "line": 2, "character": line.len() });
        let at = json!({ "textDocument": { "uri": uri }, "position": position });
        let help = editor.ask("textDocument/signatureHelp", at);
        (help["signatures"][0]["label"].clone(), help["activeParameter"].clone())
    };
    assert_eq!(help("solid s = chess.rook(2, "), (json!("rook(width, walls = 4)"), json!(1)));
    assert_eq!(help("solid s = chess.rook("), (json!("rook(width, walls = 4)"), json!(0)));
    for line in ["solid s = rook(", "solid s = chess.box(", "solid s = chess.pawn.rook("] {
        assert_eq!(help(line).0, Value::Null, "{line}");
    }
    editor.end();
}

/// A wall that is too thin for the particles of a scene is reported once the text rests.
#[test]
fn what_particles_do_not_show_is_told() {
    let file = root().join("tests/cases/scene_error/wall_thinner_than_the_spacing.rfm");
    let text = std::fs::read_to_string(file).unwrap();
    let mut editor = Editor::with(&text);
    assert!(editor.messages.is_empty(), "{:?}", editor.messages);
    let line = text.lines().position(|line| line.contains("obstacle")).unwrap();
    assert!(!editor.await_messages().is_empty());
    for message in &editor.messages {
        assert_eq!((&message["code"], &message["range"]["start"]["line"]), (&json!("W0508"), &json!(line)));
    }
    editor.end();
}

/// Warnings that take longer come once a text rests, and never about an older one.
#[test]
fn what_takes_longer_is_told_when_the_text_rests() {
    let idle = "rfm 1\nsolid s = sphere(1) or sphere(0.5)\n";
    let mut editor = Editor::with(idle);
    assert!(editor.messages.is_empty(), "{:?}", editor.messages);
    let code =
        |messages: &[Value]| messages.iter().map(|message| message["code"].clone()).collect::<Vec<_>>();
    assert_eq!(code(editor.await_messages()), ["W0415"]);
    let (start, end) = (&editor.messages[0]["range"]["start"], &editor.messages[0]["range"]["end"]);
    assert_eq!(
        (start, end),
        (&json!({ "line": 1, "character": 23 }), &json!({ "line": 1, "character": 34 }))
    );
    // changed before it rests: what is found late is about the last text, and nothing about an older one follows
    for (version, text) in
        ["sphere(1) or sphere(0.7)", "sphere(1) or sphere(2", "\n  sphere(1) or sphere(0.6)"]
            .into_iter()
            .enumerate()
    {
        let file = json!({ "uri": URI, "version": version });
        let change = json!({ "text": format!("rfm 1\nsolid s = {text}\n") });
        let params = json!({ "textDocument": file, "contentChanges": [change] });
        editor.tell("textDocument/didChange", params);
    }
    let mut versions = Vec::new();
    while versions.last() != Some(&2) || editor.messages.is_empty() {
        let message = editor.read();
        versions.push(message["params"]["version"].as_i64().unwrap());
        editor.messages = message["params"]["diagnostics"].as_array().unwrap().clone();
    }
    assert!(versions.is_sorted() && versions.ends_with(&[2, 2]), "{versions:?}");
    assert_eq!(code(&editor.messages), ["W0415"]);
    assert_eq!(editor.messages[0]["range"]["start"]["line"], 2);
    editor.end();
}

/// A message that makes no sense is refused, and those that follow are answered.
#[test]
fn a_senseless_message_is_refused_and_survived() {
    let mut editor = Editor::with("rfm 1\nsolid s = sphere(1)\n");
    for text in ["{", "nonsense", r#"{"jsonrpc": "2.0", "id": 7}"#] {
        let to = editor.to.as_mut().unwrap();
        write!(to, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        to.flush().unwrap();
        assert_eq!(editor.read()["error"]["code"], -32700, "{text}");
    }
    let at = json!({ "textDocument": { "uri": URI }, "position": { "line": 1, "character": 10 } });
    let hover = editor.ask("textDocument/hover", at);
    assert!(hover["contents"].to_string().contains("sphere"), "{hover}");
}

#[test]
fn solids_have_the_colour_of_pictures() {
    let mut editor =
        Editor::with("rfm 1\nlet a = 1\n# 𝄞\nsolid pair = sphere(a)\nsolid post = cylinder(a, 2)\n");
    let colours = editor.about("documentColor");
    let range = |line: u32, from: u32, to: u32| json!({ "start": { "line": line, "character": from }, "end": { "line": line, "character": to } });
    let ranges: Vec<&Value> = colours.as_array().unwrap().iter().map(|found| &found["range"]).collect();
    assert_eq!(ranges, [&range(3, 6, 10), &range(4, 6, 10)]);
    for (channel, expected) in ["red", "green", "blue"].into_iter().zip(rfm::render::OBSTACLE) {
        let found = colours[1]["color"][channel].as_f64().unwrap();
        assert!((255.0 * found - f64::from(expected)).abs() < 0.01, "{channel} {found}");
    }
    // a file cannot say another colour
    let asked =
        json!({ "textDocument": { "uri": URI }, "color": colours[0]["color"], "range": range(3, 6, 10) });
    assert_eq!(editor.ask("textDocument/colorPresentation", asked), json!([]));
    editor.open("rfm 1\nsolid s = \n");
    editor.about("documentColor");
    editor.end();
}
