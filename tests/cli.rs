//! Runs of the program.

use std::process::Output;

use crate::prelude::*;

fn caromfit(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_caromfit")).args(args).current_dir(folder).output().unwrap()
}

/// Standard output and standard error of a run in a folder that was done.
pub fn done_in(folder: &Path, args: &[&str]) -> [String; 2] {
    let output = caromfit(folder, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {output:?}");
    [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap())
}

/// Standard error of a run in a folder that ended with a status.
pub fn refused_in(folder: &Path, status: i32, args: &[&str]) -> String {
    let output = caromfit(folder, args);
    assert_eq!(output.status.code(), Some(status), "{args:?}: {output:?}");
    String::from_utf8(output.stderr).unwrap()
}
