//! SIGINT and SIGTERM: the first ends the job after the current frame, resumably; the second at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What a process that ended at a signal gives by custom (128 + SIGINT).
pub const EXIT_CODE: i32 = 130;

/// Whether the user has asked for an end. Clones share one flag.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    flag: Arc<AtomicBool>,
}

impl Interrupt {
    /// Takes over SIGINT, SIGTERM and SIGHUP (on Windows Ctrl-C and Ctrl-Break) for the rest of the
    /// process; once a process.
    ///
    /// # Errors
    /// Where handlers are there already, or the system refuses.
    pub fn install() -> Result<Self, ctrlc::Error> {
        let interrupt = Self::default();
        let shared = interrupt.clone();
        ctrlc::try_set_handler(move || {
            if shared.raise() {
                // The process ends with its temporary files in place; resuming clears them.
                std::process::exit(EXIT_CODE);
            }
            eprintln!("ends after the current frame; once more to end at once");
        })?;
        Ok(interrupt)
    }

    /// Whether to end after the current frame.
    pub fn is_raised(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// The flag itself, for a stage that knows nothing of signals.
    pub fn flag(&self) -> &AtomicBool {
        &self.flag
    }

    /// Raises the flag; tells whether it was up before.
    fn raise(&self) -> bool {
        self.flag.swap(true, Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_share_the_flag_and_the_second_raise_is_known() {
        let interrupt = Interrupt::default();
        let other = interrupt.clone();
        assert!(!other.is_raised());
        assert!(!interrupt.raise());
        assert!(other.is_raised() && other.flag().load(Ordering::Relaxed));
        assert!(other.raise());
    }

    /// The child half of the test below: says when it is ready and when it was asked to end, and then
    /// goes on, as a long frame would.
    #[test]
    #[ignore = "runs as the child of the test below"]
    fn child() {
        let interrupt = Interrupt::install().unwrap();
        assert!(Interrupt::install().is_err(), "once a process");
        println!("\nready");
        while !interrupt.is_raised() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        println!("\nraised");
        std::thread::sleep(std::time::Duration::from_secs(60));
    }

    #[cfg(unix)]
    #[test]
    fn the_first_signal_raises_and_the_second_ends() {
        use std::io::{BufRead, BufReader};
        use std::process::{Command, Stdio};

        for (first, second) in [("INT", "INT"), ("TERM", "INT")] {
            let mut child = Command::new(std::env::current_exe().unwrap())
                .args(["--ignored", "--exact", "--nocapture"])
                .arg("cli::interrupt::tests::child")
                .stdout(Stdio::piped())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
            let pid = child.id().to_string();
            for (word, signal) in [("ready", first), ("raised", second)] {
                assert!(lines.any(|line| line.unwrap() == word), "{word}");
                let sent = Command::new("kill").args(["-s", signal, &pid]).status();
                assert!(sent.unwrap().success());
            }
            assert_eq!(child.wait().unwrap().code(), Some(EXIT_CODE));
        }
    }
}
