use super::packet::{HEAD, INPUTS, OUTPUTS, Packet};
use super::shared::Shared;
use super::statistics::Times;

#[test]
fn packets_are_what_they_are_filled_with() {
    let mut packet = Packet::new(3);
    packet.fill(OUTPUTS, 0x1234, 7, 0.25, &[1.0, -2.5, f64::MIN_POSITIVE]);
    assert_eq!(packet.length, HEAD + 24);
    assert_eq!(&packet.bytes[..8], b"ODYN\x01\0\x02\0");
    assert!(packet.is_for(OUTPUTS, 0x1234, 3));
    assert_eq!((packet.sequence(), packet.time()), (7, 0.25));
    assert_eq!(packet.values(3), [1.0, -2.5, f64::MIN_POSITIVE]);
    // Another kind, signature, number of values, version, length.
    assert!(!packet.is_for(INPUTS, 0x1234, 3) && !packet.is_for(OUTPUTS, 1, 3) && !packet.is_for(OUTPUTS, 0x1234, 2));
    packet.bytes[4] = 2;
    assert!(!packet.is_for(OUTPUTS, 0x1234, 3));
    packet.fill(INPUTS, 0, 1, 0.0, &[1.0]);
    assert!(packet.is_for(INPUTS, 0x1234, 1), "inputs without a signature are not compared");
    packet.length -= 1;
    assert!(!packet.is_for(INPUTS, 0x1234, 1));
}

#[test]
fn percentiles_are_those_of_the_times() {
    let mut times = Times::new();
    for k in 0..1000 {
        times.add(f64::from(k) * 1e-6 + 0.5e-6);
    }
    times.add(0.5);
    assert!((times.percentile(0.5) - 501.0).abs() <= 1.0, "{}", times.percentile(0.5));
    assert!((times.percentile(0.99) - 991.0).abs() <= 1.0);
    assert!((times.worst() - 5e5).abs() < 1e-6 && (times.percentile(1.0) - 5e5).abs() < 1e-6);
}

#[cfg(unix)]
#[test]
fn shared_memory_carries_packets_once() {
    use std::os::unix::fs::FileExt as _;
    let name = format!("odyn-test-{}", std::process::id());
    let mut shared = Shared::create(&name, 2, 3).unwrap();
    assert!(Shared::create(&name, 2, 3).is_err(), "it is there already");
    let path = std::path::Path::new("/dev/shm").join(&name);
    let file = std::fs::File::options().read(true).write(true).open(&path).unwrap();
    let word = |at: u64| {
        let mut bytes = [0; 4];
        file.read_exact_at(&mut bytes, at).unwrap();
        u64::from(u32::from_le_bytes(bytes))
    };
    let (inputs, outputs) = (word(8), word(12));
    let mut packet = Packet::new(3);
    assert!(!shared.receive(&mut packet));
    let mut sent = Packet::new(3);
    sent.fill(INPUTS, 0, 1, 0.0, &[4.0, 5.0]);
    // While it is written the counter is odd.
    file.write_all_at(&1_u64.to_le_bytes(), inputs).unwrap();
    file.write_all_at(&sent.bytes[..sent.length], inputs + 8).unwrap();
    assert!(!shared.receive(&mut packet));
    file.write_all_at(&2_u64.to_le_bytes(), inputs).unwrap();
    assert!(shared.receive(&mut packet) && packet.is_for(INPUTS, 9, 2));
    assert_eq!(packet.values(2), [4.0, 5.0]);
    assert!(!shared.receive(&mut packet), "not twice");
    packet.fill(OUTPUTS, 9, 1, 0.5, &[1.0, 2.0, 3.0]);
    shared.send(&packet);
    let mut found = vec![0; 8 + packet.length];
    file.read_exact_at(&mut found, outputs).unwrap();
    assert_eq!(found[..8], 2_u64.to_le_bytes());
    assert_eq!(found[8..], packet.bytes[..packet.length]);
    drop(shared);
    assert!(!path.exists());
}
