//! What takes longer than a person waits for, on threads of its own.
//!
//! Work that a person waits for would queue behind it if both had the same threads.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvError, TryRecvError, channel};
use std::thread;

use rfm::mesh::Watch;

/// Work that goes on. If this is dropped, the work ends early where it can, and what it makes is lost.
pub(super) struct Making<T> {
    made: Receiver<T>,
    unwanted: Arc<AtomicBool>,
}

/// Whether anybody waits for a piece of work.
pub(super) struct Wanted(Arc<AtomicBool>);

impl Watch for Wanted {
    fn is_over(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl<T: Send + 'static> Making<T> {
    /// Begins the work, with half of the threads that there are for work that somebody waits for.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn begin(work: impl FnOnce(&Wanted) -> T + Send + 'static) -> io::Result<Self> {
        let threads = (rayon::current_num_threads() / 2).max(1);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(io::Error::other)?;
        let (send, made) = channel();
        let unwanted = Arc::new(AtomicBool::new(false));
        let wanted = Wanted(Arc::clone(&unwanted));
        let make = move || {
            // nobody may want it any more
            let _ = send.send(pool.install(|| work(&wanted)));
        };
        thread::Builder::new().name("rfm-making".into()).spawn(make)?;
        Ok(Self { made, unwanted })
    }

    /// What was made, if it is there. An error means that the work has failed in a way that it does not know itself.
    pub fn finished(&self) -> Option<Result<T, RecvError>> {
        match self.made.try_recv() {
            Ok(made) => Some(Ok(made)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(RecvError)),
        }
    }

    /// Waits for what is made, as [`Making::finished`].
    pub fn wait(self) -> Result<T, RecvError> {
        self.made.recv()
    }
}

impl<T> Drop for Making<T> {
    fn drop(&mut self) {
        self.unwanted.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_found_when_it_is_done_and_ends_when_it_is_not_wanted() {
        assert_eq!(Making::begin(|_| 7).unwrap().wait(), Ok(7));
        let (tell, told) = channel();
        let endless = Making::begin(move |wanted| {
            while !wanted.is_over() {
                thread::yield_now();
            }
            tell.send(()).unwrap();
        });
        let endless = endless.unwrap();
        assert!(endless.finished().is_none());
        drop(endless);
        assert_eq!(told.recv(), Ok(()));
        let failing = Making::begin(|_| -> u8 { panic!("of a test") }).unwrap();
        assert_eq!(failing.wait(), Err(RecvError));
    }
}
