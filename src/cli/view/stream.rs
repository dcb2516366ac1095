//! The stream of a simulation to one page: what is new goes out, commands come in.
//!
//! A thread reads and another one writes. The page says when it has taken a frame, and is sent the next one only then,
//! so that a slow browser sees fewer frames and not older ones.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::thread;

use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

use super::board::{Board, Sent, Topic};
use super::command::Command;

/// The longest message of a page, bytes.
const LONGEST_MESSAGE: usize = 16 << 10;

/// The most meshes and frames on their way to a page.
const MOST_ON_THE_WAY: u64 = 2;

/// The half of a connection that reads. What the protocol would answer by itself is left out, because the other half
/// writes at the same time: browsers send no pings.
struct Reader(TcpStream);

impl Read for Reader {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for Reader {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What both threads of a page know.
#[derive(Default)]
struct Page {
    /// Meshes and frames that the page has taken.
    seen: AtomicU64,
    closed: AtomicBool,
}

/// Follows a simulation until the page goes away.
pub(super) fn follow(
    mut stream: TcpStream,
    rest: Vec<u8>,
    key: &str,
    board: &Arc<Board>,
    commands: Sender<Command>,
) {
    let accept = derive_accept_key(key.as_bytes());
    let answer = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    let begun = stream.write_all(answer.as_bytes()).and_then(|()| stream.set_read_timeout(None));
    let (Ok(()), Ok(reader)) = (begun, stream.try_clone()) else { return };
    let _open = board.open_page();
    let page = Arc::new(Page::default());
    let (of_reader, on_board) = (Arc::clone(&page), Arc::clone(board));
    let reading = thread::Builder::new().name("rfm-commands".into()).spawn(move || {
        read(reader, rest, &commands, &of_reader, &on_board);
        of_reader.closed.store(true, Ordering::Relaxed);
        on_board.wake();
    });
    if let Ok(reading) = reading {
        let _ = write(&stream, &page, board);
        // the reader wakes up and ends
        let _ = stream.shutdown(Shutdown::Both);
        let _ = reading.join();
    }
}

/// Passes commands on until the page goes away or sends what is none.
fn read(stream: TcpStream, rest: Vec<u8>, commands: &Sender<Command>, page: &Page, board: &Board) {
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST_MESSAGE))
        .max_frame_size(Some(LONGEST_MESSAGE));
    let mut socket = WebSocket::from_partially_read(Reader(stream), rest, Role::Server, Some(config));
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => match serde_json::from_str(text.as_str()) {
                Ok(Command::Seen) => {
                    page.seen.fetch_add(1, Ordering::Relaxed);
                    board.wake();
                }
                Ok(command) => {
                    if commands.send(command).is_err() {
                        return;
                    }
                }
                Err(_) => return,
            },
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Ok(Message::Binary(_) | Message::Close(_) | Message::Frame(_)) | Err(_) => return,
        }
    }
}

/// Sends what is new until the page goes away.
fn write(stream: &TcpStream, page: &Page, board: &Board) -> Result<(), tungstenite::Error> {
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, None);
    let mut sent = Sent::default();
    let mut answered = 0;
    while !page.closed.load(Ordering::Relaxed) {
        let has_room = || answered < page.seen.load(Ordering::Relaxed).saturating_add(MOST_ON_THE_WAY);
        let may_follow = |topic: Topic| !topic.is_answered() || has_room();
        if let Some((topic, message)) = board.next(&mut sent, may_follow) {
            answered += u64::from(topic.is_answered());
            socket.send(message)?;
        }
    }
    socket.close(None)?;
    socket.flush()
}
