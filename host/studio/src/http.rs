//! [`Request`] and [`Answer`]: as much of HTTP as the studio needs, one request per connection.
//!
//! Whoever is on the machine can connect. What is sent before it is known who asks is read within bounds of size and time, and
//! nothing is made room for because it was announced.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Longest text that is taken, bytes.
pub(crate) const LONGEST: u64 = 16 << 20;
/// Longest head of a request, bytes.
const LONGEST_HEAD: u64 = 64 << 10;
/// Time in which a request has to arrive.
const PATIENCE: Duration = Duration::from_secs(10);
/// Time for the rest of a request that is answered already.
const REST: Duration = Duration::from_secs(2);
/// Time between looks at the flag that ends the studio.
pub(crate) const PAUSE: Duration = Duration::from_millis(200);

/// What arrives on a connection until its time is over, or the studio ends.
struct Arriving<'a> {
    stream: &'a TcpStream,
    until: Instant,
    stop: &'a AtomicBool,
}

impl Read for Arriving<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            if self.stop.load(Ordering::Relaxed) || Instant::now() > self.until {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "the request did not arrive in time"));
            }
            match self.stream.read(buffer) {
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
                other => return other,
            }
        }
    }
}

/// A connection with a request whose head has been read.
pub(crate) struct Request<'a> {
    pub(crate) method: String,
    pub(crate) url: String,
    headers: Vec<(String, String)>,
    length: u64,
    source: BufReader<Arriving<'a>>,
}

/// What is sent back.
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) kind: &'static str,
    pub(crate) body: String,
}

impl<'a> Request<'a> {
    /// Reads the head of a request.
    ///
    /// # Errors
    /// What to answer with; `None` where nobody waits for an answer.
    pub(crate) fn read(stream: &'a TcpStream, stop: &'a AtomicBool) -> Result<Self, Option<Answer>> {
        let set = stream.set_read_timeout(Some(PAUSE)).and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
        set.map_err(|_| None)?;
        let mut source = BufReader::new(Arriving { stream, until: Instant::now() + PATIENCE, stop });
        let mut head = (&mut source).take(LONGEST_HEAD);
        let mut lines = Vec::new();
        loop {
            let mut line = String::new();
            match head.read_line(&mut line) {
                Ok(_) if line.ends_with('\n') => {}
                Ok(0) if lines.is_empty() => return Err(None),
                Ok(_) if head.limit() == 0 => {
                    return Err(Some(Answer::refused(431, "The head of the request is too long.")));
                }
                Err(error) if error.kind() == io::ErrorKind::InvalidData => return Err(Some(no_request())),
                Ok(_) | Err(_) => return Err(None),
            }
            let line = line.trim_end();
            if line.is_empty() {
                break;
            }
            lines.push(line.to_owned());
        }
        let mut words = lines.first().into_iter().flat_map(|line| line.split(' '));
        let (Some(method), Some(url), Some("HTTP/1.0" | "HTTP/1.1"), None) =
            (words.next(), words.next(), words.next(), words.next())
        else {
            return Err(Some(no_request()));
        };
        let header =
            |line: &String| line.split_once(':').map(|(name, value)| (name.to_owned(), value.trim().to_owned()));
        let headers = lines[1..].iter().map(header).collect::<Option<Vec<_>>>().ok_or_else(|| Some(no_request()))?;
        let mut request = Self { method: method.to_owned(), url: url.to_owned(), headers, length: 0, source };
        if request.header("Transfer-Encoding").is_some() {
            return Err(Some(Answer::refused(411, "Requests say how long they are (`Content-Length`).")));
        }
        let length = request.header("Content-Length").map_or(Ok(0), str::parse);
        request.length = length.map_err(|_| Some(no_request()))?;
        Ok(request)
    }

    /// The value of a header.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(field, _)| field.eq_ignore_ascii_case(name)).map(|(_, value)| value.as_str())
    }

    /// The text that it carries.
    pub(crate) fn text(&mut self) -> Result<String, Answer> {
        if self.length > LONGEST {
            return Err(Answer::refused(413, format!("texts may have {} MB at most", LONGEST >> 20)));
        }
        let mut bytes = Vec::new();
        let read = (&mut self.source).take(self.length).read_to_end(&mut bytes);
        read.map_err(|error| Answer::refused(400, error.to_string()))?;
        if (bytes.len() as u64) < self.length {
            return Err(Answer::refused(400, "the text is shorter than announced"));
        }
        String::from_utf8(bytes).map_err(|_| Answer::refused(400, "the text is not UTF-8"))
    }
}

impl Answer {
    pub(crate) fn refused(status: u16, words: impl Into<String>) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", body: words.into() }
    }

    /// Sends it and ends the connection. A browser that has gone needs no answer.
    pub(crate) fn send(&self, mut stream: &TcpStream, stop: &AtomicBool) {
        let head = format!(
            "HTTP/1.1 {} \r\nConnection: close\r\nContent-Length: {}\r\nContent-Type: {}\r\n\
             Content-Security-Policy: frame-ancestors 'none'\r\nCross-Origin-Resource-Policy: same-origin\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\n\r\n",
            self.status,
            self.body.len(),
            self.kind,
        );
        let sent = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(self.body.as_bytes()));
        if sent.and_then(|()| stream.shutdown(Shutdown::Write)).is_ok() {
            // What is on its way is taken first: a connection that ends with something unread takes the answer along.
            let rest = Arriving { stream, until: Instant::now() + REST, stop };
            let _ = io::copy(&mut rest.take(LONGEST), &mut io::sink());
        }
    }
}

fn no_request() -> Answer {
    Answer::refused(400, "This is no request that the studio knows.")
}
