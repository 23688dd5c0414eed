//! The way to the controller.

use std::net::{SocketAddr, UdpSocket};

use super::packet::{Description, Packet};
use super::shared::Shared;

/// See the module documentation.
pub(super) enum Link {
    /// Packets as they are. Outputs go to whoever sent the last packet.
    Udp { socket: UdpSocket, peer: Option<SocketAddr>, place: String },
    /// An area for each direction.
    Shared(Shared),
}

impl Link {
    /// Opens it.
    ///
    /// # Errors
    /// A port or a name that cannot be had: what is wrong, and what to do.
    pub(super) fn open(
        udp: Option<&str>,
        shm: Option<&str>,
        description: &Description,
    ) -> Result<Self, (String, &'static str)> {
        if let Some(name) = shm {
            let shared = Shared::create(name, description.inputs.len(), description.outputs.len());
            return shared.map(Self::Shared).map_err(|error| {
                (
                    format!("shared memory `{name}` cannot be had: {error}"),
                    "choose another name, or end the program that has it",
                )
            });
        }
        let udp = udp.unwrap_or("0");
        let address = if udp.contains(':') { udp.to_string() } else { format!("127.0.0.1:{udp}") };
        let open = || {
            let socket = UdpSocket::bind(&address)?;
            socket.set_nonblocking(true)?;
            let place = format!("udp {}", socket.local_addr()?);
            Ok::<_, std::io::Error>((socket, place))
        };
        let (socket, place) = open().map_err(|error| {
            (format!("the port {address} cannot be had: {error}"), "choose another one; 0 takes one that is free")
        })?;
        Ok(Self::Udp { socket, peer: None, place })
    }

    /// Where it is, in words.
    pub(super) fn place(&self) -> String {
        match self {
            Self::Udp { place, .. } => place.clone(),
            Self::Shared(shared) => format!("shared memory {}", shared.name()),
        }
    }

    /// The next packet that has come, if any; never waits.
    pub(super) fn receive(&mut self, packet: &mut Packet) -> bool {
        match self {
            Self::Udp { socket, peer, .. } => match socket.recv_from(&mut packet.bytes) {
                Ok((length, from)) => {
                    (packet.length, *peer) = (length, Some(from));
                    true
                }
                // Also where the peer has gone: the next one may come.
                Err(_) => false,
            },
            Self::Shared(shared) => shared.receive(packet),
        }
    }

    /// Sends a packet, if there is anybody to send it to; never waits.
    pub(super) fn send(&mut self, packet: &Packet) -> bool {
        match self {
            Self::Udp { socket, peer, .. } => {
                peer.is_some_and(|peer| socket.send_to(&packet.bytes[..packet.length], peer).is_ok())
            }
            Self::Shared(shared) => {
                shared.send(packet);
                true
            }
        }
    }
}
