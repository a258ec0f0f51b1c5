//! Explanations of how a sweep was measured.

use swell_files::study::sweep::{FRAME_RATE, Measure, SAMPLES};

use super::report::SweepResults;

impl SweepResults<'_> {
    /// Paragraphs for the page.
    pub(super) fn measured(&self) -> Vec<String> {
        let mut texts = vec![KNEE.to_owned(), EQUAL_TIME.to_owned(), WORK.to_owned()];
        texts.push(match self.sweep.errors[0].measure() {
            Measure::Report => "A density error is max(0, ρ/ρ0 − 1) at a frame's end, over the \
                particles (with FLIP over the cells of water); its mean, 99th percentile or \
                maximum is averaged over all frames. A largest speed is that of any particle in \
                the run's second half; a pressure's error is |p / (ρ g depth) − 1| at the scene's \
                probes, with the depth under the level of the start, averaged over those frames."
                .to_owned(),
            Measure::Finest => format!(
                "Errors are differences from the same method's finest run, the last of its values, \
                 at {SAMPLES} equally spaced times, averaged. The crest, the front and the \
                 elevation along the wave's path are measured from the particles with the same \
                 cubes for all runs; energy is ½ v² + g h a mass. Such a reference knows nothing \
                 of an error that all runs share, and the run next to it looks better than it is. \
                 After the impact particles are chaotic: only such sums are compared."
            ),
            Measure::Converged => "The distance from converged is that of the last frame's end: \
                the RMS over the particles, in spacings, of the way to where Newton's method in \
                f64 takes them until none is compressed by more than 1e-6. It is what further \
                iterations would still have to move; its time is not in the run's."
                .to_owned(),
            Measure::Projection => {
                let rows: Vec<_> = self
                    .done()
                    .filter_map(|run| run.measured.projection)
                    .collect();
                let most = rows.iter().map(|p| p.rows).max().unwrap_or(0);
                let worst = rows
                    .iter()
                    .fold(0.0, |worst: f64, p| worst.max(p.exact_residual));
                let by = if rows.iter().all(|p| p.has_factor) {
                    "a sparse Cholesky factor"
                } else {
                    "a sparse Cholesky factor where memory holds it, else conjugate gradients"
                };
                format!(
                    "One state of the scene is carried to the grid and projected once. The system \
                     is read back as the device has it (up to {most} rows) and solved in f64 by \
                     {by}, to a relative residual of {worst:.1e}: p64 is that solution, u64 the \
                     velocities that it leaves on the faces which a projection changes. An error \
                     is solver error alone: the system is the same, so that what the grid or the \
                     surface's treatment gets wrong is not in it. The pressure is taken as the \
                     solve has it; velocities are f32 whatever the solve's precision, and their \
                     rounding, some 3e-8, is the least error that they can show. A solve that \
                     missed its tolerance is counted under missed."
                )
            }
        });
        if let Some(coarser) = self
            .sweep
            .lines
            .iter()
            .find_map(|line| line.coarser.as_ref())
        {
            texts.push(self.coarser_words(&coarser.label));
        }
        texts.extend(self.sweep.lines.iter().filter_map(|line| {
            let other = &self.sweep.lines[line.against?];
            Some(format!(
                "{} is compared, value by value, with {}, not with its own finest run.",
                line.name, other.name
            ))
        }));
        let is_swept = self.sweep.lines.iter().any(|line| line.key == FRAME_RATE);
        if is_swept {
            texts.push(PIC_BLEND.to_owned());
        }
        texts
    }

    /// Explains how times were measured.
    pub(super) fn policy(&self) -> String {
        let (repeats, warm) = match self.sweep.state {
            Some(_) => ("projections", "one projection"),
            None => ("runs", "one frame"),
        };
        format!(
            "Times are wall clock, in the program, without files; a point is timed over {} \
             {repeats}, and the median stands with the least and the greatest. Each point warms up \
             with {warm} that does not count.",
            self.sweep.repeats
        )
    }

    fn coarser_words(&self, set: &str) -> String {
        let how = match self.sweep.state {
            Some(_) => {
                "the exact projection of the same particles on cells twice as large against that \
                 on this grid, where the two have faces and centres in common, after the mean over \
                 the smaller ones. With an error of first order, as ∇p has at the free surface, \
                 that is the error of this grid; with one of second order, three times it"
            }
            None => "one more run against the same finest one",
        };
        format!("The discretisation error, in the rows with the key coarser ({set}): {how}.")
    }
}

const KNEE: &str = "Where the study measured the discretisation error, the knee of a line is the \
    cheapest setting whose error is below a tenth of that: what a further one gains is lost in \
    what the grid or the step has wrong. Where it did not, the least product of error and time \
    stands in for it: up to there x times the time buys more than x times the accuracy, beyond it \
    less. Settings that another of the same line beats in both are left out of the account.";

const EQUAL_TIME: &str = "At equal time: another line's error at a point's time is read off \
    between its own settings, by straight lines in the logarithmic chart; the ratio is that error \
    over the point's own. Only times between two settings of the other line are compared.";

const WORK: &str = "The cost that no machine changes: with PBF neighbour visits, particles × \
    mean neighbours (at the run's end) × passes over them, which are two an iteration and one \
    search a substep; with FLIP products with the matrix of the finest grid, of which an \
    iteration of conjugate gradients takes one, IPP one more, as the incomplete Cholesky of the \
    f64 reference, a V-cycle 2.3 more.";

const PIC_BLEND: &str = "FLIP takes a part pic_blend of the grid's velocity a frame. Where the \
    frame rate is swept that part is tied to it, α = 1 − (1 − α_ref)^(Δt / Δt_ref) with the \
    scene's own rate as reference, so that the same part is taken a second; at a fixed α halving \
    Δt would double the dissipation.";
