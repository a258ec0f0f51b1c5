//! What a check of PBF compares, and where each tolerance comes from; u = 2⁻²⁴, sums as in `compare::rounding`.

use crate::compare::check::fields;

fields! {
    SAMPLES = "upload of solids", "sample positions", "m", "one rounding: u |x|";
    WEIGHTS = "upload of solids", "sample weights", "", "one rounding: u w";
    PREDICT_POSITION = "pbf/predict", "predicted position", "m",
        "u |x| + Δt (3 u of each velocity term); through walls and solids: what the f64 twin answers when its input moves by \
         that much along each axis, with 7 u of the distance to the grid's origin";
    PREDICT_VELOCITY = "pbf/predict", "velocity", "m/s",
        "3 u of each term; where walls or solids took part of the way, the positions' tolerance over Δt";
    PREDICT_WORK = "pbf/predict", "work of walls", "m²/s",
        "3 times the walls' speed times the tolerance of what they push + u |x|, + 4 u";
    CELL = "pbf/assign_cells", "cell", "",
        "equal; within 4 u |x|/h of a cell's face either cell is right";
    COUNTS = "pbf/assign_cells", "particles in cells", "", "whole numbers: equal";
    SLOTS = "pbf/assign_cells", "slots in cells", "", "whole numbers: each slot once";
    REORDER_POSITION = "pbf/reorder", "position", "m", "a copy: equal";
    REORDER_VELOCITY = "pbf/reorder", "velocity", "m/s", "a copy: equal";
    REORDER_ID = "pbf/reorder", "id", "", "a copy: equal";
    NEIGHBORS = "pbf/build_neighbors", "wrong members of a list", "",
        "none; at r² = h² (1 ± 10 u) both answers are right: r² errs by 5 u, h² by 3 u";
    DENSITY_OF_LAMBDA = "pbf/compute_lambda", "relative density", "",
        "scale u (30 Σp² + (n + 6) Σp³), and for each wall within h 1.23 times its place's error over h, 26 u more";
    LAMBDA = "pbf/compute_lambda", "lambda", "m²",
        "(the density's + |λ| the denominator's) / denominator + 8 u |λ|; denominator: 2 |∇C| its error, a gradient being \
         good to u (22 Σs + (n + 16) Σs²), + u (n + 50) Σs² scale²";
    DELTA = "pbf/compute_delta", "corrected position", "m",
        "ω scale u (22 Σ|λ|s + (n + 16) Σ|λ|s²) + λ times the walls' gradient's error + 16 u |Δx| + u |x|, through walls and \
         solids as in pbf/predict; Chebyshev: ω times that, and where Δx is across the last step by rounding alone, a tie";
    CARRIED = "pbf/compute_delta", "lambda carried along", "m²", "a copy: equal";
    DELTA_WORK = "pbf/compute_delta", "work of walls", "m²/s",
        "3 times the walls' speed times (2 ω − 1) times the correction's tolerance + that of what they push + u |x|, + 16 u of \
         what is added and 2 u of the sums; Chebyshev: ties as above";
    WORK = "pbf/boundary_work", "shares of the work", "m²/s", "66 sums: 66 u Σ|w|, + u of what was there";
    ERROR_SUMS = "pbf/sum_error", "sums of density error", "", "eight sums in a row: 9 u of the sum";
    DECISION = "pbf/decide", "done, iterations", "",
        "equal, and what is counted over the frame; a tie where the sum is within (n/65536 + 10) u of the threshold";
    UPDATE_POSITION = "pbf/update_velocity", "position", "m",
        "equal; of a particle that is slowed u |x| + Δt times its velocity's tolerance";
    UPDATE_VELOCITY = "pbf/update_velocity", "velocity", "m/s",
        "u |v| + 4 u |x* − x*₀|/Δt; 20 u |v| more where it is slowed";
    UPDATE_ID = "pbf/update_velocity", "id", "", "a copy: equal";
    CAPPED = "pbf/update_velocity", "particles slowed", "",
        "equal, but for those within 30 u of the cap";
    MEASURED = "pbf/measure_density", "relative density", "", "as that of pbf/compute_lambda";
    WHOLE_DELTA = "whole solve", "corrections, RMS error", "m",
        "accumulated: 4 times the RMS by which the corrections of the f64 solve answer when every coordinate moves by ± 2 u \
         of the domain's diagonal before each iteration, each particle on its own or each layer of particles alike";
    WHOLE_DENSITY = "whole solve", "relative density, RMS error", "",
        "accumulated: 4 times the RMS by which the density after the f64 solve answers to the same moves";
    WHOLE_LAMBDA = "whole solve", "lambda, RMS error", "m²",
        "accumulated: 4 times the RMS by which λ after the f64 solve answers to the same moves";
}
