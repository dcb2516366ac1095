// A thin layer over `rfm lsp`: it starts the program and shows its slices beside the text.

const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;
let preview;

function activate(context) {
  const command = vscode.workspace.getConfiguration("rfm").get("path");
  client = new LanguageClient(
    "rfm",
    "rfm",
    { command, args: ["lsp"] },
    { documentSelector: [{ language: "rfm" }] },
  );
  client.start().catch((error) => {
    vscode.window.showErrorMessage(
      `cannot start \`${command} lsp\`: ${error.message}. The setting rfm.path says where the program is.`,
    );
  });
  context.subscriptions.push(
    vscode.commands.registerCommand("rfm.preview", () => {
      const editor = vscode.window.activeTextEditor;
      if (editor?.document.languageId === "rfm") {
        preview ??= new Preview(() => (preview = undefined));
        preview.show(editor);
      }
    }),
    vscode.workspace.onDidChangeTextDocument(({ document }) => preview?.changed(document)),
    vscode.window.onDidChangeActiveTextEditor((editor) => preview?.moved(editor)),
    vscode.window.onDidChangeTextEditorSelection(({ textEditor }) => preview?.moved(textEditor)),
  );
}

function deactivate() {
  return client?.stop();
}

// The one panel with a slice. It follows the text, and the cursor from solid to solid.
class Preview {
  constructor(closed) {
    this.wanted = {};
    this.panel = vscode.window.createWebviewPanel(
      "rfm.preview",
      "slice",
      { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
      { enableScripts: true, retainContextWhenHidden: true },
    );
    this.panel.webview.html = page(nonce());
    this.panel.webview.onDidReceiveMessage((wanted) => {
      if (wanted.jump) {
        this.jump();
      } else {
        Object.assign(this.wanted, wanted);
        this.draw();
      }
    });
    this.panel.onDidDispose(() => {
      clearTimeout(this.waiting);
      this.panel = undefined;
      closed();
    });
  }

  show(editor) {
    this.panel.reveal(undefined, true);
    this.moved(editor, true);
  }

  changed(document) {
    if (document.uri.toString() !== this.wanted.uri) return;
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.draw(), 30);
  }

  // the solid in whose lines the cursor stands is the one that is shown
  moved(editor, always = false) {
    if (editor?.document.languageId !== "rfm") return;
    const uri = editor.document.uri.toString();
    const solid = solidAt(editor.document, editor.selection.active.line);
    const isOther = uri !== this.wanted.uri || (solid && solid !== this.wanted.solid);
    if (!isOther && !always) return;
    this.wanted = uri === this.wanted.uri ? { ...this.wanted, solid, at: undefined } : { uri, solid };
    this.draw();
  }

  // asks for one slice at a time: of all that is wanted meanwhile only the newest is asked for next
  async draw() {
    this.isWanted = true;
    if (this.isAsking) return;
    this.isAsking = true;
    try {
      while (this.isWanted && this.panel) {
        this.isWanted = false;
        await this.ask({ ...this.wanted });
      }
    } finally {
      this.isAsking = false;
    }
  }

  async ask(wanted) {
    try {
      const slice = await client.sendRequest("workspace/executeCommand", {
        command: "rfm.slice",
        arguments: [wanted],
      });
      // the panel is closed, or shows another file by now
      if (!this.panel || wanted.uri !== this.wanted.uri) return;
      this.shown = slice.solid;
      this.panel.title = `${slice.solid}, ${slice.axis} = ${Number(slice.at.toPrecision(4))}`;
      this.panel.webview.postMessage({ slice });
    } catch (error) {
      // the last good picture stays
      if (wanted.uri !== this.wanted.uri) return;
      this.panel?.webview.postMessage({ error: error.message });
    }
  }

  // shows the definition of the solid that is drawn
  async jump() {
    if (!this.wanted.uri) return;
    const document = await vscode.workspace.openTextDocument(vscode.Uri.parse(this.wanted.uri));
    const name = this.shown;
    for (let line = 0; name && line < document.lineCount; line += 1) {
      if (solidOf(document.lineAt(line).text) === name) {
        const range = document.lineAt(line).range;
        await vscode.window.showTextDocument(document, { viewColumn: vscode.ViewColumn.One, selection: range });
        return;
      }
    }
  }
}

function solidOf(line) {
  return /^\s*solid\s+([\p{L}_][\p{L}0-9_]*)/u.exec(line)?.[1];
}

// the solid whose definition holds a line
function solidAt(document, line) {
  for (let at = line; at >= 0; at -= 1) {
    const text = document.lineAt(at).text;
    if (/^\s*(param|let|fn|scene|import)\b/.test(text)) return undefined;
    const solid = solidOf(text);
    if (solid) return solid;
  }
  return undefined;
}

function nonce() {
  return Array.from({ length: 32 }, () => Math.floor(Math.random() * 36).toString(36)).join("");
}

function page(key) {
  return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; img-src data:; style-src 'nonce-${key}'; script-src 'nonce-${key}'">
<style nonce="${key}">
body { padding: 8px; }
img { width: 100%; background: white; }
#bar { display: flex; gap: 8px; align-items: center; }
#at { flex: 1; }
#error { color: var(--vscode-errorForeground); min-height: 1.5em; }
</style>
</head>
<body>
<div id="bar">
<select id="solid" aria-label="solid"></select>
<select id="axis" aria-label="axis"><option>x</option><option>y</option><option>z</option></select>
<input id="at" type="range" aria-label="place of the plane" step="any">
<button id="jump">to the text</button>
</div>
<p id="error" role="status"></p>
<img id="picture" alt="">
<script nonce="${key}">
const editor = acquireVsCodeApi();
const find = (id) => document.getElementById(id);
find("solid").onchange = () => editor.postMessage({ solid: find("solid").value, at: undefined });
find("axis").onchange = () => editor.postMessage({ axis: find("axis").value, at: undefined });
find("at").oninput = () => editor.postMessage({ at: Number(find("at").value) });
find("jump").onclick = () => editor.postMessage({ jump: true });
window.onmessage = ({ data: { slice, error } }) => {
  find("error").textContent = error ?? "";
  if (!slice) return;
  find("picture").src = "data:image/svg+xml;utf8," + encodeURIComponent(slice.svg);
  find("picture").alt = slice.solid + " at " + slice.axis + " = " + slice.at;
  find("solid").replaceChildren(...slice.solids.map((name) => new Option(name, name, false, name === slice.solid)));
  find("axis").value = slice.axis;
  Object.assign(find("at"), { min: slice.from, max: slice.to });
  if (document.activeElement !== find("at")) find("at").value = slice.at;
};
</script>
</body>
</html>`;
}

module.exports = { activate, deactivate };
