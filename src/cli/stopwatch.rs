//! Time that was spent on work, on machines that do other work as well.

use std::time::Instant;

/// Seconds that all threads of this process have spent on processors; seconds of the clock where the system
/// does not say.
pub fn processor_seconds() -> f64 {
    #[cfg(unix)]
    {
        let spent = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        spent.tv_sec as f64 + 1e-9 * spent.tv_nsec as f64
    }
    #[cfg(not(unix))]
    {
        static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
        START.elapsed().as_secs_f64()
    }
}

/// Measures how long something takes on a machine that does nothing else.
#[derive(Debug, Clone, Copy)]
pub struct Stopwatch {
    started: Instant,
    spent: f64,
}

impl Stopwatch {
    /// A watch that starts now.
    pub fn start() -> Self {
        Self { started: Instant::now(), spent: processor_seconds() }
    }

    /// Seconds since the start: those of the clock, or those of the processors where they are fewer, because other
    /// programs have held this one up.
    pub fn seconds(&self) -> f64 {
        self.passed().min(processor_seconds() - self.spent)
    }

    /// Seconds of the clock since the start.
    pub fn passed(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }
}
