//! Warnings that may recur in many frames: printed once per job, and summarised at its end for the
//! worst frame.

use serde_json::{Value, json};

/// A warning about a frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Recurring {
    /// Kind of the warning, as in events.
    pub(crate) what: &'static str,
    /// The frame.
    pub(crate) frame: u32,
    /// Severity relative to other warnings of its kind.
    pub(crate) size: f64,
    /// The warning in words.
    pub(crate) text: String,
    /// Further keys of the event.
    pub(crate) event: Value,
}

impl Recurring {
    /// The line and the event for this frame.
    fn said(&self) -> (String, Value) {
        let text = format!("frame {}: {}", self.frame, self.text);
        let mut event = self.event.clone();
        event["event"] = json!("warning");
        event["what"] = json!(self.what);
        event["frame"] = json!(self.frame);
        event["text"] = json!(text);
        (format!("warning: {text}"), event)
    }
}

/// Warnings of one kind in a job.
struct WarningGroup {
    worst: Recurring,
    frames: u64,
    first: u32,
    last: u32,
}

/// Warnings of a job by kind, in order of first occurrence.
#[derive(Default)]
pub(super) struct Recurrences(Vec<WarningGroup>);

impl Recurrences {
    /// Adds a warning. Returns the line and the event to print now if it is the first of its kind.
    pub(super) fn add(&mut self, warning: Recurring) -> Option<(String, Value)> {
        let known = self.0.iter_mut().find(|it| it.worst.what == warning.what);
        let Some(kind) = known else {
            let (line, event) = warning.said();
            self.0.push(WarningGroup {
                first: warning.frame,
                last: warning.frame,
                frames: 1,
                worst: warning,
            });
            let more = "; the worst of the frames after it is reported at the end";
            return Some((format!("{line}{more}"), event));
        };
        kind.frames += 1;
        kind.last = warning.frame;
        if warning.size > kind.worst.size {
            kind.worst = warning;
        }
        None
    }

    /// Summaries for the end of the job, of kinds that occurred in more than one frame. Clears the
    /// warnings.
    pub(super) fn end(&mut self) -> Vec<(String, Value)> {
        let kinds = std::mem::take(&mut self.0).into_iter();
        let more = kinds.filter(|kind| kind.frames > 1);
        more.map(|kind| {
            let WarningGroup {
                worst,
                frames,
                first,
                last,
            } = kind;
            let (_, mut event) = worst.said();
            event["frames"] = json!(frames);
            event["first"] = json!(first);
            event["last"] = json!(last);
            let line = format!(
                "warning: in {frames} of frames {first} to {last}, worst in frame {}: {}",
                worst.frame, worst.text
            );
            (line, event)
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crowded(frame: u32, size: f64) -> Recurring {
        Recurring {
            what: "crowded cell",
            frame,
            size,
            text: format!("a cell holds {size:.1} times"),
            event: json!({ "density_error_max": size - 1.0 }),
        }
    }

    #[test]
    fn a_kind_is_said_once_and_its_worst_at_the_end() {
        let mut told = Recurrences::default();
        let (line, event) = told.add(crowded(5, 2.5)).unwrap();
        assert!(line.starts_with("warning: frame 5: a cell holds 2.5 times; the worst of"));
        assert_eq!(
            event,
            json!({
                "event": "warning", "what": "crowded cell", "frame": 5, "density_error_max": 1.5,
                "text": "frame 5: a cell holds 2.5 times",
            })
        );
        assert_eq!(told.add(crowded(6, 4.0)), None);
        assert_eq!(told.add(crowded(9, 3.0)), None);
        // Another kind is printed too, and needs no summary if only one frame has it.
        let other = Recurring {
            what: "density",
            ..crowded(7, 1.0)
        };
        assert!(told.add(other).is_some());
        let end = told.end();
        assert_eq!(end.len(), 1);
        assert_eq!(
            end[0].0,
            "warning: in 3 of frames 5 to 9, worst in frame 6: a cell holds 4.0 times"
        );
        assert_eq!(
            end[0].1,
            json!({
                "event": "warning", "what": "crowded cell", "frame": 6, "density_error_max": 3.0,
                "frames": 3, "first": 5,
                "last": 9, "text": "frame 6: a cell holds 4.0 times",
            })
        );
        // The next job starts afresh.
        assert!(told.end().is_empty() && told.add(crowded(1, 2.1)).is_some());
    }
}
