//! Models share nothing: runs that take turns, step by step or in threads, give the same bits as runs on their own.

use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use odyn::session::Session;

use crate::support::{Scratch, open};

/// Elements of the same libraries, so that whatever those share would show.
const A: (&str, &[&str]) = ("compressor.toml", &["simulation.t_end=20 ms"]);
const B: (&str, &[&str]) = ("benchmarks/A04.toml", &["simulation.t_end=1 s"]);

type Scene = (&'static str, &'static [&'static str]);

fn ready(scene: Scene) -> Session {
    open(scene.0, scene.1)
}

/// Runs to the end and gives the bytes of the table of results.
fn table(session: Session, folder: &Path, progress: Box<dyn FnMut(f64) + Send + '_>) -> Vec<u8> {
    let report = session.run(Some(folder), progress, &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0);
    std::fs::read(folder.join("results.csv")).unwrap()
}

fn alone(scene: Scene) -> Vec<u8> {
    let scratch = Scratch::new();
    table(ready(scene), scratch.path(), Box::new(|_| ()))
}

/// Runs in a thread of its own, one step for each turn that it is given; gives the turn on after each step.
fn in_turns(scene: Scene, mine: Receiver<()>, other: SyncSender<()>) -> Vec<u8> {
    let scratch = Scratch::new();
    let session = ready(scene);
    let mut turns = 0;
    // An error means that the other one has finished; then nobody is waited for.
    let counted = &mut turns;
    let take_turns = Box::new(move |_| {
        *counted += 1;
        let _ = other.send(());
        let _ = mine.recv();
    });
    let result = table(session, scratch.path(), take_turns);
    assert!(turns > 10, "{turns} steps are no interleaving");
    result
}

#[test]
fn step_by_step() {
    let (a, b) = (alone(A), alone(B));
    let ((to_a, from_b), (to_b, from_a)) = (sync_channel(1), sync_channel(1));
    let (interleaved_a, interleaved_b) = std::thread::scope(|scope| {
        let first = scope.spawn(move || in_turns(A, from_b, to_b));
        let second = scope.spawn(move || in_turns(B, from_a, to_a));
        (first.join().unwrap(), second.join().unwrap())
    });
    assert!(interleaved_a == a && interleaved_b == b, "taking turns changes results");
    assert!(alone(A) == a && alone(B) == b, "earlier runs change later ones");
}

#[test]
fn at_the_same_time() {
    let (a, b) = (alone(A), alone(B));
    let tables: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let threads: Vec<_> = [A, B, A, B].into_iter().map(|scene| scope.spawn(move || alone(scene))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(tables == [a.clone(), b.clone(), a, b], "running at the same time changes results");
}

/// Two models are opened before either runs.
#[test]
fn one_after_the_other() {
    let scratch = Scratch::new();
    let (first, second, again) = (ready(A), ready(B), ready(A));
    let run = |session, name: &str| table(session, &scratch.path().join(name), Box::new(|_| ()));
    let (a, _, a_again) = (run(first, "1"), run(second, "2"), run(again, "3"));
    assert!(a == a_again, "a run in between changes results");
}
