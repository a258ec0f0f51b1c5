//! Parallel loops over indices and slices.
//!
//! The compiler makes an instance of rayon's iterators for each closure that they are given. Here a
//! closure is called through one loop over pieces, which is compiled once: a loop takes a tenth of
//! the compiler's time. Results stand in the order of the indices, whatever the number of threads.

use std::{
    mem,
    ops::Range,
    sync::{Mutex, PoisonError},
};

use rayon::prelude::*;

/// Pieces for each thread, so that threads that end early take over from others.
const PIECES_A_THREAD: usize = 8;

/// Returns `of` of each index, in order.
pub fn map<T: Send>(range: Range<usize>, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    gather(range, &|part| part.map(&of).collect())
}

/// Returns `of` of each value, in order.
pub fn map_slice<S: Sync, T: Send>(values: &[S], of: impl Fn(&S) -> T + Sync) -> Vec<T> {
    gather(0..values.len(), &|part| {
        values[part].iter().map(&of).collect()
    })
}

/// Returns all that `of` yields for each index, in order. An [`Option`] filters.
pub fn flat_map<T: Send, I: IntoIterator<Item = T>>(
    range: Range<usize>,
    of: impl Fn(usize) -> I + Sync,
) -> Vec<T> {
    gather(range, &|part| part.flat_map(&of).collect())
}

/// Calls `of` with each value and its index.
pub fn for_each_mut<T: Send>(values: &mut [T], of: impl Fn(usize, &mut T) + Sync) {
    let length = piece_length(values.len());
    for_chunks_mut(values, length, |piece, values| {
        for (index, value) in values.iter_mut().enumerate() {
            of(piece * length + index, value);
        }
    });
}

/// Calls `of` with each chunk of `length` values, the last of which may be shorter, and its number.
///
/// # Panics
///
/// If `length` is 0.
pub fn for_chunks_mut<T: Send>(
    values: &mut [T],
    length: usize,
    of: impl Fn(usize, &mut [T]) + Sync,
) {
    let chunks: Vec<Mutex<&mut [T]>> = values.chunks_mut(length).map(Mutex::new).collect();
    run(chunks.len(), &|chunk| {
        let mut values = chunks[chunk].lock().unwrap_or_else(PoisonError::into_inner);
        of(chunk, &mut values);
    });
}

/// Returns the results of consecutive parts of a range, one after the other.
fn gather<T: Send>(range: Range<usize>, of: &(dyn Fn(Range<usize>) -> Vec<T> + Sync)) -> Vec<T> {
    let length = piece_length(range.len());
    let pieces = range.len().div_ceil(length);
    let mut parts = Vec::new();
    parts.resize_with(pieces, Vec::new);
    let parts = Mutex::new(parts);
    run(pieces, &|piece| {
        let first = range.start + piece * length;
        let part = of(first..range.end.min(first + length));
        parts.lock().unwrap_or_else(PoisonError::into_inner)[piece] = part;
    });
    let mut parts = parts.into_inner().unwrap_or_else(PoisonError::into_inner);
    let [first, rest @ ..] = &mut parts[..] else {
        return Vec::new();
    };
    let mut all = mem::take(first);
    all.reserve_exact(rest.iter().map(Vec::len).sum());
    for part in rest {
        all.append(&mut mem::take(part));
    }
    all
}

fn piece_length(count: usize) -> usize {
    count
        .div_ceil(PIECES_A_THREAD * rayon::current_num_threads())
        .max(1)
}

fn run(pieces: usize, of: &(dyn Fn(usize) + Sync)) {
    (0..pieces).into_par_iter().for_each(of);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_the_indices() {
        for count in [0, 1, 2, 15, 16, 17, 1000] {
            let squares: Vec<usize> = (3..3 + count).map(|k| k * k).collect();
            assert_eq!(map(3..3 + count, |k| k * k), squares);
            let roots: Vec<usize> = map_slice(&squares, |k| k.isqrt());
            assert_eq!(roots, (3..3 + count).collect::<Vec<_>>());
            let odd = flat_map(0..count, |k| (k % 2 == 1).then_some(k));
            assert_eq!(odd, (1..count).step_by(2).collect::<Vec<_>>());
            let twice = flat_map(0..count, |k| [k, k]);
            assert!(twice.iter().enumerate().all(|(k, &value)| value == k / 2));
            assert_eq!(twice.len(), 2 * count);
            let mut values = squares.clone();
            for_each_mut(&mut values, |k, value| *value -= (k + 3) * (k + 3));
            assert!(values.iter().all(|&value| value == 0));
            let mut values = vec![0; count];
            for_chunks_mut(&mut values, 7, |chunk, part| part.fill(chunk));
            assert!(values.iter().enumerate().all(|(k, &value)| value == k / 7));
        }
    }

    #[test]
    #[should_panic(expected = "seven")]
    fn a_panic_of_a_piece_is_passed_on() {
        map(0..100, |k| assert_ne!(k, 7, "seven"));
    }
}
