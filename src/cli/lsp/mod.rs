//! `rfm lsp`: what editors ask about files, over the Language Server Protocol on standard input and output.
//!
//! One thread answers one request after the other: a file is compiled again in milliseconds when it changes, so nothing is
//! kept from one version of a text to the next. Another thread looks for warnings that take longer.

mod background;
mod complete;
mod context;
mod document;
mod edits;
mod hover;
mod messages;
mod names;
mod pipes;
mod preview;
mod symbols;
mod words;

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use clap::Args;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{
    DidChangeTextDocument, DidCloseTextDocument, DidOpenTextDocument, Notification as _, PublishDiagnostics,
};
use lsp_types::request::{
    CodeActionRequest, Completion, DocumentSymbolRequest, ExecuteCommand, Formatting, GotoDefinition,
    HoverRequest, PrepareRenameRequest, References, Rename, Request as _, SignatureHelpRequest,
};
use lsp_types::{
    CodeActionKind, CodeActionOptions, CodeActionProviderCapability, CompletionOptions,
    ExecuteCommandOptions, GotoDefinitionParams, Hover, HoverContents, HoverParams, HoverProviderCapability,
    InitializeParams, Location, MarkupContent, MarkupKind, OneOf, Position, PrepareRenameResponse,
    ReferenceParams, RenameOptions, ServerCapabilities, SignatureHelpOptions, TextDocumentPositionParams,
    TextDocumentSyncCapability, TextDocumentSyncKind, Uri,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::failure::Failure;
use background::Background;
use document::{Document, Encoding};
use names::Meaning;
use pipes::Pipes;

#[derive(Debug, Args)]
#[command(
    after_help = "Editors start this program themselves and talk to it over standard input and output; there is nothing to\n\
                        see in a terminal. In VS Code take the extension in grammar/vscode. In Neovim:\n\n  \
                        vim.lsp.config('rfm', { cmd = { 'rfm', 'lsp' }, filetypes = { 'rfm' } }); vim.lsp.enable('rfm')\n\n\
                        In Helix, in languages.toml:\n\n  \
                        [language-server.rfm]\n  command = \"rfm\"\n  args = [\"lsp\"]\n\n  \
                        [[language]]\n  name = \"rfm\"\n  scope = \"source.rfm\"\n  file-types = [\"rfm\"]\n  \
                        comment-token = \"#\"\n  language-servers = [\"rfm\"]\n\n\
                        It offers: messages with quick fixes, layout, what is known of a name, definitions, uses, completion,\n\
                        other names, symbols, arguments of calls, and the command rfm.slice for previews."
)]
pub(super) struct Lsp {}

/// Serves one editor until it says good-bye.
pub(super) fn run(_: &Lsp) -> Result<(), Failure> {
    let (connection, pipes) = Pipes::open()?;
    let outcome = serve(&connection);
    // the threads end when the last sender is gone
    drop(connection);
    outcome?;
    pipes.close()?;
    Ok(())
}

fn serve(connection: &Connection) -> Result<(), Failure> {
    let (id, parameters) = connection.initialize_start().map_err(Failure::usage)?;
    let parameters: InitializeParams = serde_json::from_value(parameters).map_err(Failure::usage)?;
    let general = parameters.capabilities.general.as_ref();
    let encoding = Encoding::chosen(general.and_then(|general| general.position_encodings.as_deref()));
    let answer = serde_json::json!({
        "capabilities": capabilities(encoding),
        "serverInfo": { "name": "rfm", "version": env!("CARGO_PKG_VERSION") },
    });
    connection.initialize_finish(id, answer).map_err(Failure::usage)?;
    let sender = connection.sender.clone();
    // an editor that is gone is noticed by the other thread
    let background = Background::start(encoding, move |messages| _ = sender.send(publication(messages)));
    let mut server = Server { connection, encoding, documents: HashMap::new(), background };
    for message in &connection.receiver {
        match message {
            Message::Request(request) => {
                if connection.handle_shutdown(&request).map_err(Failure::usage)? {
                    return Ok(());
                }
                let answer = server.answer(request);
                server.send(Message::Response(answer))?;
            }
            Message::Notification(notification) => server.notice(notification)?,
            Message::Response(_) => {}
        }
    }
    Ok(())
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
}

struct Server<'c> {
    connection: &'c Connection,
    encoding: Encoding,
    documents: HashMap<String, Document>,
    background: Background,
}

impl Server<'_> {
    fn send(&self, message: Message) -> Result<(), Failure> {
        // the editor is gone: there is nobody left to serve
        self.connection.sender.send(message).map_err(|_| Failure::ClosedPipe)
    }

    fn answer(&self, request: Request) -> Response {
        let id: RequestId = request.id.clone();
        // a bug in one answer must not end the work on all files
        let outcome = catch_unwind(AssertUnwindSafe(|| self.result(request)));
        match outcome {
            Ok(Ok(result)) => Response::new_ok(id, result),
            Ok(Err(refusal)) => Response::new_err(id, refusal.code as i32, refusal.message),
            Err(_) => {
                Response::new_err(id, ErrorCode::InternalError as i32, "this is a mistake of rfm".into())
            }
        }
    }

    fn result(&self, request: Request) -> Result<Value, Refusal> {
        let parameters = request.params;
        match request.method.as_str() {
            Formatting::METHOD => {
                let asked = asked::<Formatting>(parameters)?;
                given(edits::layout(self.document(&asked.text_document.uri)?))
            }
            HoverRequest::METHOD => given(self.hover(&asked::<HoverRequest>(parameters)?)?),
            GotoDefinition::METHOD => given(self.definition(&asked::<GotoDefinition>(parameters)?)?),
            References::METHOD => given(self.references(&asked::<References>(parameters)?)?),
            Completion::METHOD => {
                let asked = asked::<Completion>(parameters)?;
                let (document, byte) = self.place(&asked.text_document_position)?;
                given(complete::at(document, byte))
            }
            SignatureHelpRequest::METHOD => {
                let asked = asked::<SignatureHelpRequest>(parameters)?;
                let (document, byte) = self.place(&asked.text_document_position_params)?;
                given(complete::signature_help(document, byte))
            }
            DocumentSymbolRequest::METHOD => {
                let asked = asked::<DocumentSymbolRequest>(parameters)?;
                given(symbols::of(self.document(&asked.text_document.uri)?))
            }
            CodeActionRequest::METHOD => {
                let asked = asked::<CodeActionRequest>(parameters)?;
                let uri = &asked.text_document.uri;
                given(edits::fixes(uri, self.document(uri)?, asked.range))
            }
            PrepareRenameRequest::METHOD => {
                given(self.renamable(&asked::<PrepareRenameRequest>(parameters)?)?)
            }
            Rename::METHOD => {
                let asked = asked::<Rename>(parameters)?;
                let position = &asked.text_document_position;
                let (document, byte) = self.place(position)?;
                let edits = edits::rename(&position.text_document.uri, document, byte, &asked.new_name);
                given(edits.map_err(|why| Refusal::new(ErrorCode::InvalidParams, why))?)
            }
            ExecuteCommand::METHOD => {
                let asked = asked::<ExecuteCommand>(parameters)?;
                self.command(&asked.command, asked.arguments)
            }
            method => Err(Refusal::new(ErrorCode::MethodNotFound, format!("{method} is not served"))),
        }
    }

    fn hover(&self, asked: &HoverParams) -> Result<Option<Hover>, Refusal> {
        let (document, byte) = self.place(&asked.text_document_position_params)?;
        Ok(hover::at(document, byte).map(|(value, place)| Hover {
            contents: HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value }),
            range: Some(document.range(place)),
        }))
    }

    fn definition(&self, asked: &GotoDefinitionParams) -> Result<Option<Location>, Refusal> {
        let position = &asked.text_document_position_params;
        let (document, byte) = self.place(position)?;
        let found = document.names.at(byte).and_then(|mention| match &mention.meaning {
            Meaning::Defined(place) => Some(place.clone()),
            Meaning::Standard | Meaning::Key(_) => None,
        });
        Ok(found.map(|place| Location::new(position.text_document.uri.clone(), document.range(place))))
    }

    fn references(&self, asked: &ReferenceParams) -> Result<Option<Vec<Location>>, Refusal> {
        let position = &asked.text_document_position;
        let (document, byte) = self.place(position)?;
        let uri = &position.text_document.uri;
        Ok(edits::renamable(document, byte).map(|(_, place)| {
            let wanted = |found: &&names::Mention| asked.context.include_declaration || found.place != *place;
            let uses = document.names.uses(place).filter(wanted);
            uses.map(|found| Location::new(uri.clone(), document.range(found.place.clone()))).collect()
        }))
    }

    fn renamable(
        &self,
        asked: &TextDocumentPositionParams,
    ) -> Result<Option<PrepareRenameResponse>, Refusal> {
        let (document, byte) = self.place(asked)?;
        Ok(edits::renamable(document, byte)
            .map(|(mention, _)| PrepareRenameResponse::Range(document.range(mention.place.clone()))))
    }

    fn command(&self, command: &str, mut arguments: Vec<Value>) -> Result<Value, Refusal> {
        if command != preview::COMMAND || arguments.len() != 1 {
            return Err(Refusal::new(
                ErrorCode::InvalidParams,
                format!("there is no such command: {command}"),
            ));
        }
        let wanted: preview::Wanted = from_json(arguments.remove(0))?;
        let document = self.document(&wanted.uri)?;
        given(preview::slice(document, &wanted).map_err(|why| Refusal::new(ErrorCode::RequestFailed, why))?)
    }

    fn document(&self, uri: &Uri) -> Result<&Document, Refusal> {
        let found = self.documents.get(uri.as_str());
        found.ok_or_else(|| Refusal::new(ErrorCode::InvalidParams, "the file is not open"))
    }

    fn place(&self, at: &TextDocumentPositionParams) -> Result<(&Document, usize), Refusal> {
        let document = self.document(&at.text_document.uri)?;
        let position: Position = at.position;
        Ok((document, document.byte(position)))
    }

    fn notice(&mut self, notification: Notification) -> Result<(), Failure> {
        let parameters = notification.params;
        // what does not fit the protocol cannot be answered, as nobody waits for an answer
        match notification.method.as_str() {
            DidOpenTextDocument::METHOD => {
                type Opened = <DidOpenTextDocument as lsp_types::notification::Notification>::Params;
                let Ok(opened) = serde_json::from_value::<Opened>(parameters) else { return Ok(()) };
                let file = opened.text_document;
                self.read(&file.uri, file.text, Some(file.version))
            }
            DidChangeTextDocument::METHOD => {
                type Changed = <DidChangeTextDocument as lsp_types::notification::Notification>::Params;
                let Ok(changed) = serde_json::from_value::<Changed>(parameters) else { return Ok(()) };
                let file = changed.text_document;
                // the whole text is sent, so the last change is all there is
                match changed.content_changes.into_iter().next_back() {
                    Some(change) => self.read(&file.uri, change.text, Some(file.version)),
                    None => Ok(()),
                }
            }
            DidCloseTextDocument::METHOD => {
                type Closed = <DidCloseTextDocument as lsp_types::notification::Notification>::Params;
                let Ok(closed) = serde_json::from_value::<Closed>(parameters) else { return Ok(()) };
                let uri = closed.text_document.uri;
                self.documents.remove(uri.as_str());
                self.background.forget(&uri);
                let nothing =
                    lsp_types::PublishDiagnosticsParams { uri, diagnostics: Vec::new(), version: None };
                self.publish(nothing)
            }
            _ => Ok(()),
        }
    }

    /// Compiles a new version of a text and sends its messages.
    fn read(&mut self, uri: &Uri, text: String, version: Option<i32>) -> Result<(), Failure> {
        let encoding = self.encoding;
        self.background.forget(uri);
        // a text on which the compiler fails is answered as a file that is not open
        let Ok(document) = catch_unwind(AssertUnwindSafe(|| Document::new(uri, text, encoding))) else {
            self.documents.remove(uri.as_str());
            return Ok(());
        };
        let messages = messages::published(uri, &document, version);
        let text = document.text().to_string();
        self.documents.insert(uri.as_str().to_string(), document);
        self.publish(messages)?;
        self.background.give(uri, text, version);
        Ok(())
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
