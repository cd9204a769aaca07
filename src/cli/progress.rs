//! Progress on standard error, for work of more than a second and if it is a terminal.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work that takes less than this shows no progress.
const QUIET: Duration = Duration::from_secs(1);

pub struct Progress {
    bar: ProgressBar,
    begun: Instant,
    shown: bool,
}

impl Progress {
    pub fn new(steps: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps as u64), ProgressDrawTarget::hidden());
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}  {elapsed} (about {eta} left)")
        {
            bar.set_style(style);
        }
        Self { bar, begun: Instant::now(), shown: !std::io::stderr().is_terminal() }
    }

    /// Names the step that begins.
    pub fn step(&mut self, name: &str) {
        self.bar.set_message(name.to_string());
        self.show_when_slow();
    }

    /// The step is done.
    pub fn done(&mut self) {
        self.bar.inc(1);
        self.show_when_slow();
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn show_when_slow(&mut self) {
        if !self.shown && self.begun.elapsed() > QUIET {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.enable_steady_tick(Duration::from_millis(200));
            self.shown = true;
        }
    }
}
