//! Messages from an editor on standard input, and to it on standard output.
//!
//! Unlike the pipes of the library, these continue after a message whose text makes no sense: its length was
//! right, so the next one is found. It is answered as JSON-RPC says, without a number, because none could be
//! read.

use std::io::{self, BufRead, Read, Write};
use std::thread::{self, JoinHandle};

use lsp_server::{Connection, Message};

/// How the library's error begins if only the text of a message makes no sense.
const SENSELESS: &str = "malformed LSP payload";

/// The code of JSON-RPC for a text that cannot be read.
const PARSE_ERROR: i32 = -32700;

/// The longest message, in bytes: more than the longest file takes as a text of JSON.
const LONGEST: u64 = 1 << 30;

/// The most bytes of the lines before a message.
const LONGEST_HEAD: u64 = 1 << 16;

/// The threads that read and write.
pub(super) struct Pipes {
    reader: JoinHandle<io::Result<()>>,
    writer: JoinHandle<io::Result<()>>,
}

impl Pipes {
    /// Opens both, and the end of them that the server holds.
    ///
    /// # Errors
    /// If there is no thread to be had.
    pub fn open() -> io::Result<(Connection, Self)> {
        let (server, Connection { sender, receiver }) = Connection::memory();
        let writer = thread::Builder::new().name("rfm-lsp-writer".into()).spawn(move || {
            // the lock is held for one message only: the reader refuses what it cannot read
            receiver.into_iter().try_for_each(|message| message.write(&mut io::stdout().lock()))
        })?;
        let reader = thread::Builder::new().name("rfm-lsp-reader".into()).spawn(move || {
            let mut input = io::stdin().lock();
            loop {
                let head = head(&mut input)?;
                match Message::read(&mut head.as_slice().chain(&mut input)) {
                    Ok(Some(message)) => {
                        let is_last = matches!(&message, Message::Notification(n) if n.method == "exit");
                        if sender.send(message).is_err() || is_last {
                            return Ok(());
                        }
                    }
                    Ok(None) => return Ok(()),
                    Err(error) if error.to_string().starts_with(SENSELESS) => refuse(&error)?,
                    Err(error) => return Err(error),
                }
            }
        })?;
        Ok((server, Self { reader, writer }))
    }

    /// Waits for the ends of both. The connection must have been dropped.
    ///
    /// # Errors
    /// Those of reading and of writing.
    pub fn close(self) -> io::Result<()> {
        for pipe in [self.reader, self.writer] {
            pipe.join().map_err(|_| io::Error::other("a thread of the server has ended"))??;
        }
        Ok(())
    }
}

/// The lines before a message, up to the empty one. The library makes room for as much as they announce, so what no
/// editor sends is refused here.
fn head(input: &mut impl BufRead) -> io::Result<Vec<u8>> {
    let refused = |what: String| io::Error::new(io::ErrorKind::InvalidData, what);
    let mut head = Vec::new();
    loop {
        let before = head.len();
        let left = LONGEST_HEAD.saturating_sub(before as u64);
        input.by_ref().take(left).read_until(b'\n', &mut head)?;
        let line = String::from_utf8_lossy(&head[before..]);
        if line.trim().is_empty() {
            return Ok(head);
        }
        if !line.ends_with('\n') && left == line.len() as u64 {
            return Err(refused(format!("more than {LONGEST_HEAD} bytes stand before a message")));
        }
        let length =
            line.split_once(':').filter(|(name, _)| name.trim().eq_ignore_ascii_case("content-length"));
        let length = length.and_then(|(_, length)| length.trim().parse::<u64>().ok());
        if let Some(length) = length.filter(|length| *length > LONGEST) {
            return Err(refused(format!(
                "a message of {length} bytes is announced: at most {LONGEST} are read"
            )));
        }
    }
}

/// Answers a message that cannot be read.
fn refuse(error: &io::Error) -> io::Result<()> {
    let answer = serde_json::json!({
        "jsonrpc": "2.0",
        "id": null,
        "error": { "code": PARSE_ERROR, "message": error.to_string() },
    });
    let text = answer.to_string();
    let mut out = io::stdout().lock();
    write!(out, "Content-Length: {}\r\n\r\n{text}", text.len())?;
    out.flush()
}
