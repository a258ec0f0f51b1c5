//! Piston motion for one solitary wave (Goring 1978).

/// Kλ/d of the solitary piston: the crest's distance when it starts. At 6 the wall's speed jumps by
/// sech²(6) = 2.5e-5 of its peak, less than a tenth of a millimetre per second in a metre of water,
/// which counts as rest.
const SOLITARY_LEAD: f64 = 6.0;

/// Goring's piston: X = (H/K)[tanh χ + tanh(Kλ/d)], χ = (K/d)(ct − X − λ), K = √(3H/4d).
pub(super) struct Goring {
    height: f64,
    depth: f64,
    /// K.
    wave_number: f64,
    /// c = √(g(d + H)), m/s.
    celerity: f64,
}

impl Goring {
    pub(super) fn new(height: f64, depth: f64, gravity: f64) -> Self {
        Self {
            height,
            depth,
            wave_number: (0.75 * height / depth).sqrt(),
            celerity: (gravity * (depth + height)).sqrt(),
        }
    }

    fn chi(&self, t: f64, x: f64) -> f64 {
        self.wave_number / self.depth * (self.celerity * t - x) - SOLITARY_LEAD
    }

    /// Displacement by Newton's method within a bracket, and velocity X' = cH sech²χ / (d + H
    /// sech²χ), from differentiating the implicit equation.
    pub(super) fn state(&self, t: f64) -> (f64, f64) {
        let scale = self.height / self.wave_number;
        let lead = SOLITARY_LEAD.tanh();
        let (mut low, mut high) = (0.0, scale * (1.0 + lead));
        let mut x = 0.5 * high;
        // The residual increases with X: Newton converges quadratically, and bisection keeps it in
        // the bracket.
        for _ in 0..60 {
            let tanh = self.chi(t, x).tanh();
            let residual = x - scale * (tanh + lead);
            if residual > 0.0 {
                high = x;
            } else {
                low = x;
            }
            let slope = 1.0 + self.height / self.depth * (1.0 - tanh * tanh);
            let newton = x - residual / slope;
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            let step = (next - x).abs();
            x = next;
            if step <= 1e-15 * scale {
                break;
            }
        }
        let sech_squared = self.chi(t, x).cosh().powi(-2);
        let push = self.height * sech_squared;
        (x.max(0.0), self.celerity * push / (self.depth + push))
    }

    /// Time at which χ = 0 and the wall is fastest, seconds.
    pub(super) fn crest_time(&self) -> f64 {
        let x = self.height / self.wave_number * SOLITARY_LEAD.tanh();
        (SOLITARY_LEAD * self.depth / self.wave_number + x) / self.celerity
    }
}

#[cfg(test)]
mod tests {
    use super::super::Motion;
    use super::*;

    #[test]
    fn the_solitary_piston_obeys_gorings_equation_and_starts_at_rest() {
        let (height, depth, gravity) = (0.3, 1.0, 9.81);
        let motion = Motion::Solitary {
            height,
            depth,
            gravity,
        };
        let goring = Goring::new(height, depth, gravity);
        let scale = height / goring.wave_number;
        for i in 1..100 {
            let t = 0.08 * f64::from(i);
            let x = motion.displacement(t);
            let implicit = scale * (goring.chi(t, x).tanh() + SOLITARY_LEAD.tanh());
            assert!((x - implicit).abs() < 1e-14, "{t}");
        }
        assert!(motion.velocity(1e-9) < 1e-4);
        // Full stroke (H/K)(1 + tanh(Kλ/d)), and u = cH/(d + H) at the crest.
        let stroke = scale * (1.0 + SOLITARY_LEAD.tanh());
        assert!((motion.displacement(60.0) - stroke).abs() < 1e-12);
        let peak = goring.celerity * height / (depth + height);
        assert!((motion.velocity(goring.crest_time()) - peak).abs() < 1e-12);
    }

    /// Goring 1978 in closed form, without the code's own quantities: the stroke √(16 H d / 3), the
    /// wall's greatest speed c H / (d + H) with c = √(g (d + H)), and the time from a quarter to
    /// three quarters of the stroke.
    #[test]
    fn the_solitary_piston_has_gorings_stroke_celerity_and_duration() {
        let (height, depth, gravity) = (0.3, 1.0, 9.81);
        let motion = Motion::Solitary {
            height,
            depth,
            gravity,
        };
        // The motion starts at χ = −6, where tanh is 1 − 1.2e-5.
        let stroke = (16.0_f64 * height * depth / 3.0).sqrt();
        let end = motion.displacement(60.0);
        assert!((end / stroke - 1.0).abs() < 1e-5, "{end} {stroke}");
        let celerity = (9.81_f64 * 1.3).sqrt();
        let fastest = (0..60_000)
            .map(|i| motion.velocity(1e-4 * f64::from(i)))
            .fold(0.0, f64::max);
        // The speed has its maximum at the crest: half a step of 1e-4 s changes it by 1e-8.
        let expected = celerity * 0.3 / 1.3;
        assert!((fastest / expected - 1.0).abs() < 1e-7, "{fastest}");
        assert!((motion.peak_speed(0.0, 60.0) / expected - 1.0).abs() < 1e-12);
        // Time at which the wall has moved by x, by bisection.
        let when = |x: f64| {
            let (mut low, mut high) = (0.0, 60.0);
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if motion.displacement(middle) < x {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        };
        // tanh χ goes from −½ to ½: c Δt = ΔX + 2 artanh(½) d / K, and 2 artanh(½) = ln 3,
        // d / K = S d / 2H.
        let took = when(0.75 * stroke) - when(0.25 * stroke);
        let expected = (0.5 * stroke + 3f64.ln() * stroke * depth / (2.0 * height)) / celerity;
        assert!((took / expected - 1.0).abs() < 1e-4, "{took} {expected}");
    }
}
