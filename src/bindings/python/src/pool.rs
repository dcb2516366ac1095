//! Threads: pools that are made when they are first needed.
//!
//! A process that was forked has none of the threads of its parent, and whoever waits for them waits for ever.
//! So nothing here uses the global pool of rayon, and a child that inherits pools works on one thread of its
//! own.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

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
        let count: i64 = threads.extract()?;
        let positive = usize::try_from(count).ok().and_then(NonZeroUsize::new);
        let count = positive
            .ok_or_else(|| PyValueError::new_err(format!("threads is {count}, expected 1 or more")))?;
        let most = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Ok(Self::Exactly(count.min(most)))
    }
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
