//! `rfm lsp`: what editors ask about files, over the Language Server Protocol on standard input and output.
//!
//! One thread answers one request after the other: a file is compiled again in milliseconds when it changes,
//! so nothing is kept from one version of a text to the next. Texts are read when a request needs them, or
//! when no message waits: of many changes that come together only the last one is read. Another thread looks
//! for warnings that take longer, and one draws slices.

mod across;
mod background;
mod buffers;
mod colours;
mod complete;
mod context;
mod document;
mod edits;
mod hover;
mod messages;
mod names;
mod pipes;
mod preview;
mod reading;
mod slices;
mod symbols;

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{
    Cancel, DidChangeTextDocument, DidCloseTextDocument, DidOpenTextDocument, Exit, Notification as _,
    PublishDiagnostics,
};
use lsp_types::request::{
    CodeActionRequest, ColorPresentationRequest, Completion, DocumentColor, DocumentSymbolRequest,
    ExecuteCommand, Formatting, GotoDefinition, HoverRequest, Initialize, PrepareRenameRequest, References,
    Rename, Request as _, Shutdown, SignatureHelpRequest,
};
use lsp_types::{
    CancelParams, CodeActionKind, CodeActionOptions, CodeActionProviderCapability, ColorPresentation,
    ColorProviderCapability, CompletionOptions, ExecuteCommandOptions, ExecuteCommandParams,
    GotoDefinitionParams, Hover, HoverContents, HoverParams, HoverProviderCapability, InitializeParams,
    Location, MarkupContent, MarkupKind, NumberOrString, OneOf, PrepareRenameResponse, ReferenceParams,
    RenameOptions, ServerCapabilities, SignatureHelpOptions, TextDocumentPositionParams,
    TextDocumentSyncCapability, TextDocumentSyncKind, Uri,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use rfm::files::Files;

use super::failure::Failure;
use across::Workspace;
use background::Background;
use buffers::Buffers;
use document::Document;
use pipes::Pipes;
use reading::{Encoding, path_of};
use slices::{Asked, Slices};

#[derive(Debug, Args)]
#[command(
    after_help = "Editors start this program themselves and talk to it over standard input and output; there is\n\
                        nothing to see in a terminal. In VS Code take the extension in grammar/vscode. In Neovim:\n\n  \
                        vim.lsp.config('rfm', { cmd = { 'rfm', 'lsp' }, filetypes = { 'rfm' } }); vim.lsp.enable('rfm')\n\n\
                        In Helix, in languages.toml:\n\n  \
                        [language-server.rfm]\n  command = \"rfm\"\n  args = [\"lsp\"]\n\n  \
                        [[language]]\n  name = \"rfm\"\n  scope = \"source.rfm\"\n  file-types = [\"rfm\"]\n  \
                        comment-token = \"#\"\n  language-servers = [\"rfm\"]\n\n\
                        It offers: messages with quick fixes, layout, what is known of a name, definitions, uses,\n\
                        completion, other names, symbols, colours of solids, arguments of calls, and the command rfm.slice for previews."
)]
pub(super) struct Lsp {}

/// Serves one editor until it says good-bye.
pub(super) fn run(_: &Lsp) -> Result<(), Failure> {
    let (connection, pipes) = Pipes::open()?;
    let end = serve(&connection)?;
    // the threads end when the last sender is gone
    drop(connection);
    pipes.close()?;
    match end {
        End::InOrder => Ok(()),
        // the protocol asks for the exit code 1
        End::WithoutShutdown => Err(Failure::Findings),
    }
}

/// How an editor ended the server.
enum End {
    /// It asked for a shutdown first, or closed its pipe.
    InOrder,
    WithoutShutdown,
}

fn serve(connection: &Connection) -> Result<End, Failure> {
    let workspace = match greet(connection)? {
        Ok(workspace) => workspace,
        Err(end) => return Ok(end),
    };
    let sender = connection.sender.clone();
    // an editor that is gone is noticed by the other thread
    let send = move |messages| _ = sender.send(publication(messages));
    let background = Background::start(workspace.encoding, workspace.buffers.clone(), send);
    let sender = connection.sender.clone();
    let slices = Slices::start(move |answer| _ = sender.send(Message::Response(answer)));
    let mut server = Server { connection, workspace, waiting: Vec::new(), background, slices };
    let mut is_shut = false;
    while let Some(message) = server.next()? {
        match message {
            Message::Request(Request { id, .. }) if is_shut => {
                let refusal = "the server was shut down and waits for `exit`".to_string();
                let answer = Response::new_err(id, ErrorCode::InvalidRequest as i32, refusal);
                server.send(Message::Response(answer))?;
            }
            Message::Request(Request { id, method, .. }) if method == Shutdown::METHOD => {
                is_shut = true;
                server.slices.cancel_all();
                server.send(Message::Response(Response::new_ok(id, ())))?;
            }
            Message::Request(request) => {
                while server.read_next()? {}
                if let Some(answer) = server.answer(request) {
                    server.send(Message::Response(answer))?;
                }
            }
            Message::Notification(notification) if notification.method == Exit::METHOD => {
                return Ok(if is_shut { End::InOrder } else { End::WithoutShutdown });
            }
            Message::Notification(notification) if !is_shut => server.notice(notification)?,
            Message::Notification(_) | Message::Response(_) => {}
        }
    }
    // a client that closes the pipe behind the last request may still read
    server.slices.finish();
    Ok(End::InOrder)
}

/// Answers the first request of an editor. The inner error is how it ended the server before that.
fn greet(connection: &Connection) -> Result<Result<Workspace, End>, Failure> {
    let send = |answer| connection.sender.send(Message::Response(answer)).map_err(|_| Failure::ClosedPipe);
    for message in &connection.receiver {
        match message {
            Message::Request(Request { id, method, params }) if method == Initialize::METHOD => {
                let parameters: InitializeParams = match from_json(params) {
                    Ok(parameters) => parameters,
                    Err(Refusal { code, message }) => {
                        send(Response::new_err(id, code as i32, message))?;
                        continue;
                    }
                };
                let general = parameters.capabilities.general.as_ref();
                let encoding =
                    Encoding::chosen(general.and_then(|general| general.position_encodings.as_deref()));
                let answer = serde_json::json!({
                    "capabilities": capabilities(encoding),
                    "serverInfo": { "name": "rfm", "version": env!("CARGO_PKG_VERSION") },
                });
                send(Response::new_ok(id, answer))?;
                return Ok(Ok(Workspace {
                    encoding,
                    may_choose: may_choose(&parameters),
                    buffers: Buffers::default(),
                    documents: HashMap::new(),
                    roots: roots(&parameters),
                }));
            }
            Message::Request(Request { id, .. }) => {
                let refusal = "`initialize` comes first".to_string();
                send(Response::new_err(id, ErrorCode::ServerNotInitialized as i32, refusal))?;
            }
            Message::Notification(notification) if notification.method == Exit::METHOD => {
                return Ok(Err(End::WithoutShutdown));
            }
            Message::Notification(_) | Message::Response(_) => {}
        }
    }
    Ok(Err(End::InOrder))
}

/// The folders that an editor works in.
fn roots(parameters: &InitializeParams) -> Vec<PathBuf> {
    let folders = parameters.workspace_folders.iter().flatten().map(|folder| &folder.uri);
    folders.map(|uri| PathBuf::from(path_of(uri))).collect()
}

/// Whether an editor lets the user choose what a completion replaces.
fn may_choose(parameters: &InitializeParams) -> bool {
    let text = parameters.capabilities.text_document.as_ref();
    let item = text.and_then(|text| text.completion.as_ref()?.completion_item.as_ref());
    item.and_then(|item| item.insert_replace_support).unwrap_or(false)
}

fn capabilities(encoding: Encoding) -> ServerCapabilities {
    ServerCapabilities {
        position_encoding: Some(encoding.kind()),
        text_document_sync: Some(TextDocumentSyncCapability::Kind(TextDocumentSyncKind::FULL)),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        completion_provider: Some(CompletionOptions {
            trigger_characters: Some(vec![".".to_string()]),
            ..CompletionOptions::default()
        }),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: Some(vec!["(".to_string(), ",".to_string()]),
            ..SignatureHelpOptions::default()
        }),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        document_formatting_provider: Some(OneOf::Left(true)),
        code_action_provider: Some(CodeActionProviderCapability::Options(CodeActionOptions {
            code_action_kinds: Some(vec![CodeActionKind::QUICKFIX]),
            ..CodeActionOptions::default()
        })),
        color_provider: Some(ColorProviderCapability::Simple(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: Default::default(),
        })),
        execute_command_provider: Some(ExecuteCommandOptions {
            commands: vec![preview::COMMAND.to_string()],
            ..ExecuteCommandOptions::default()
        }),
        ..ServerCapabilities::default()
    }
}

/// Why a request has no answer.
struct Refusal {
    code: ErrorCode,
    message: String,
}

impl Refusal {
    fn new(code: ErrorCode, message: impl std::fmt::Display) -> Self {
        Self { code, message: message.to_string() }
    }

    fn answer(self, id: RequestId) -> Response {
        Response::new_err(id, self.code as i32, self.message)
    }
}

struct Server<'c> {
    connection: &'c Connection,
    workspace: Workspace,
    /// Texts that have not been read, at most one for each file.
    waiting: Vec<Waiting>,
    background: Background,
    slices: Slices,
}

/// A text that is to be read.
struct Waiting {
    uri: Uri,
    text: Arc<str>,
    version: Option<i32>,
}

impl Server<'_> {
    fn send(&self, message: Message) -> Result<(), Failure> {
        // the editor is gone: nothing is left to do
        self.connection.sender.send(message).map_err(|_| Failure::ClosedPipe)
    }

    /// The next message of the editor; `None` if the editor is gone. While it waits, texts are read.
    fn next(&mut self) -> Result<Option<Message>, Failure> {
        loop {
            if let Ok(message) = self.connection.receiver.try_recv() {
                return Ok(Some(message));
            }
            if !self.read_next()? {
                return Ok(self.connection.receiver.recv().ok());
            }
        }
    }

    /// The answer to a request; `None` for one that is answered later.
    fn answer(&self, request: Request) -> Option<Response> {
        let id: RequestId = request.id.clone();
        // a bug in one answer must not end the work on all files
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            if request.method == ExecuteCommand::METHOD {
                asked::<ExecuteCommand>(request.params)
                    .and_then(|asked| self.command(&id, asked))
                    .map(|()| None)
            } else {
                self.result(request).map(Some)
            }
        }));
        Some(match outcome {
            Ok(Ok(result)) => return result.map(|result| Response::new_ok(id, result)),
            Ok(Err(refusal)) => refusal.answer(id),
            Err(_) => {
                Response::new_err(id, ErrorCode::InternalError as i32, "this is a mistake of rfm".into())
            }
        })
    }

    fn result(&self, request: Request) -> Result<Value, Refusal> {
        let parameters = request.params;
        match request.method.as_str() {
            Formatting::METHOD => {
                let asked = asked::<Formatting>(parameters)?;
                given(edits::layout(&*self.document(&asked.text_document.uri)?))
            }
            HoverRequest::METHOD => given(self.hover(&asked::<HoverRequest>(parameters)?)?),
            GotoDefinition::METHOD => given(self.definition(&asked::<GotoDefinition>(parameters)?)?),
            References::METHOD => given(self.references(&asked::<References>(parameters)?)?),
            Completion::METHOD => {
                let asked = asked::<Completion>(parameters)?;
                let (document, byte) = self.place(&asked.text_document_position)?;
                given(complete::at(&document, byte, self.workspace.may_choose))
            }
            SignatureHelpRequest::METHOD => {
                let asked = asked::<SignatureHelpRequest>(parameters)?;
                let (document, byte) = self.place(&asked.text_document_position_params)?;
                given(complete::signature_help(&document, byte))
            }
            DocumentSymbolRequest::METHOD => {
                let asked = asked::<DocumentSymbolRequest>(parameters)?;
                given(symbols::of(&*self.document(&asked.text_document.uri)?))
            }
            DocumentColor::METHOD => {
                let asked = asked::<DocumentColor>(parameters)?;
                given(colours::of(&*self.document(&asked.text_document.uri)?))
            }
            // no text of a file makes a colour
            ColorPresentationRequest::METHOD => {
                asked::<ColorPresentationRequest>(parameters)?;
                given(Vec::<ColorPresentation>::new())
            }
            CodeActionRequest::METHOD => {
                let asked = asked::<CodeActionRequest>(parameters)?;
                let uri = &asked.text_document.uri;
                given(edits::fixes(uri, &*self.document(uri)?, asked.range))
            }
            PrepareRenameRequest::METHOD => {
                given(self.renamable(&asked::<PrepareRenameRequest>(parameters)?)?)
            }
            Rename::METHOD => {
                let asked = asked::<Rename>(parameters)?;
                let position = &asked.text_document_position;
                let (document, byte) = self.place(position)?;
                let uri = &position.text_document.uri;
                let edits = self.workspace.rename(uri, &document, byte, &asked.new_name);
                given(edits.map_err(|why| Refusal::new(ErrorCode::InvalidParams, why))?)
            }
            method => Err(Refusal::new(ErrorCode::MethodNotFound, format!("{method} is not served"))),
        }
    }

    fn hover(&self, asked: &HoverParams) -> Result<Option<Hover>, Refusal> {
        let (document, byte) = self.place(&asked.text_document_position_params)?;
        Ok(hover::at(&self.workspace, &document, byte).map(|(value, place)| Hover {
            contents: HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value }),
            range: Some(document.range(place)),
        }))
    }

    fn definition(&self, asked: &GotoDefinitionParams) -> Result<Option<Location>, Refusal> {
        let position = &asked.text_document_position_params;
        let (document, byte) = self.place(position)?;
        let found = self.workspace.definition(&position.text_document.uri, &document, byte);
        Ok(found.map(|place| place.location()))
    }

    fn references(&self, asked: &ReferenceParams) -> Result<Option<Vec<Location>>, Refusal> {
        let position = &asked.text_document_position;
        let (document, byte) = self.place(position)?;
        let uses = self.workspace.uses(&position.text_document.uri, &document, byte);
        // the definition comes first
        let from = usize::from(!asked.context.include_declaration);
        Ok(uses.map(|uses| uses.iter().skip(from).map(across::Place::location).collect()))
    }

    fn renamable(
        &self,
        asked: &TextDocumentPositionParams,
    ) -> Result<Option<PrepareRenameResponse>, Refusal> {
        let (document, byte) = self.place(asked)?;
        Ok(across::own_name(&document, byte)
            .map(|mention| PrepareRenameResponse::Range(document.range(mention.place.clone()))))
    }

    /// Has the command of a request carried out, which is answered later.
    fn command(&self, id: &RequestId, asked: ExecuteCommandParams) -> Result<(), Refusal> {
        let ExecuteCommandParams { command, mut arguments, .. } = asked;
        if command != preview::COMMAND {
            return Err(Refusal::new(
                ErrorCode::InvalidParams,
                format!("there is no such command: {command}"),
            ));
        }
        if arguments.len() != 1 {
            return Err(Refusal::new(ErrorCode::InvalidParams, preview::EXPECTED));
        }
        let wanted: preview::Wanted = serde_json::from_value(arguments.remove(0)).map_err(|error| {
            Refusal::new(ErrorCode::InvalidParams, format!("{error}: {}", preview::EXPECTED))
        })?;
        let document = self.document(&wanted.uri)?;
        self.slices.ask(Asked { id: id.clone(), document, wanted });
        Ok(())
    }

    fn document(&self, uri: &Uri) -> Result<Arc<Document>, Refusal> {
        let found = self.workspace.documents.get(uri.as_str()).cloned();
        found.ok_or_else(|| Refusal::new(ErrorCode::InvalidParams, "the file is not open"))
    }

    fn place(&self, at: &TextDocumentPositionParams) -> Result<(Arc<Document>, usize), Refusal> {
        let document = self.document(&at.text_document.uri)?;
        let byte = document.byte(at.position);
        Ok((document, byte))
    }

    fn notice(&mut self, notification: Notification) -> Result<(), Failure> {
        let parameters = notification.params;
        // what does not fit the protocol cannot be answered, and needs no answer
        match notification.method.as_str() {
            DidOpenTextDocument::METHOD => {
                type Opened = <DidOpenTextDocument as lsp_types::notification::Notification>::Params;
                let Ok(opened) = serde_json::from_value::<Opened>(parameters) else { return Ok(()) };
                let file = opened.text_document;
                self.give(file.uri, file.text.into(), Some(file.version));
                Ok(())
            }
            DidChangeTextDocument::METHOD => {
                type Changed = <DidChangeTextDocument as lsp_types::notification::Notification>::Params;
                let Ok(changed) = serde_json::from_value::<Changed>(parameters) else { return Ok(()) };
                let file = changed.text_document;
                // whole texts are asked for, but some editors send parts all the same
                let Workspace { encoding, buffers, .. } = &self.workspace;
                let before = buffers.text(&Files::plain(&path_of(&file.uri)));
                if let Some(text) = reading::changed(before, changed.content_changes, *encoding) {
                    self.give(file.uri, text, Some(file.version));
                }
                Ok(())
            }
            DidCloseTextDocument::METHOD => {
                type Closed = <DidCloseTextDocument as lsp_types::notification::Notification>::Params;
                let Ok(closed) = serde_json::from_value::<Closed>(parameters) else { return Ok(()) };
                let uri = closed.text_document.uri;
                let path = Files::plain(&path_of(&uri));
                self.workspace.documents.remove(uri.as_str());
                self.workspace.buffers.close(&path);
                self.waiting.retain(|waiting| waiting.uri != uri);
                self.background.forget(&uri);
                self.read_again(&path);
                let nothing =
                    lsp_types::PublishDiagnosticsParams { uri, diagnostics: Vec::new(), version: None };
                self.publish(nothing)
            }
            Cancel::METHOD => {
                let Ok(CancelParams { id }) = serde_json::from_value(parameters) else { return Ok(()) };
                // all other requests are answered before the next message is read
                self.slices.cancel(&match id {
                    NumberOrString::Number(id) => id.into(),
                    NumberOrString::String(id) => id.into(),
                });
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Takes a new version of a text, which is read later together with those that import it.
    fn give(&mut self, uri: Uri, text: Arc<str>, version: Option<i32>) {
        let path = Files::plain(&path_of(&uri));
        self.workspace.buffers.put(&path, &text);
        self.background.forget(&uri);
        self.waiting.retain(|waiting| waiting.uri != uri);
        self.waiting.push(Waiting { uri, text, version });
        self.read_again(&path);
    }

    /// Has all open files read again that import the file of a path.
    fn read_again(&mut self, path: &str) {
        for (uri, document) in &self.workspace.documents {
            let is_waiting = self.waiting.iter().any(|waiting| waiting.uri.as_str() == uri);
            if document.names_file(path)
                && !is_waiting
                && let Ok(uri) = uri.parse::<Uri>()
            {
                self.background.forget(&uri);
                self.waiting.push(Waiting { uri, text: document.text().into(), version: document.version });
            }
        }
    }

    /// Compiles a text that waits and sends its messages. Returns whether there was one.
    fn read_next(&mut self) -> Result<bool, Failure> {
        if self.waiting.is_empty() {
            return Ok(false);
        }
        let Waiting { uri, text, version } = self.waiting.remove(0);
        let Workspace { encoding, buffers, .. } = &self.workspace;
        // a text on which the compiler fails is answered as a file that is not open
        let read = catch_unwind(AssertUnwindSafe(|| Document::new(&uri, &text, version, *encoding, buffers)));
        let Ok(document) = read else {
            self.workspace.documents.remove(uri.as_str());
            return Ok(true);
        };
        let messages = messages::published(&uri, &document);
        self.workspace.documents.insert(uri.as_str().to_string(), Arc::new(document));
        self.publish(messages)?;
        self.background.give(&uri, text.to_string(), version);
        Ok(true)
    }

    fn publish(&self, messages: lsp_types::PublishDiagnosticsParams) -> Result<(), Failure> {
        self.send(publication(messages))
    }
}

fn publication(messages: lsp_types::PublishDiagnosticsParams) -> Message {
    Message::Notification(Notification::new(PublishDiagnostics::METHOD.to_string(), messages))
}

/// What a request asks.
fn asked<R: lsp_types::request::Request<Params: DeserializeOwned>>(
    parameters: Value,
) -> Result<R::Params, Refusal> {
    from_json(parameters)
}

fn from_json<T: DeserializeOwned>(parameters: Value) -> Result<T, Refusal> {
    serde_json::from_value(parameters).map_err(|error| Refusal::new(ErrorCode::InvalidParams, error))
}

fn given(result: impl Serialize) -> Result<Value, Refusal> {
    serde_json::to_value(result).map_err(|error| Refusal::new(ErrorCode::InternalError, error))
}
