//! Threads: pools that are made when they are first needed.
//!
//! A process that was forked has none of the threads of its parent, and waiting for them never ends. So
//! nothing here uses the global pool of rayon, and a child that inherits pools works on one thread of its
//! own.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Time between looks for Ctrl-C.
pub const LOOK: Duration = Duration::from_millis(50);

/// Items that one thread takes at a time.
pub const CHUNK: usize = 8192;

/// How many items make it worth to do more than to go through them.
#[derive(Debug, Clone, Copy)]
pub struct Worth {
    /// Several threads are used from this number of items on, if the caller states none.
    pub threads: usize,
    /// Below this many items, Python's lock is kept and no thread takes fewer: to release the lock takes as long as some
    /// items do.
    pub least: usize,
}

struct Pools {
    /// The process that the pools belong to; 0 before the first one is made.
    process: u32,
    /// Whether the process was forked after its parent had made pools.
    forked: bool,
    by_threads: BTreeMap<usize, Arc<ThreadPool>>,
}

static POOLS: Mutex<Pools> = Mutex::new(Pools { process: 0, forked: false, by_threads: BTreeMap::new() });

/// How many threads to use, as a caller states it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// As many as there are processors, or as `RAYON_NUM_THREADS` says, where the work is worth it.
    Auto,
    /// This many, but no more than there are processors.
    Exactly(NonZeroUsize),
}

impl Threads {
    /// Whether the work stays on the thread of the caller.
    pub fn is_one(self) -> bool {
        matches!(self, Self::Exactly(count) if count.get() == 1)
    }
}

impl<'py> FromPyObject<'_, 'py> for Threads {
    type Error = PyErr;

    fn extract(threads: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if threads.is_none() {
            return Ok(Self::Auto);
        }
        let count: i64 = threads.extract()?;
        let positive = usize::try_from(count).ok().and_then(NonZeroUsize::new);
        let count = positive
            .ok_or_else(|| PyValueError::new_err(format!("threads is {count}, expected 1 or more")))?;
        Ok(Self::Exactly(if count == NonZeroUsize::MIN { count } else { count.min(processors()) }))
    }
}

/// The number of processors. Linux is asked once: it reads files of control groups for the answer, which takes as long
/// as ω at a hundred points.
fn processors() -> NonZeroUsize {
    static COUNT: OnceLock<NonZeroUsize> = OnceLock::new();
    *COUNT.get_or_init(|| std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))
}

/// The pool for a number of threads. `py` proves that no other thread of Python forks in the meantime, so that
/// a child never inherits the lock.
pub fn pool(_py: Python<'_>, threads: Threads) -> PyResult<Arc<ThreadPool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if pools.process != process {
        pools.forked |= pools.process != 0;
        pools.process = process;
        // ending the pools of the parent would wait for threads that do not exist here
        std::mem::forget(std::mem::take(&mut pools.by_threads));
    }
    let count = match threads {
        _ if pools.forked => 1,
        Threads::Auto => 0,
        Threads::Exactly(count) => count.get(),
    };
    if let Some(pool) = pools.by_threads.get(&count) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new()
        .num_threads(count)
        .thread_name(|number| format!("rfm {number}"))
        .build()
        .map_err(|error| PyRuntimeError::new_err(format!("cannot start threads: {error}")))?;
    let pool = Arc::new(pool);
    pools.by_threads.insert(count, Arc::clone(&pool));
    Ok(pool)
}

/// Runs something on the threads of a pool, with Python's lock released.
pub fn run<R: Send>(py: Python<'_>, threads: Threads, work: impl FnOnce() -> R + Send) -> PyResult<R> {
    let pool = pool(py, threads)?;
    Ok(py.detach(|| pool.install(work)))
}

/// Whether Ctrl-C has been pressed while something ran.
#[derive(Clone, Default)]
pub struct Watch(Arc<AtomicBool>);

impl rfm::mesh::Watch for Watch {
    /// The result of what Ctrl-C has ended is not needed.
    fn is_over(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Runs something long on the threads of a pool, with Python's lock released, and returns at once when Ctrl-C is
/// pressed. The work owns what it needs: it goes on unseen until it next looks at the watch.
///
/// # Errors
/// `KeyboardInterrupt`, or whatever else a handler of signals raises.
pub fn run_watched<R: Send + 'static>(
    py: Python<'_>,
    threads: Threads,
    work: impl FnOnce(&Watch) -> R + Send + 'static,
) -> PyResult<R> {
    let pool = pool(py, threads)?;
    let watch = Watch::default();
    let (done, result) = sync_channel(1);
    // Python's lock is released by lending what is used meanwhile, so that it must be safe to share
    let result = Mutex::new(result);
    let wait = || result.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(LOOK);
    let watched = watch.clone();
    pool.spawn(move || {
        // an error of the send means that the receiver is gone
        let _ = done.send(catch_unwind(AssertUnwindSafe(|| work(&watched))));
    });
    loop {
        match py.detach(wait) {
            Ok(Ok(found)) => return Ok(found),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the threads have ended before their work"));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(interrupt) = py.check_signals() {
            watch.0.store(true, Ordering::Relaxed);
            // what follows gets threads of its own, and these end with their work
            POOLS
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .by_threads
                .retain(|_, other| !Arc::ptr_eq(other, &pool));
            return Err(interrupt);
        }
    }
}

/// Does some work for ranges that together are `0..count`, on the caller's thread or, if the work is worth it, on
/// those of a pool, with Python's lock released and looks for Ctrl-C in between. Returns the results in order.
///
/// # Errors
/// `KeyboardInterrupt`, or whatever else a handler of signals raises; then a part of the work has been done.
pub fn in_ranges<R: Send>(
    py: Python<'_>,
    threads: Threads,
    count: usize,
    worth: Worth,
    work: impl Fn(Range<usize>) -> R + Sync,
) -> PyResult<Vec<R>> {
    if count < worth.least {
        return Ok(vec![work(0..count)]);
    }
    let alone = threads.is_one() || (threads == Threads::Auto && count < worth.threads);
    let pool = if alone { None } else { Some(pool(py, threads)?) };
    let mut results = Vec::new();
    // items may take longer than the time between looks: each thread has some all the same
    let fewest = worth.least * pool.as_ref().map_or(1, |pool| pool.current_num_threads());
    let (mut begin, mut size) = (0, worth.least);
    while begin < count {
        let range = begin..count.min(begin.saturating_add(size));
        let mut spent = Duration::ZERO;
        // the time until Python's lock is had again says nothing of the work
        py.detach(|| {
            let begun = Instant::now();
            match &pool {
                Some(pool) if range.len() > worth.least => {
                    let chunk =
                        range.len().div_ceil(4 * pool.current_num_threads()).clamp(worth.least, CHUNK);
                    let parts = range.len().div_ceil(chunk);
                    let part = |part: usize| {
                        let from = range.start + part * chunk;
                        work(from..range.end.min(from + chunk))
                    };
                    pool.install(|| results.par_extend((0..parts).into_par_iter().map(part)));
                }
                _ => results.push(work(range.clone())),
            }
            spent = begun.elapsed();
        });
        begin = range.end;
        // long enough to cost nothing, short enough for the waiting thread
        size = match spent {
            spent if spent < LOOK / 16 => size.saturating_mul(8),
            spent if spent < LOOK / 2 => size.saturating_mul(2),
            spent if spent > 2 * LOOK => size / 4,
            _ => size,
        };
        size = size.max(fewest);
        py.check_signals()?;
    }
    Ok(results)
}
