//! The server: one address with a token, a page there, and the stream of a simulation beside it.

use std::collections::VecDeque;
use std::net::{
    IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs, UdpSocket,
};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::super::failure::{Failure, complain};
use super::board::Board;
use super::command::Command;
use super::request::{self, Refusal};
use super::stream;
use rfm::view::document;

/// The most connections at one time.
const MOST_CONNECTIONS: usize = 32;

/// The longest time for a browser to take what it is sent.
const SEND_PATIENCE: Duration = Duration::from_secs(20);

/// What is served.
pub(super) enum Content {
    /// A page with all that it shows.
    Page(Vec<u8>),
    /// A page that follows a simulation.
    Live { board: Arc<Board>, commands: Sender<Command> },
}

/// A server that has its address.
pub(super) struct Server {
    listener: TcpListener,
    at: SocketAddr,
    host: String,
    token: String,
}

impl Server {
    /// Takes a port; 0 is any free one.
    pub fn bind(host: &str, port: u16) -> Result<Self, Failure> {
        let failed = |error: &dyn std::fmt::Display| {
            let port = if port == 0 { String::new() } else { format!(" and --port {port}") };
            Failure::usage(format!("cannot serve at --host {host}{port}: {error}"))
        };
        let places: Vec<SocketAddr> = (host, port).to_socket_addrs().map_err(|e| failed(&e))?.collect();
        let listener = TcpListener::bind(&places[..]).map_err(|e| failed(&e))?;
        let at = listener.local_addr().map_err(|e| failed(&e))?;
        let mut random = [0; 16];
        getrandom::fill(&mut random).map_err(|e| failed(&e))?;
        let token = random.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { listener, at, host: host.to_string(), token })
    }

    /// The address to open on this machine, with its token.
    pub fn address(&self) -> String {
        let host = match self.at.ip() {
            ip if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
            ip => ip,
        };
        self.at_host(&SocketAddr::new(host, self.at.port()).to_string())
    }

    /// The address to tell: one that other machines can open, if they may.
    pub fn told_address(&self) -> String {
        let ip = self.at.ip();
        if !ip.is_unspecified() {
            return self.address();
        }
        match own_ip(ip.is_ipv6()) {
            Some(own) => self.at_host(&SocketAddr::new(own, self.at.port()).to_string()),
            None => self.at_host(&format!("<this machine>:{}", self.at.port())),
        }
    }

    fn at_host(&self, host: &str) -> String {
        format!("http://{host}/{}/", self.token)
    }

    /// Whether other machines may connect.
    pub fn is_open_to_others(&self) -> bool {
        !self.at.ip().is_loopback()
    }

    /// Serves until the process ends.
    pub fn serve(self, content: Content) -> Result<(), Failure> {
        let server = Arc::new(self);
        let content = Arc::new(content);
        let open = Arc::new(AtomicUsize::new(0));
        let idle = Arc::new(Idle::default());
        let mut number = 0;
        loop {
            number += 1;
            let mut stream = match server.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) => {
                    // a connection that broke at once is no failure of the server; a lack of descriptors passes
                    complain(&format!("a connection failed: {error}"));
                    thread::sleep(Duration::from_millis(100));
                    continue;
                }
            };
            let place = Place::taken(&open);
            let is_refused = place.is_beyond_the_last() && !idle.close_oldest();
            if !is_refused {
                idle.add(number, &stream);
            }
            let (server, content, of_page) = (Arc::clone(&server), Arc::clone(&content), Arc::clone(&idle));
            let spawned = thread::Builder::new().name("rfm-page".into()).spawn(move || {
                // counted until the thread ends
                let _place = place;
                if is_refused {
                    // a refused client may be gone already
                    let _ = request::refuse(&mut stream, Refusal::CROWDED);
                    return;
                }
                server.attend(stream, &content, || of_page.remove(number));
            });
            if let Err(error) = spawned {
                idle.remove(number);
                complain(&format!("a connection failed: {error}"));
            }
        }
    }

    /// Answers one connection. `asked_for` is called when its request is there. Errors of a browser that leaves are
    /// ignored.
    fn attend(&self, mut stream: TcpStream, content: &Content, asked_for: impl FnOnce()) {
        let _ = stream.set_nodelay(true);
        let _ = stream.set_write_timeout(Some(SEND_PATIENCE));
        let asked = request::read(&mut stream);
        asked_for();
        let allowed = asked.and_then(|request| {
            request.admitted(&self.host)?;
            let part = self.part(&request.path)?.to_string();
            Ok((request, part))
        });
        let (request, part) = match allowed {
            Ok(allowed) => allowed,
            Err(refusal) => {
                let _ = request::refuse(&mut stream, refusal);
                return;
            }
        };
        match (part.as_str(), request.socket_key, content) {
            ("", None, Content::Page(page)) => {
                let _ = request::answer(&mut stream, "200 OK", "text/html", page);
            }
            ("", None, Content::Live { board, .. }) => {
                let page = board.setting().map(|setting| document(&setting)).transpose();
                let page = page.ok().flatten().unwrap_or_default();
                let _ = request::answer(&mut stream, "200 OK", "text/html", &page);
            }
            ("stream", Some(key), Content::Live { board, commands }) => {
                stream::follow(stream, request.rest, &key, board, commands.clone());
            }
            _ => {
                let _ = request::refuse(&mut stream, Refusal::NOTHING);
            }
        }
    }

    /// What follows the token in a path.
    fn part<'a>(&self, path: &'a str) -> Result<&'a str, Refusal> {
        let (token, part) =
            path.strip_prefix('/').and_then(|path| path.split_once('/')).ok_or(Refusal::TOKEN)?;
        // the time of the comparison does not reveal how many characters were right
        let differences = token.bytes().zip(self.token.bytes()).filter(|(a, b)| a != b).count();
        if token.len() == self.token.len() && differences == 0 { Ok(part) } else { Err(Refusal::TOKEN) }
    }
}

/// The address of this machine towards others; `None` if it has no way to any. Nothing is sent.
fn own_ip(is_v6: bool) -> Option<IpAddr> {
    // addresses that are reserved for documents
    let towards = |own: IpAddr, other: &str| {
        let socket = UdpSocket::bind(SocketAddr::new(own, 0)).ok()?;
        socket.connect(other).ok()?;
        let found = socket.local_addr().ok()?.ip();
        (!found.is_unspecified() && !found.is_loopback()).then_some(found)
    };
    // who listens on all addresses of the sixth version listens on those of the fourth as well
    let v4 = towards(Ipv4Addr::UNSPECIFIED.into(), "192.0.2.1:9");
    v4.or_else(|| if is_v6 { towards(Ipv6Addr::UNSPECIFIED.into(), "[2001:db8::1]:9") } else { None })
}

/// Connections whose requests have not arrived yet, the oldest first: they give way to new ones.
#[derive(Default)]
struct Idle {
    waiting: Mutex<VecDeque<(u64, TcpStream)>>,
}

impl Idle {
    fn add(&self, number: u64, stream: &TcpStream) {
        if let Ok(stream) = stream.try_clone() {
            self.lock().push_back((number, stream));
        }
    }

    fn remove(&self, number: u64) {
        self.lock().retain(|(other, _)| *other != number);
    }

    /// Closes the oldest one; false if there is none.
    fn close_oldest(&self) -> bool {
        let Some((_, stream)) = self.lock().pop_front() else { return false };
        // its thread wakes up and ends; it may be gone already
        let _ = stream.shutdown(Shutdown::Both);
        true
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, VecDeque<(u64, TcpStream)>> {
        // a list is left whole by whatever panics beside it
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A connection that is counted as long as it lasts.
struct Place {
    open: Arc<AtomicUsize>,
    number: usize,
}

impl Place {
    fn taken(open: &Arc<AtomicUsize>) -> Self {
        let number = open.fetch_add(1, Ordering::Relaxed) + 1;
        Self { open: Arc::clone(open), number }
    }

    fn is_beyond_the_last(&self) -> bool {
        self.number > MOST_CONNECTIONS
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.open.fetch_sub(1, Ordering::Relaxed);
    }
}
