//! Independent work on several threads.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// The results of `work` for 0, 1, … up to `n`, in this order for any number of threads. The first error ends the rest.
/// After every finished part `progress` gets the number of finished parts and of all parts.
pub(crate) fn map<T: Send, E: Send>(
    n: usize,
    threads: usize,
    work: impl Fn(usize) -> Result<T, E> + Sync,
    mut progress: impl FnMut(usize, usize),
) -> Result<Vec<T>, E> {
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    let mut done: Vec<Option<Result<T, E>>> = (0..n).map(|_| None).collect();
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            scope.spawn(move || {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    if place >= n {
                        return;
                    }
                    let outcome = work(place);
                    if outcome.is_err() {
                        next.store(n, Ordering::Relaxed);
                    }
                    if sender.send((place, outcome)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (finished, (place, outcome)) in (1..).zip(receiver) {
            done[place] = Some(outcome);
            progress(finished, n);
        }
    });
    // After an error some parts were not begun.
    done.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_and_progress_reaches_the_end() {
        let mut last = (0, 0);
        let squares = map(100, 4, |place| Ok::<_, ()>(place * place), |done, of| last = (done, of));
        assert!(squares.unwrap().iter().enumerate().all(|(place, square)| *square == place * place));
        assert_eq!(last, (100, 100));
    }

    #[test]
    fn an_error_cancels_the_remaining_work() {
        let outcome = map(1000, 2, |place| if place == 3 { Err(place) } else { Ok(()) }, |_, _| {});
        assert_eq!(outcome, Err(3));
    }
}
