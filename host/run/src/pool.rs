//! [`each`]: jobs on several threads.
//!
//! For whole runs, which take milliseconds to hours and share nothing that changes; not for what happens within a step.

use std::num::NonZero;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Calls `work` once for each item, on `threads` threads (0: as many as there are processors), the caller's among them. Items
/// are begun in their order, results are in their order. Where the system gives no more threads, there are fewer, which no
/// result depends on. A job that is to be interrupted looks for that itself.
///
/// # Panics
/// When `work` does, once all threads have ended: those that did not panic finish all other items.
pub fn each<T: Send, R: Send>(items: Vec<T>, threads: usize, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let processors = || thread::available_parallelism().map_or(1, NonZero::get);
    let threads = if threads == 0 { processors() } else { threads }.min(items.len());
    if threads <= 1 {
        return items.into_iter().map(work).collect();
    }
    let queue = Mutex::new(items.into_iter().enumerate());
    // Nothing panics while it has the queue.
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
    let worker = || std::iter::from_fn(next).map(|(number, item)| (number, work(item))).collect::<Vec<_>>();
    let mut done = thread::scope(|scope| {
        let further = |_| thread::Builder::new().spawn_scoped(scope, worker);
        let others: Vec<_> = (1..threads).map_while(|number| further(number).ok()).collect();
        let mut done = worker();
        for other in others {
            done.extend(other.join().unwrap_or_else(|payload| std::panic::resume_unwind(payload)));
        }
        done
    });
    done.sort_unstable_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::each;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Barrier, Mutex};

    #[test]
    fn results_are_in_the_order_of_the_items() {
        for threads in 0..5 {
            let squares: Vec<usize> = each((0..100).collect(), threads, |k| k * k);
            assert_eq!(squares, (0..100).map(|k| k * k).collect::<Vec<_>>(), "{threads} threads");
        }
        assert!(each(Vec::<u8>::new(), 3, |k| k).is_empty());
    }

    #[test]
    fn as_many_work_at_the_same_time_as_asked_for() {
        // Fewer would wait at the barrier for ever.
        let barrier = Barrier::new(3);
        let begun = Mutex::new(Vec::new());
        each(vec![0, 1, 2], 3, |k| {
            begun.lock().expect("nobody panics").push(k);
            barrier.wait();
        });
        assert_eq!(begun.into_inner().expect("nobody panics").len(), 3);
    }

    #[test]
    fn a_panic_comes_to_the_caller_after_the_other_items() {
        let ended = AtomicUsize::new(0);
        let one = |k: usize| {
            assert!(k != 3, "the third");
            ended.fetch_add(1, Ordering::Relaxed)
        };
        let all = std::panic::AssertUnwindSafe(|| each((0..20).collect(), 2, one));
        let payload = std::panic::catch_unwind(all).expect_err("the third panics");
        assert_eq!(payload.downcast_ref::<&str>(), Some(&"the third"));
        assert_eq!(ended.into_inner(), 19);
    }
}
