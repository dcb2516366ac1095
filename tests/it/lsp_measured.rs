//! Warnings of `rfm lsp` that need solids to be measured: they follow the others, and never about an older text.

use serde_json::Value;

use crate::lsp::Editor;

/// What `rfm check` finds by measuring a solid follows what formulas show.
#[test]
fn what_measuring_shows_is_told_after_that() {
    let text = "rfm 1\nsolid slab = 0 <= z <= 1\nsolid pin = sphere(1) or sphere(0.5) or cylinder(0.004, 1.5)\n\
                solid none = x <= 0 and x >= 1 and box()\n";
    let mut editor = Editor::with(text);
    assert!(editor.messages.is_empty(), "{:?}", editor.messages);
    let told = |messages: &[Value]| {
        let line = |message: &Value| message["range"]["start"]["line"].as_u64().unwrap();
        let code = |message: &Value| message["code"].as_str().unwrap().to_string();
        messages.iter().map(|message| (line(message), code(message))).collect::<Vec<_>>()
    };
    let formulas = told(editor.await_messages());
    assert_eq!(formulas, [(2, "W0415".to_string())]);
    let all = told(editor.await_messages());
    assert!(all.starts_with(&formulas), "{all:?}");
    for (line, code) in [(1, "W0403"), (2, "W0408"), (3, "W0402")] {
        assert!(all.contains(&(line, code.to_string())), "{code}: {all:?}");
    }
    editor.end();
}
