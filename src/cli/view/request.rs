//! Requests of browsers: the part of HTTP that the viewer needs, and the check of who may ask.
//!
//! Invariant: what is read is limited in length and time, and nothing in it is trusted.

use std::io::{self, Read, Write};
use std::net::{IpAddr, Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// The longest head of a request, bytes.
const LONGEST_HEAD: usize = 16 << 10;

/// The longest time for a head to arrive.
const PATIENCE: Duration = Duration::from_secs(5);

/// The longest wait for more of a request that is refused, and the most parts of it that are read.
const FAREWELL: Duration = Duration::from_millis(200);
const MOST_PARTS: usize = 32;

/// A request: a path, and those of its headers that the viewer needs.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request {
    /// The path, without what follows a `?`.
    pub path: String,
    /// The header `Host`.
    pub host: String,
    /// The header `Origin`.
    pub origin: Option<String>,
    /// The key of a request for a WebSocket; `None` if it is for a document.
    pub socket_key: Option<String>,
    /// What has arrived behind the head.
    pub rest: Vec<u8>,
}

/// An answer that is not what was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Refusal {
    pub status: &'static str,
    pub reason: &'static str,
}

impl Refusal {
    pub const MALFORMED: Self =
        Self { status: "400 Bad Request", reason: "this is not a request of HTTP/1.1" };
    pub const HOST: Self = Self {
        status: "403 Forbidden",
        reason: "this server is not known by that name: open the address that `rfm view` printed",
    };
    pub const ORIGIN: Self =
        Self { status: "403 Forbidden", reason: "another page may not connect to this server" };
    pub const TOKEN: Self = Self {
        status: "403 Forbidden",
        reason: "this address lacks the token: open the address that `rfm view` printed",
    };
    pub const NOTHING: Self = Self { status: "404 Not Found", reason: "there is nothing at this address" };
    pub const METHOD: Self = Self { status: "405 Method Not Allowed", reason: "only GET is answered" };
    pub const LATE: Self =
        Self { status: "408 Request Timeout", reason: "the request did not arrive in time" };
    pub const LONG: Self =
        Self { status: "431 Request Header Fields Too Large", reason: "the request is too long" };
    pub const CROWDED: Self =
        Self { status: "503 Service Unavailable", reason: "too many pages are connected" };
}

/// Reads the head of a request.
pub(super) fn read(stream: &mut TcpStream) -> Result<Request, Refusal> {
    let deadline = Instant::now() + PATIENCE;
    let mut bytes = Vec::new();
    let end = loop {
        if let Some(end) = bytes.windows(4).position(|window| window == b"\r\n\r\n") {
            break end;
        }
        if bytes.len() >= LONGEST_HEAD {
            return Err(Refusal::LONG);
        }
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() || stream.set_read_timeout(Some(left)).is_err() {
            return Err(Refusal::LATE);
        }
        let mut part = [0; 2048];
        match stream.read(&mut part) {
            Ok(0) => return Err(Refusal::MALFORMED),
            Ok(count) => bytes.extend(&part[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => return Err(Refusal::LATE),
        }
    };
    let rest = bytes.split_off(end + 4);
    parsed(&bytes[..end], rest)
}

fn parsed(head: &[u8], rest: Vec<u8>) -> Result<Request, Refusal> {
    let head = std::str::from_utf8(head).map_err(|_| Refusal::MALFORMED)?;
    let mut lines = head.split("\r\n");
    let words: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, target, "HTTP/1.1"] = words[..] else { return Err(Refusal::MALFORMED) };
    if method != "GET" {
        return Err(Refusal::METHOD);
    }
    let (mut host, mut origin, mut key, mut upgrade) = (None, None, None, false);
    for line in lines {
        let (name, value) = line.split_once(':').ok_or(Refusal::MALFORMED)?;
        let value = value.trim().to_string();
        let place = match name.to_ascii_lowercase().as_str() {
            "host" => &mut host,
            "origin" => &mut origin,
            "sec-websocket-key" => &mut key,
            "upgrade" => {
                upgrade = value.eq_ignore_ascii_case("websocket");
                continue;
            }
            _ => continue,
        };
        // two of them would leave open which one counts
        if place.replace(value).is_some() {
            return Err(Refusal::MALFORMED);
        }
    }
    let path = target.split(['?', '#']).next().unwrap_or_default().to_string();
    let socket_key = key.filter(|_| upgrade);
    Ok(Request { path, host: host.ok_or(Refusal::MALFORMED)?, origin, socket_key, rest })
}

impl Request {
    /// Checks who asks: a name that is not ours belongs to a page that has pointed it at this machine, and an origin
    /// that is not ours to a page of someone else.
    pub fn admitted(&self, own_name: &str) -> Result<(), Refusal> {
        let name = match self.host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
            _ => self.host.as_str(),
        };
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        let is_ours = bare.eq_ignore_ascii_case("localhost")
            || bare.eq_ignore_ascii_case(own_name)
            || bare.parse::<IpAddr>().is_ok();
        if !is_ours {
            return Err(Refusal::HOST);
        }
        match &self.origin {
            Some(origin) if *origin != format!("http://{}", self.host) => Err(Refusal::ORIGIN),
            // every browser names the origin of a page that opens a socket
            None if self.socket_key.is_some() => Err(Refusal::ORIGIN),
            Some(_) | None => Ok(()),
        }
    }
}

/// Answers with a document.
pub(super) fn answer(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8]) -> io::Result<()> {
    let length = body.len();
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {length}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: SAMEORIGIN\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\r\n"
    )?;
    stream.write_all(body)?;
    stream.flush()
}

/// Answers that a request is refused, and reads what still arrives of it: a connection that is closed before loses the
/// answer.
pub(super) fn refuse(stream: &mut TcpStream, refusal: Refusal) -> io::Result<()> {
    answer(stream, refusal.status, "text/plain", format!("{}\n", refusal.reason).as_bytes())?;
    stream.shutdown(Shutdown::Write)?;
    stream.set_read_timeout(Some(FAREWELL))?;
    let mut part = [0; 4096];
    for _ in 0..MOST_PARTS {
        if stream.read(&mut part)? == 0 {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(text: &str) -> Result<Request, Refusal> {
        parsed(text.as_bytes(), Vec::new())
    }

    #[test]
    fn heads_are_read_or_refused() {
        let found =
            request("GET /a/?b HTTP/1.1\r\nHost: localhost:80\r\nX: y\r\norigin: http://localhost:80")
                .unwrap();
        assert_eq!((found.path.as_str(), found.host.as_str()), ("/a/", "localhost:80"));
        assert_eq!((found.origin.as_deref(), found.socket_key), (Some("http://localhost:80"), None));
        for (text, refusal) in [
            ("", Refusal::MALFORMED),
            ("GET / HTTP/1.0\r\nHost: a", Refusal::MALFORMED),
            ("GET / HTTP/1.1", Refusal::MALFORMED),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b", Refusal::MALFORMED),
            ("GET / HTTP/1.1\r\nnonsense", Refusal::MALFORMED),
            ("POST / HTTP/1.1\r\nHost: a", Refusal::METHOD),
        ] {
            assert_eq!(request(text), Err(refusal), "{text}");
        }
    }

    #[test]
    fn only_our_own_names_and_pages_are_admitted() {
        let asked = |host: &str, origin: Option<&str>, socket: bool| {
            let request = Request {
                path: "/".into(),
                host: host.into(),
                origin: origin.map(String::from),
                socket_key: socket.then(String::new),
                rest: Vec::new(),
            };
            request.admitted("box.example")
        };
        for host in
            ["127.0.0.1:8000", "localhost", "LOCALHOST:1", "[::1]:80", "192.168.0.7:80", "box.example:9"]
        {
            assert_eq!(asked(host, None, false), Ok(()), "{host}");
            assert_eq!(asked(host, Some(&format!("http://{host}")), true), Ok(()), "{host}");
        }
        for host in ["evil.example:8000", "127.0.0.1.evil.example", "", ":80", "localhost.evil.example"] {
            assert_eq!(asked(host, None, false), Err(Refusal::HOST), "{host}");
        }
        for origin in ["http://evil.example", "null", "http://localhost:81", "https://localhost:80"] {
            assert_eq!(asked("localhost:80", Some(origin), true), Err(Refusal::ORIGIN), "{origin}");
        }
        assert_eq!(asked("localhost:80", None, true), Err(Refusal::ORIGIN));
    }
}
