//! Values that a check of PBF compares, and their tolerances; U = 2⁻²⁴, sums as in
//! `compare::rounding`.

use crate::{solids::GRID, sort::NEAR_FACE, table::entries};
use swell_compare::{
    rounding::{DENSITY, GRADIENT, LAMBDA, U, WALL_GRADIENT},
    tolerance::bounds,
};

bounds! {
    pub(super) REACH = [error: "the position's error before walls and solids push", grid: "" GRID]
        error + grid, "";
    pub(super) PUSHED = [error: "the position's error before walls and solids push",
        pushed: "near solids what the f64 reference's push answers when its input \
                 moves along each axis by " REACH,
        place: "by how much f32 misplaces a wall", x: "near solids |x|"]
        pushed.max(error) + (place + U * x), "";
    pub(super) OF_SOLIDS =
        [answer: "near solids that move, change of the f64 reference's work of them when its \
                  input moves along each axis by " REACH,
        work: "|their work|", push: "what they push", speed: "the fastest solid's"]
        answer + U * (16.0 * work + 60.0 * push * speed),
        "their velocity where they push has the rounding of that place";

    pub(super) PUSH_FREE = [slowed: "16 where the particle is slowed to the cap",
        speed: "|v| + |g| Δt"]
        U * (3.0 + slowed) * speed, "";
    pub(super) WAY = [x: "|x|", step: "Δt", speed: "|v| + |g| Δt", velocity: "" PUSH_FREE]
        U * (x + 4.0 * step * speed) + step * velocity, "";
    pub(super) STOPPED = [error: "" WAY, confined: "the tolerance of the position", x: "|x|",
        step: "Δt"]
        (error + confined + U * x) / step, "";

    pub(super) REPULSION = [artificial: "artificial pressure over Σ|∇C|² in the bulk",
        mass: "a sample's weight, or 1"]
        140.0 * 4.4 * artificial * mass, "w⁴ of p¹² is at most 4.4 and errs by 12 · 10 u of it";
    pub(super) DELTA = [relaxation: "ω", scale: "the gradient's scale",
        sums: "with w = |λ| + |λ'| " GRADIENT, repulsion: "Σ w s² with w = " REPULSION,
        lambda: "|λ|", walls: "over h " WALL_GRADIENT]
        relaxation * (scale * (sums + U * repulsion) + lambda * walls), "";
    pub(super) STEP = [delta: "" DELTA, step: "|Δx|"] delta + 16.0 * U * step, "";
    pub(super) MOMENTUM = [factor: "that of Chebyshev, or 1", error: "" STEP,
        last: "|the last step|"]
        factor * error + 4.0 * U * (factor - 1.0) * last, "";
    pub(super) CORRECTED = [error: "" MOMENTUM, x: "|x|"] error + U * x, "";
    pub(super) ACROSS = [error: "" STEP, last: "|the last step|"]
        2.0 * error * last,
        "Δx · the last step = 0, whose sign decides whether a semi-iteration goes on; and where \
         two particles are closer than 1.5e-6 h without being coincident, or three coincide";
    pub(super) WORKED = [factor: "that of Chebyshev, or 1", error: "" STEP, push: "" PUSHED,
        x: "|x|"]
        (2.0 * factor - 1.0) * error + push + U * x,
        "a semi-iteration counts this step's part for that of the last one too";

    pub(super) NEAR_CAP = [cap: "the displacement cap"] 30.0 * U * cap, "";
    pub(super) UPDATED = [v: "|v|", way: "|x* − x*₀|/Δt",
        slowed: "|v| of a particle at the cap or beyond, else 0"]
        U * (v + 4.0 * way) + 20.0 * U * slowed, "";
    pub(super) NEAR_H = [] 10.0 * U, "r² / h² = 1, as r² errs by 5 u and h² by 3 u";
    pub(super) NEAR_TARGET = [n: "particles", sum: "the sum"]
        (n / 65536.0 + 10.0) * U * sum, "the threshold";
    pub(super) SHIFT = [diagonal: "the domain's"] 2.0 * U * diagonal, "";
}

entries! {
    "upload of solids" {
        SAMPLES = "sample positions", "m": [x: "|x|"] U * x, "one rounding";
        WEIGHTS = "sample weights", "": [w: "the weight"] U * w, "one rounding";
    }
    "pbf/predict" {
        PREDICT_POSITION = "predicted position", "m": [error: "" WAY,
            moved: "near solids what the f64 reference answers when its input \
                    moves along each axis by " REACH,
            place: "where a wall pushes, by how much f32 misplaces it",
            x: "where a solid pushes |x|, and four periods where one carries it"]
            moved.max(error) + (place + U * x),
            "each velocity term 3 u; walls and solids bend the way";
        PREDICT_VELOCITY = "velocity", "m/s": [velocity: "" PUSH_FREE,
            stopped: "where walls or solids take part of the way " STOPPED, v: "|v|"]
            velocity + stopped + 4.0 * U * v, "3 u of each term";
        PREDICT_WORK = "work of walls", "m²/s": [speed: "the fastest wall's", push: "" PUSHED,
            x: "|x|", work: "|work|", solids: "" OF_SOLIDS]
            3.0 * speed * (push + U * x) + 4.0 * U * work + solids,
            "walls' speed times what they push";
    }
    "pbf/assign_cells" {
        CELL = "cell", "": [] 0.0, "a whole number", tie NEAR_FACE;
        COUNTS = "particles in cells", "": [] 0.0, "whole numbers";
        SLOTS = "slots in cells", "": [] 0.0, "whole numbers: each slot once";
    }
    "pbf/reorder" {
        REORDER_POSITION = "position", "m": [] 0.0, "a copy";
        REORDER_VELOCITY = "velocity", "m/s": [] 0.0, "a copy";
        REORDER_ID = "id", "": [] 0.0, "a copy";
        REORDER_PLACE = "place in a word", "": []
            0.0, "whole numbers of products that are rounded alike";
        REORDER_DROP = "drop", "": [] 0.0, "a copy";
    }
    "pbf/build_neighbors" {
        NEIGHBORS = "wrong members of a list", "": [] 0.0, "none is wrong", tie NEAR_H;
    }
    "pbf/compute_lambda" {
        DENSITY_OF_LAMBDA = "relative density", "": [error: "" DENSITY] error, "";
        OF_LAMBDA = "lambda", "m²": [error: "" LAMBDA] error, "";
    }
    "pbf/compute_delta" {
        OF_DELTA = "corrected position", "m": [error: "" CORRECTED,
            moved: "near solids what the f64 reference answers when its input \
                    moves along each axis by " REACH,
            place: "where a wall pushes, by how much f32 misplaces it",
            x: "where a solid pushes |x|"]
            moved.max(error) + (place + U * x), "walls and solids bend the way", tie ACROSS;
        DELTA_WORK = "work of walls", "m²/s": [speed: "the fastest wall's or solid's",
            error: "" WORKED, sums: "|the sum before| + |the sum after|", added: "|what is added|",
            solids: "" OF_SOLIDS]
            3.0 * speed * error + 2.0 * U * sums + 16.0 * U * added + solids,
            "their speed times what they push", tie ACROSS;
    }
    "pbf/exchange" {
        TAKEN_OVER = "position", "m": [] 0.0, "what was corrected";
        CARRIED = "lambda carried along", "m²": [] 0.0, "a copy";
        KEPT = "position before", "m": [] 0.0, "a copy";
    }
    "pbf/boundary_work" {
        WORK = "shares of the work", "m²/s": [sizes: "Σ|w|", before: "|what was there|",
            after: "|what is there|"]
            U * (66.0 * sizes + before + after), "66 sums";
    }
    "pbf/sum_error" {
        ERROR_SUMS = "sums of density error", "": [sum: "the sum"]
            9.0 * U * sum, "eight sums in a row";
    }
    "pbf/decide" {
        DECISION = "done, iterations", "": []
            0.0, "and what is counted over the frame", tie NEAR_TARGET;
    }
    "pbf/update_velocity" {
        UPDATE_POSITION = "position", "m":
            [x: "|x| of a particle at the cap or beyond, else 0, and four \
                 periods where one carries it",
            step: "of such a particle Δt, else 0", velocity: "" UPDATED]
            U * x + step * velocity, "a copy where none is slowed or carried";
        UPDATE_VELOCITY = "velocity", "m/s": [velocity: "" UPDATED]
            velocity, "one sum and a quotient";
        CAPPED = "particles slowed", "": [near: "particles as near to the cap as " NEAR_CAP]
            near, "a count";
        UPDATE_PLACE = "position for neighbours", "m": [] 0.0, "a copy";
        UPDATE_ID = "id", "": [] 0.0, "a copy";
        UPDATE_DROP = "drop", "": [] 0.0, "a copy";
    }
    "pbf/measure_density" {
        MEASURED = "relative density", "": [error: "" DENSITY] error, "";
    }
    "whole solve" {
        WHOLE_DELTA = "corrections, RMS error", "m":
            [answer: "the RMS by which the f64 solve's corrections answer when every \
                      coordinate moves before each iteration, each particle on its own or \
                      each layer alike, by ± " SHIFT]
            4.0 * answer, "accumulated; one set of moves is a sample of what roundings do";
        WHOLE_DENSITY = "relative density, RMS error", "":
            [answer: "the RMS by which the density after the f64 solve answers to the \
                      moves of the row above, ± " SHIFT]
            4.0 * answer, "accumulated";
        WHOLE_LAMBDA = "lambda, RMS error", "m²":
            [answer: "the RMS by which λ after the f64 solve answers to the same moves, ± " SHIFT]
            4.0 * answer, "accumulated";
    }
}
