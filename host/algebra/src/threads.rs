//! Short work on several threads: a correction is made of many pieces of work of a millisecond or less, with lines
//! between them that one thread does alone.
//!
//! The threads of `rayon` sleep as soon as there is nothing to do, and it takes 50 to 100 µs until one that
//! sleeps is at work. Here one of them stays awake for a while after such work ([`stay_awake`]), and who is done
//! first waits awake, as long, for the others. The distribution of work depends on chance, so
//! results are returned in the order of the items.

use rayon::Yield;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// How long a thread that has nothing to do waits awake.
const PATIENCE: Duration = Duration::from_micros(100);

/// A thread is awake, or about to be woken, for whatever comes.
static IS_AWAKE: AtomicBool = AtomicBool::new(false);

/// Does something with every item, on several threads if there are some.
pub fn each<T: Send>(items: impl IntoIterator<Item = T>, act: impl Fn(T) + Sync) {
    if rayon::current_num_threads() < 2 {
        items.into_iter().for_each(act);
    } else {
        shared(items, act);
    }
}

/// Results of every item, in the order of the items, computed on several threads if available.
pub fn map<T: Send, R: Send>(
    items: impl IntoIterator<Item = T>,
    act: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    if rayon::current_num_threads() < 2 {
        items.into_iter().map(act).collect()
    } else {
        shared(items, act)
    }
}

/// Lets one more thread wait for work that is about to be shared, and for what follows soon.
pub fn stay_awake() {
    if rayon::current_num_threads() < 2 || IS_AWAKE.swap(true, Ordering::AcqRel) {
        return;
    }
    let here = thread::current().id();
    rayon::spawn(move || {
        // Who has work to share does not wait for it.
        if thread::current().id() != here {
            wait_for_work();
        }
        IS_AWAKE.store(false, Ordering::Release);
    });
}

fn wait_for_work() {
    let mut since = Instant::now();
    while since.elapsed() < PATIENCE {
        if rayon::yield_now() == Some(Yield::Executed) {
            since = Instant::now();
        } else {
            thread::yield_now();
        }
    }
}

/// An item, then what has become of it.
enum Place<T, R> {
    Item(T),
    Result(R),
    /// Someone works on it.
    Taken,
}

impl<T, R> Place<T, R> {
    fn take(place: &Mutex<Self>) -> Self {
        Self::put(place, Self::Taken)
    }

    fn put(place: &Mutex<Self>, new: Self) -> Self {
        let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut *place, new)
    }
}

fn shared<T: Send, R: Send>(
    items: impl IntoIterator<Item = T>,
    act: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let items = items.into_iter();
    let places: Vec<_> = items.map(|item| Mutex::new(Place::Item(item))).collect();
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || {
        while let Some(place) = places.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Place::Item(item) = Place::take(place) {
                Place::put(place, Place::Result(act(item)));
            }
            done.fetch_add(1, Ordering::Release);
        }
    };
    if places.len() < 2 {
        work();
    } else {
        stay_awake();
        rayon::in_place_scope(|scope| {
            for _ in 1..rayon::current_num_threads().min(places.len()) {
                scope.spawn(|_| work());
            }
            work();
            // Longer than this takes who has been held up, or panicked; the scope waits for them, asleep.
            let since = Instant::now();
            while done.load(Ordering::Acquire) < places.len() && since.elapsed() < PATIENCE {
                thread::yield_now();
            }
        });
    }
    let of_place = |place: Mutex<Place<T, R>>| match place
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner)
    {
        Place::Result(result) => Some(result),
        Place::Item(_) | Place::Taken => None,
    };
    places.into_iter().filter_map(of_place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::{ThreadPool, ThreadPoolBuilder};

    fn pool(threads: usize) -> ThreadPool {
        let pool = ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap()
    }

    #[test]
    fn results_are_in_the_order_of_the_items() {
        for threads in 1..4 {
            for n in [0, 1, 2, 1_000] {
                let squares = pool(threads).install(|| map(0..n, |i| i * i));
                assert_eq!(squares, (0..n).map(|i| i * i).collect::<Vec<usize>>());
            }
        }
    }

    #[test]
    fn work_inside_of_work_comes_to_an_end() {
        for threads in 1..4 {
            let sums = pool(threads).install(|| {
                map(0..20_u64, |i| {
                    map(0..50, |j| i * j).into_iter().sum::<u64>()
                })
            });
            assert_eq!(sums, (0..20).map(|i| 1_225 * i).collect::<Vec<u64>>());
        }
    }

    #[test]
    fn several_threads_work_at_the_same_time() {
        // Each waits until the other has begun.
        let begun = AtomicUsize::new(0);
        pool(2).install(|| {
            each(0..2, |_| {
                begun.fetch_add(1, Ordering::SeqCst);
                while begun.load(Ordering::SeqCst) < 2 {
                    thread::yield_now();
                }
            });
        });
        assert_eq!(begun.into_inner(), 2);
    }

    #[test]
    fn a_panic_is_handed_on() {
        let outcome = std::panic::catch_unwind(|| {
            pool(2).install(|| each(0..100, |i| assert!(i != 57, "57")));
        });
        assert!(outcome.is_err());
    }
}
