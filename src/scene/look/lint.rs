//! What of a look is allowed, and hardly what was meant: each found by a number, and said with it.

use std::f64::consts::PI;

use super::Look;

impl Look {
    /// What of the look is allowed and hardly meant, a sentence each, with its key first and the number that it was judged by.
    pub fn lints(&self) -> Vec<String> {
        let lens = self.lint_lens().into_iter();
        lens.chain(self.lint_library()).collect()
    }

    /// N samples show a point as N ghosts, evenly over its disc: of c pixels across, each has π c² / 4 N pixels of it.
    fn lint_lens(&self) -> Option<String> {
        let blur = self.widest_blur_px()?;
        let samples = self.spec.image.samples;
        let wanted = (PI / 4.0 * blur * blur).ceil();
        (f64::from(samples) < wanted).then(|| {
            format!(
                "image.samples: the lens draws a point at infinity, or at half of the focus distance, as a disc {blur:.1} pixels \
                 wide, and {samples} samples are as many ghosts of it; they are closer than a pixel from {wanted} on"
            )
        })
    }
}
