//! `rfm.slice` of a solid that takes long to draw: all else is answered meanwhile.

use std::path::Path;

use serde_json::{Value, json};

use crate::lsp::{Editor, URI};

const SLOW: &str =
    "rfm 1\nsolid s = (any i in 0..60: box([0,0,0],[1,1,1]).rotate_z(i).move([i*0.5,0,0])).round(0.1)\n";

const OTHER: &str = "file:///files/other.rfm";

fn asked(id: impl Into<Value>, more: Value) -> Value {
    let mut wanted = json!({ "uri": URI });
    more.as_object().unwrap().iter().for_each(|(key, value)| wanted[key] = value.clone());
    let params = json!({ "command": "rfm.slice", "arguments": [wanted] });
    json!({ "jsonrpc": "2.0", "id": id.into(), "method": "workspace/executeCommand", "params": params })
}

/// The answers to the given number of requests, in the order in which they come.
fn answers(editor: &mut Editor, count: usize) -> Vec<Value> {
    let all = std::iter::repeat_with(|| editor.read());
    all.filter(|message| !message["id"].is_null()).take(count).collect()
}

/// What is tested is the order of the answers, not how long they take.
#[test]
#[ignore = "long"]
fn a_slice_that_takes_long_holds_up_nothing() {
    let mut editor = Editor::new(&[]);
    editor.open(SLOW);
    let file =
        json!({ "uri": OTHER, "languageId": "rfm", "version": 1, "text": "rfm 1\nsolid b = sphere(1)\n" });
    editor.tell("textDocument/didOpen", json!({ "textDocument": file }));
    for (id, at) in [("first", 0.3), ("second", 0.4), ("third", 0.5)] {
        editor.write(&asked(id, json!({ "at": at })));
    }
    editor.write(&asked(7, json!({ "panel": "another" })));
    editor.tell("$/cancelRequest", json!({ "id": 7 }));
    let at = json!({ "textDocument": { "uri": OTHER }, "position": { "line": 1, "character": 12 } });
    editor.write(&json!({ "jsonrpc": "2.0", "id": "hover", "method": "textDocument/hover", "params": at }));
    let answers = answers(&mut editor, 5);
    let place = |id: Value| {
        let found = answers.iter().position(|answer| answer["id"] == id);
        found.unwrap_or_else(|| panic!("{id} is not answered: {answers:?}"))
    };
    let answer = |id: Value| &answers[place(id)];
    assert!(answer(json!("hover"))["result"]["contents"].to_string().contains("sphere"));
    assert!(place(json!("hover")) < place(json!("third")));
    let third = &answer(json!("third"))["result"];
    assert_eq!((&third["at"], &third["solid"]), (&json!(0.5), &json!("s")));
    assert_eq!(answer(json!(7))["error"]["code"], -32800, "not wanted any more");
    // of those that wait only the newest is drawn; one of the first two may have been begun before the next one came
    let older = [("first", 0.3), ("second", 0.4)].map(|(id, at)| (answer(json!(id)), at));
    let refused = older.iter().filter(|(answer, _)| answer["error"]["code"] == -32801).count();
    let drawn = older.iter().filter(|(answer, at)| answer["result"]["at"] == *at).count();
    assert!(refused >= 1 && refused + drawn == 2, "{older:?}");
    editor.end();
}

/// An editor that ends does not wait, and one that has only closed its pipe gets its slice.
#[test]
fn slices_are_answered_before_the_end() {
    let mut editor = Editor::new(&[]);
    editor.open(SLOW);
    editor.write(&asked("slice", json!({})));
    editor.write(&json!({ "jsonrpc": "2.0", "id": "end", "method": "shutdown" }));
    let answers = answers(&mut editor, 2);
    assert_eq!((&answers[0]["id"], &answers[0]["error"]["code"]), (&json!("slice"), &json!(-32800)));
    assert_eq!(answers[1]["id"], "end");
    editor.end_after_shutdown();

    let hello =
        json!({ "jsonrpc": "2.0", "id": 1, "method": "initialize", "params": { "capabilities": {} } });
    let file =
        json!({ "uri": URI, "languageId": "rfm", "version": 1, "text": "rfm 1\nsolid b = sphere(1)\n" });
    let open =
        json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": { "textDocument": file } });
    let framed = |message: Value| format!("Content-Length: {}\r\n\r\n{message}", message.to_string().len());
    let input: String = [hello, open, asked(2, json!({}))].map(framed).concat();
    let ended = crate::tool::rfm_reading(Path::new("."), &["lsp"], input.as_bytes()).expect(0);
    assert!(ended.stdout.contains("<svg"), "{}", ended.stdout);
}
