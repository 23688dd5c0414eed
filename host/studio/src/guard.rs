//! [`Guard`]: which requests are answered.
//!
//! Every program of the machine, and every page in the user's browser, can send requests to a loopback address. Answered are
//! those that know the token, which only the address printed by the program has; that name this server as their host, so that no
//! foreign name leads here (DNS rebinding); and that come from no page but the studio's own.

use std::fmt::Write;

use crate::http::Request;

/// The header that requests of the page carry their token in. A page of another origin cannot set it without being asked for
/// permission, which is never given.
const HEADER: &str = "X-Odyn-Token";

/// Knows the token and the address.
pub(crate) struct Guard {
    token: String,
    port: u16,
}

/// Why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// It has no token, or another.
    Token,
    /// It comes from a page of another origin.
    Origin,
    /// It was sent to another name.
    Host,
}

impl Refusal {
    /// In words.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Token => {
                "The token is missing or wrong. Open the address that `odyn studio` printed when it was started, with all that stands \
                 behind the question mark."
            }
            Self::Origin => "The studio answers its own page only.",
            Self::Host => "The studio answers at 127.0.0.1 and localhost only.",
        }
    }
}

impl Guard {
    /// A new token for a port.
    pub(crate) fn new(port: u16) -> Result<Self, getrandom::Error> {
        let mut bytes = [0u8; 16];
        getrandom::fill(&mut bytes)?;
        let token = bytes.iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        });
        Ok(Self { token, port })
    }

    /// What is printed for the user.
    pub(crate) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }

    /// Judges a request; `query` is what stands behind the question mark of its address.
    pub(crate) fn judge(&self, request: &Request<'_>, query: &str) -> Result<(), Refusal> {
        let header = |name: &str| request.header(name);
        let own = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        if !header("Host").is_some_and(|host| own.iter().any(|own| own == host)) {
            return Err(Refusal::Host);
        }
        if header("Origin").is_some_and(|origin| !own.iter().any(|own| format!("http://{own}") == origin)) {
            return Err(Refusal::Origin);
        }
        let given = header(HEADER).or_else(|| query.split('&').find_map(|part| part.strip_prefix("token=")));
        if given.is_some_and(|given| same(given, &self.token)) { Ok(()) } else { Err(Refusal::Token) }
    }
}

/// Whether texts are equal, in a time that does not depend on where they differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b)) == 0
}
