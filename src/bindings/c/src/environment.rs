//! The floating-point environment in which the library works.
//!
//! Hosts may let a division by zero or an invalid operation end them (OpenFOAM does, and gfortran's -ffpe-trap), round
//! another way, or take tiny numbers for zero. Formulas divide by zero and meet NaN where that is their meaning, and values
//! have the same bits for every caller. So on x86-64 the library works in the standard environment, and gives another one of
//! the host back with the flags that it had.

/// The control word of the standard environment: nothing ends a process, numbers are rounded to the nearest.
#[cfg(target_arch = "x86_64")]
const STANDARD: u32 = 0x1f80;

/// The bits that only note what has happened.
#[cfg(target_arch = "x86_64")]
const FLAGS: u32 = 0x3f;

/// The host's environment, to which its end returns; nothing on other processors, few of which trap anything.
pub struct Hosts {
    #[cfg(target_arch = "x86_64")]
    control: Option<u32>,
}

#[cfg(target_arch = "x86_64")]
impl Hosts {
    /// Enters the standard environment.
    #[inline]
    pub fn leave() -> Self {
        let mut control = 0_u32;
        // SAFETY: it stores four bytes where four bytes are
        unsafe {
            std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
        }
        if control & !FLAGS == STANDARD {
            return Self { control: None };
        }
        load(STANDARD);
        Self { control: Some(control) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Drop for Hosts {
    #[inline]
    fn drop(&mut self) {
        if let Some(control) = self.control {
            load(control);
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn load(control: u32) {
    // SAFETY: it reads four bytes, of which the processor itself wrote all but the flags of exceptions
    unsafe {
        std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack, readonly));
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Hosts {
    /// Enters the standard environment.
    #[inline]
    pub fn leave() -> Self {
        Self {}
    }
}
