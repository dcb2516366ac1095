//! Generated C as a library of this process: compiled by the C compiler that is here, loaded, called.

use std::ffi::{CString, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::process::Command;

use rfm::ir::{BinaryFunction, UnaryFunction};
use rfm::precision::Precision;

/// The flags that the head of every C file names.
pub const FLAGS: [&str; 5] =
    ["-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"];

/// Whether a program is here; if not, the test says that it is skipped.
pub fn is_here(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        println!("SKIPPED: {program} is not here");
    }
    found
}

/// Runs a compiler, which must succeed without a word.
#[track_caller]
pub fn compile(program: &str, folder: &Path, arguments: &[&str]) {
    let output = Command::new(program).args(arguments).current_dir(folder).output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && words.is_empty(), "{program} {arguments:?}\n{words}");
}

/// Definitions of rfm_math_sin and so on that call pointers, which [`Library::load`] sets.
pub fn mathematics() -> String {
    let mut text = String::new();
    let mut add = |name: &str, number: &str, two: bool| {
        let (types, arguments, values) = match two {
            false => (number.to_string(), format!("{number} a"), "a"),
            true => (format!("{number}, {number}"), format!("{number} a, {number} b"), "a, b"),
        };
        text += &format!(
            "{number} (*rfm_pointer_{name})({types});\n{number} rfm_math_{name}({types});\n\
             {number} rfm_math_{name}({arguments}) {{ return rfm_pointer_{name}({values}); }}\n"
        );
    };
    for (precision, number) in [(Precision::F64, "double"), (Precision::F32, "float")] {
        UnaryFunction::ALL.iter().for_each(|function| add(function.c_name(precision), number, false));
        BinaryFunction::ALL.iter().for_each(|function| add(function.c_name(precision), number, true));
    }
    text
}

unsafe extern "C" {
    fn dlopen(path: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// A library that stays loaded until the process ends.
pub struct Library(*mut c_void);

impl Library {
    /// Loads a library, and gives it the functions of `rfm` if it has pointers for them.
    pub fn load(path: &Path) -> Self {
        let name = CString::new(path.to_str().unwrap()).unwrap();
        let now = 2;
        // SAFETY: the name ends with a zero, and the library has no code that runs when it is loaded.
        let library = Self(unsafe { dlopen(name.as_ptr(), now) });
        assert!(!library.0.is_null(), "{} cannot be loaded", path.display());
        for &f in UnaryFunction::ALL {
            library.point(f.c_name(Precision::F64), f.address_f64());
            library.point(f.c_name(Precision::F32), f.address_f32());
        }
        for &f in BinaryFunction::ALL {
            library.point(f.c_name(Precision::F64), f.address_f64());
            library.point(f.c_name(Precision::F32), f.address_f32());
        }
        library
    }

    fn point(&self, name: &str, function: *const u8) {
        let symbol = self.find(&format!("rfm_pointer_{name}"));
        if !symbol.is_null() {
            // SAFETY: `mathematics` has written a pointer to a function of this type under this name.
            unsafe { *symbol.cast::<*const u8>() = function };
        }
    }

    fn find(&self, name: &str) -> *mut c_void {
        let name = CString::new(name).unwrap();
        // SAFETY: the library stays loaded, and the name ends with a zero.
        unsafe { dlsym(self.0, name.as_ptr()) }
    }

    /// The address of a function that the library must have.
    pub fn function(&self, name: &str) -> *const c_void {
        let found = self.find(name);
        assert!(!found.is_null(), "the library has no {name}");
        found
    }
}

/// A folder with C files that becomes a library.
pub struct Workshop {
    folder: tempfile::TempDir,
}

impl Workshop {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// Compiles files into a library, without any warning.
    #[track_caller]
    pub fn library(&self, compiler: &str, files: &[&str]) -> Library {
        let mut arguments =
            vec!["-std=c99", "-Wall", "-Wextra", "-pedantic", "-shared", "-fPIC", "-o", "all.so"];
        arguments.extend(FLAGS);
        arguments.extend(files);
        arguments.push("-lm");
        compile(compiler, self.path(), &arguments);
        Library::load(&self.path().join("all.so"))
    }
}
