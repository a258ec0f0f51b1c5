//! SIGINT and SIGTERM: the first ends the job after the current frame, resumably; the second ends
//! it at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::output;

/// Exit code of a process that a signal ended; by convention 128 + SIGINT.
pub const EXIT_CODE: i32 = 130;

/// Whether the user has requested an end. Clones share one flag.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    flag: Arc<AtomicBool>,
}

impl Interrupt {
    /// Handles SIGINT, SIGTERM and SIGHUP (on Windows Ctrl-C) for the rest of the process. Signals
    /// that the process was started to ignore, as under `nohup`, stay ignored.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn install() -> std::io::Result<Self> {
        let interrupt = Self::default();
        let shared = interrupt.clone();
        on_signal(move || {
            if shared.raise() {
                // The process ends with its temporary files in place; resuming clears them.
                std::process::exit(EXIT_CODE);
            }
            output::say(
                "ending after the current frame, resumably; interrupt again to end at once",
            );
        })?;
        Ok(interrupt)
    }

    /// [`Self::install`], or a warning if the system refuses: a signal then ends the process at
    /// once, and only completed frames survive.
    pub fn install_or_warn() -> Self {
        Self::install().unwrap_or_else(|error| {
            output::say(&format!(
                "warning: a signal will end this at once, without finishing its frame: {error}"
            ));
            Self::default()
        })
    }

    /// Whether to end after the current frame.
    pub fn is_raised(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// The flag itself, for a stage that does not deal with signals.
    pub fn flag(&self) -> &AtomicBool {
        &self.flag
    }

    /// Raises the flag; returns whether it was raised before.
    fn raise(&self) -> bool {
        self.flag.swap(true, Ordering::Relaxed)
    }
}

/// Calls `handle` on a separate thread for each signal from now on.
#[cfg(unix)]
fn on_signal(handle: impl Fn() + Send + 'static) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let wanted = [SIGINT, SIGTERM, SIGHUP].into_iter();
    let heard: Vec<i32> = wanted.filter(|&signal| !is_ignored(signal)).collect();
    let mut signals = signal_hook::iterator::Signals::new(heard)?;
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || signals.forever().for_each(|_| handle()))?;
    Ok(())
}

/// Whether the process inherited an ignored `signal`.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let mut now = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: a null action changes nothing; `now` has space for the result, and all zeros are
    // valid if nothing is written.
    let now = unsafe {
        libc::sigaction(signal, std::ptr::null(), now.as_mut_ptr());
        now.assume_init()
    };
    now.sa_sigaction == libc::SIG_IGN
}

#[cfg(not(unix))]
fn on_signal(handle: impl Fn() + Send + 'static) -> std::io::Result<()> {
    ctrlc::set_handler(handle).map_err(std::io::Error::other)
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

    /// The child half of the test below: reports when it is ready and when it was asked to end, and
    /// then continues, as a long frame would.
    #[test]
    #[ignore = "runs as the child of the test below"]
    fn child() {
        let interrupt = Interrupt::install().unwrap();
        println!("\nready");
        while !interrupt.is_raised() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        println!("\nraised");
        std::thread::sleep(std::time::Duration::from_secs(60));
    }

    /// As under `nohup`: an ignored signal stays ignored, and the others are handled.
    #[cfg(unix)]
    #[test]
    fn an_ignored_signal_stays_ignored() {
        use std::io::{BufRead, BufReader};
        use std::process::{Command, Stdio};

        let this = std::env::current_exe().unwrap();
        let mut child = Command::new("sh")
            .args(["-c", "trap '' HUP; exec \"$@\"", "sh"])
            .arg(this)
            .args(["--ignored", "--exact", "--nocapture"])
            .arg("interrupt::tests::child")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let pid = child.id().to_string();
        let send = |signal| Command::new("kill").args(["-s", signal, &pid]).status();
        assert!(lines.any(|line| line.unwrap() == "ready"));
        assert!(send("HUP").unwrap().success() && send("HUP").unwrap().success());
        assert!(send("TERM").unwrap().success());
        assert!(lines.any(|line| line.unwrap() == "raised"));
        assert!(send("TERM").unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(EXIT_CODE));
    }

    #[cfg(unix)]
    #[test]
    fn the_first_signal_raises_and_the_second_ends() {
        use std::io::{BufRead, BufReader};
        use std::os::unix::process::CommandExt;
        use std::process::{Command, Stdio};

        // A shell starts background processes with SIGINT ignored, which the child would not
        // receive.
        let hear_all = || {
            for signal in [libc::SIGINT, libc::SIGTERM] {
                // SAFETY: `signal` may be called between fork and exec, and the default action
                // holds no pointer.
                unsafe { libc::signal(signal, libc::SIG_DFL) };
            }
            Ok(())
        };
        for (first, second) in [("INT", "INT"), ("TERM", "INT")] {
            let mut command = Command::new(std::env::current_exe().unwrap());
            command
                .args(["--ignored", "--exact", "--nocapture"])
                .arg("interrupt::tests::child")
                .stdout(Stdio::piped())
                .stderr(Stdio::null());
            // SAFETY: `hear_all` allocates nothing and takes no lock.
            let mut child = unsafe { command.pre_exec(hear_all) }.spawn().unwrap();
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
