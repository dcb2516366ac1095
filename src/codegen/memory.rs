//! Ownership of generated code.

use std::fmt;
use std::sync::Mutex;

use cranelift_jit::JITModule;

use super::request::Shape;
use crate::ir::Tables;
use crate::precision::Precision;

/// Machine code of one program, freed when this is dropped.
pub struct Code {
    entry: *const u8,
    /// The type of its numbers.
    pub precision: Precision,
    /// The shape of its calls.
    pub shape: Shape,
    /// Number of results that it writes for a point.
    pub outputs: usize,
    /// Bytes of machine code.
    pub size: usize,
    /// Owns the pages; it is taken out only to free them.
    module: Mutex<Option<JITModule>>,
    /// The tables whose addresses the code contains.
    _tables: Tables,
}

// SAFETY: `entry` points to finished code that is never written to again; it stays mapped until the drop of
// `self`, and any number of threads may execute the same code. The module is behind a mutex. Tables may be
// looked up from any thread.
unsafe impl Send for Code {}
// SAFETY: threads that share a `Code` only execute it, which is safe for the reasons above.
unsafe impl Sync for Code {}

impl Code {
    pub(super) fn new(
        (module, tables): (JITModule, Tables),
        entry: *const u8,
        (precision, shape): (Precision, Shape),
        outputs: usize,
        size: usize,
    ) -> Self {
        Self { entry, precision, shape, outputs, size, module: Mutex::new(Some(module)), _tables: tables }
    }

    /// The start of the function; valid as long as `self`.
    #[inline]
    pub fn entry(&self) -> *const u8 {
        self.entry
    }
}

impl fmt::Debug for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Code({:?}, {:?}, {} bytes)", self.precision, self.shape, self.size)
    }
}

impl Drop for Code {
    fn drop(&mut self) {
        let module = match self.module.get_mut() {
            Ok(module) => module.take(),
            Err(poisoned) => poisoned.into_inner().take(),
        };
        if let Some(module) = module {
            // SAFETY: `entry` is private and callers borrow `self` while they run it
            // (`solid::programs::compiled`), so no code of this module is running or can be called again.
            unsafe { module.free_memory() };
        }
    }
}
