//! Work on one shot whose failure must not end the run, in whatever way it fails.

use std::any::Any;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// Whether this thread works on something isolated, so that a panic is a value and need not be printed.
    static ISOLATED: Cell<bool> = const { Cell::new(false) };
}

/// What `work` returns, or the message of the panic that ended it. Nothing is printed; panics elsewhere are reported as before.
///
/// No input is known that makes a shot panic. This is the net below: the work shares nothing that it could leave half-done.
pub(crate) fn isolated<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    silence();
    let before = ISOLATED.replace(true);
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    ISOLATED.set(before);
    done.map_err(|panic| message(panic.as_ref()))
}

/// Passes on what panics say, except those of isolated work.
fn silence() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !ISOLATED.get() {
                others(info);
            }
        }));
    });
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_string());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no reason given".to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_value_and_the_rest_goes_on() {
        let all: Vec<_> =
            [1.0, f64::NAN, 3.0].into_iter().map(|high| isolated(|| 2.0_f64.clamp(0.0, high))).collect();
        assert_eq!((&all[0], &all[2]), (&Ok(1.0), &Ok(2.0)));
        assert!(all[1].as_ref().unwrap_err().contains("min > max"), "{all:?}");
        assert!(!ISOLATED.get());
    }
}
