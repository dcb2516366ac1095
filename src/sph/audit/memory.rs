//! The audit as numbers in a checkpoint.

use glam::DVec3;

use super::{Audit, Compression, Instant, Rows};

impl Audit {
    /// The audit as numbers, for a checkpoint.
    pub(in crate::sph) fn memory(&self) -> Vec<f64> {
        let Compression { mean, p99, largest } = self.compression;
        let DVec3 { x, y, z } = self.places;
        let told = self.told.map(|told| f64::from(u8::from(told)));
        let numbers = [
            self.reference,
            self.height,
            self.least,
            self.gained,
            self.at_start,
            self.work,
            self.by_walls,
            self.power,
            x,
            y,
            z,
            self.excess,
            self.volume_at_start,
            self.volume_change,
            mean,
            p99,
            largest,
            self.max_speed,
            self.too_fast,
            self.rows.at_start,
            self.rows.most,
            self.liveliest,
            self.given,
            self.supplied,
            f64::from(self.ruinous_looks),
            self.allowed,
        ];
        let now = self.now;
        let Compression { mean, p99, largest } = now.compression;
        let now = [now.excess, now.volume_change, mean, p99, largest, now.speed];
        numbers.into_iter().chain(now).chain(told).collect()
    }

    /// Takes up the audit of a checkpoint. A memory of another length is ignored.
    pub(in crate::sph) fn take_up(&mut self, memory: &[f64]) {
        let Ok(
            [
                reference,
                height,
                least,
                gained,
                at_start,
                work,
                by_walls,
                power,
                x,
                y,
                z,
                excess,
                volume_at_start,
                volume_change,
                mean,
                p99,
                largest,
                max_speed,
                too_fast,
                crowded_at_start,
                crowded,
                liveliest,
                given,
                supplied,
                ruinous_looks,
                allowed,
                excess_now,
                volume_now,
                mean_now,
                p99_now,
                largest_now,
                speed,
                told @ ..,
            ],
        ) = <[f64; 37]>::try_from(memory)
        else {
            return;
        };
        *self = Self {
            unjudged: self.unjudged,
            reference,
            height,
            least,
            given,
            supplied,
            ruinous_looks: (ruinous_looks as u32).min(u32::MAX - 1),
            allowed,
            gained,
            is_moved: self.is_moved,
            is_rough: self.is_rough,
            at_start,
            work,
            by_walls,
            power,
            places: DVec3::new(x, y, z),
            excess,
            liveliest,
            volume_at_start,
            volume_change,
            compression: Compression { mean, p99, largest },
            rows: Rows { at_start: crowded_at_start, most: crowded },
            max_speed,
            too_fast,
            now: Instant {
                excess: excess_now,
                volume_change: volume_now,
                compression: Compression { mean: mean_now, p99: p99_now, largest: largest_now },
                speed,
            },
            told: told.map(|told| told != 0.0),
        };
    }
}
