//! Runs of the program.

use std::ffi::OsStr;
use std::process::Output;

use crate::prelude::*;

pub fn caromfit<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_caromfit")).args(args).output().unwrap()
}

/// A run with the current directory.
pub fn caromfit_in<S: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_caromfit")).args(args).current_dir(folder).output().unwrap()
}

pub fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

pub fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// It was done, and nothing was said on standard error.
pub fn done(output: &Output) -> &str {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    assert_eq!(stderr(output), "");
    stdout(output)
}

/// Standard output and standard error of a run in a folder that was done.
pub fn done_in(folder: &Path, args: &[&str]) -> [String; 2] {
    let output = caromfit_in(folder, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", stderr(&output));
    [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap())
}

/// Standard error of a run in a folder that ended with a status.
pub fn refused_in(folder: &Path, status: i32, args: &[&str]) -> String {
    let output = caromfit_in(folder, args);
    assert_eq!(output.status.code(), Some(status), "{args:?}: {}", stdout(&output));
    String::from_utf8(output.stderr).unwrap()
}
