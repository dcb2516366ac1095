//! Regular instants at which something is done while a run goes on.

/// Instants k·period. Each is met by the first step that reaches it. Steps are not fitted to them, so that a
/// measurement does not change what it measures.
#[derive(Debug, Clone)]
pub struct Every {
    /// Time between the instants, s.
    period: f64,
    /// Number k of the next instant, a whole number.
    next: f64,
}

impl Every {
    /// The instants after a time, s.
    pub fn after(period: f64, time: f64) -> Self {
        let mut every = Self { period, next: 0.0 };
        every.is_due(time);
        every
    }

    /// Whether an instant has been reached since the last one that this function reported.
    pub fn is_due(&mut self, time: f64) -> bool {
        /// Relative tolerance for times, which are sums of many steps.
        const ROUNDING: f64 = 1e-9;
        let passed = (time / self.period * (1.0 + ROUNDING)).floor();
        let due = passed >= self.next;
        if due {
            self.next = passed + 1.0;
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_instant_is_met_once_whatever_the_steps_are() {
        for dt in [0.01, 0.003, 0.1, 0.25] {
            let mut every = Every::after(0.1, 0.0);
            let mut time = 0.0;
            let mut met = 0;
            while time < 1.0 - 1e-9 {
                time += dt;
                met += u32::from(every.is_due(time));
            }
            // a step of 0.25 passes over every second or third
            assert_eq!(met, if dt == 0.25 { 4 } else { 10 }, "{dt}");
        }
    }

    #[test]
    fn it_goes_on_where_it_was() {
        let mut straight = Every::after(0.1, 0.0);
        (1..=57).for_each(|k| {
            straight.is_due(0.01 * f64::from(k));
        });
        let mut resumed = Every::after(0.1, 0.57);
        for k in 58..200 {
            let time = 0.01 * f64::from(k);
            assert_eq!(straight.is_due(time), resumed.is_due(time), "{time}");
        }
    }
}
